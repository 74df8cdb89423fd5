"""Joints that the cell holds still: those that it names, and all others that do not lead to the flange."""

from collections.abc import Mapping, Sequence

import numpy as np

from cellplan.errors import InputError
from cellplan.files.robots.limits import LIMIT_TOL
from cellplan.files.robots.urdf.document.document import UrdfDocument, UrdfJoint
from cellplan.files.robots.urdf.tree import UrdfTree, in_user_unit, joints_to, known_joint, unit_of
from cellplan.files.yaml.writer import flow_text
from cellplan.model.settings.units import file_number


def unlocked_joints(tree: UrdfTree, flange: str, locked: Mapping[str, float]) -> tuple[UrdfJoint, ...]:
    """Joints that move by themselves, do not lead to the flange and are not locked by name."""
    on_chain = {joint.name for joint in joints_to(tree, flange)}
    return tuple(
        joint
        for joint in tree.joints
        if not joint.is_fixed and joint.mimic is None and joint.name not in locked and joint.name not in on_chain
    )


def rest_position(joint: UrdfJoint) -> float:
    """Zero, or the position within the limits of the file that is nearest to it, in [rad] or [m]."""
    lower, upper = joint.limit.ends
    return min(max(0.0, lower), upper)


def lock_positions(joints: Sequence[UrdfJoint], locked: Mapping[str, float]) -> dict[str, float]:
    """Positions as a cell writes them, in degrees or millimetres by joint name with its unit.

    Those of joints at rest read back to positions within their limits.

    ``locked`` has the positions in [rad] or [m] of those that do not rest where `rest_position` says.
    """
    return {f"{joint.name}_{unit_of(joint).name}": _number(joint, locked.get(joint.name)) for joint in joints}


def unlocked_error(
    tree: UrdfTree, flange: str, unlocked: Sequence[UrdfJoint], locked: Mapping[str, float]
) -> InputError:
    """What to write in the cell when joints are neither locked nor lead to the flange, in one line for all of them.

    The line repeats those that are locked, with their positions in [rad] or [m] by name.
    """
    named = [tree.document.joints[name] for name in locked]
    text = flow_text(lock_positions([*named, *unlocked], locked))
    where = f"not between the base and the flange '{flange}'"
    cure = f"still with `locked: {text}` or with `locked: {{others: zero}}`"
    if len(unlocked) == 1:
        return unlocked[0].error(f"moves, but is {where}: hold it {cure}")
    return unlocked[0].element.error(
        f"{len(unlocked)} joints move, but are {where}: hold them {cure}, "
        "at zero or at the nearest position within their limits"
    )


def require_sound_locks(document: UrdfDocument, locked: Mapping[str, float], units: Mapping[str, str]) -> None:
    """Only movable joints that lead can be locked, in their own unit, and only where they can go.

    Positions are in [rad] or [m] by name of the joint, units ``deg`` or ``mm`` as they were written, if they were.
    """
    for name, position in locked.items():
        joint = known_joint(document, name, "locked")
        if joint.is_fixed:
            raise joint.error("is locked by the cell, but it is fixed anyway")
        if joint.mimic:
            raise joint.error(f"is locked by the cell, but it follows '{joint.mimic.leader}': lock that one")
        if units.get(name, unit_of(joint).name) != unit_of(joint).name:
            raise joint.error(f"is {joint.kind}: expected to be locked in {unit_of(joint).name}, got {units[name]}")
        lower, upper = joint.limit.ends
        if not (np.isfinite(position) and lower - LIMIT_TOL <= position <= upper + LIMIT_TOL):
            allowed = f"{in_user_unit(joint, lower)} to {in_user_unit(joint, upper)}"
            raise joint.error(f"expected to be locked within {allowed}, got {in_user_unit(joint, position)}")


def _number(joint: UrdfJoint, position: float | None) -> float:
    """A position in degrees or millimetres; the rest position where there is none."""
    is_revolute = joint.kind != "prismatic"
    if position is not None:
        return file_number(position, is_revolute=is_revolute)
    rest, (lower, upper) = rest_position(joint), joint.limit.ends
    within = max(lower, rest - LIMIT_TOL), min(upper, rest + LIMIT_TOL)
    return file_number(rest, is_revolute=is_revolute, within=within)
