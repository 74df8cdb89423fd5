"""Gripper of a URDF: the joints beyond the flange that open it, and the positions at which a cell holds them."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.files.robots.urdf.document.document import UrdfDocument, UrdfJoint, UrdfMimic
from cellplan.files.robots.urdf.tree import UrdfTree, ZeroConfiguration, in_user_unit, known_joint
from cellplan.geometry.shapes import support_point
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import Body
from cellplan.model.units import MM

OPPOSED_TOL: Final = 1e-3  # [-] two fingers whose unit directions add up to less move against each other
RANGE_TOL: Final = 1e-9  # [m] or [rad]: rounding of millimetres and degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class GripperState:
    """How far a cell opens the gripper of a URDF."""

    joints: tuple[str, ...] = ()  # joints that open it; none for the only movable one beyond the flange
    opening: float | None = None  # travel of all sliding fingers together from closed in [m]; None for an angle
    angle: float | None = None  # position of the one joint of turning fingers in [rad]; None for an opening


@dataclass(frozen=True, slots=True)
class Finger:
    """A sliding joint of a gripper, and its travel for each metre that the joint which leads it opens."""

    joint: UrdfJoint
    ratio: float


def gripper_locks(tree: UrdfTree, flange: str, state: GripperState | None, locked: Collection[str]) -> dict[str, float]:
    """Positions in [rad] or [m] at which a gripper's joints are held, by joint name; none without a gripper.

    ``InputError`` where joints are no gripper's, have another unit, or do not reach so far.
    """
    if state is None:
        return {}
    leaders = _leaders(tree, flange, state, locked)
    if state.angle is not None:
        return {leaders[0].name: _angle(leaders, state.angle)}
    fingers = [finger for leader in leaders for finger in _fingers(tree.document, leader)]
    if not 1 <= len(fingers) <= 2:
        cure = "state the position of each joint under `locked`"
        raise leaders[0].error(f"opens a gripper of {len(fingers)} fingers: expected one or two for opening_mm: {cure}")
    widest = min(_range(tree.document, leader) for leader in leaders) * sum(abs(finger.ratio) for finger in fingers)
    opening = state.opening or 0.0
    if opening > widest + RANGE_TOL:
        allowed = f"expected gripper.opening_mm from 0 to {MM * widest:.6g}"
        raise leaders[0].error(f"{allowed}, the travel of {_words(fingers)}, got {MM * opening:.6g}")
    travel = opening / sum(abs(finger.ratio) for finger in fingers)
    return {leader.name: _closed_end(leader) + _sign(leader) * travel for leader in leaders}


def require_opposed(
    tree: UrdfTree,
    state: GripperState | None,
    *,
    locks: Mapping[str, float],
    configuration: ZeroConfiguration,
    bodies: Sequence[Body],
) -> None:
    """Refuse two fingers that do not move against each other, or that close as their joints leave the closed ends.

    Without a state there is no gripper. The locks are positions of its joints, by name.
    """
    if state is None or state.opening is None:
        return
    fingers = [finger for name in locks for finger in _fingers(tree.document, tree.document.joints[name])]
    if len(fingers) != 2:
        return
    one, other = fingers
    cure = "state the positions of the joints under `locked`"
    u, v = (_direction(finger, configuration) for finger in fingers)
    if np.linalg.norm(u + v) > OPPOSED_TOL:
        raise one.joint.error(f"does not move against '{other.joint.name}', so an opening says nothing: {cure}")
    p, q = (_middle(finger.joint.child, bodies, u) for finger in fingers)
    if p < q:
        raise one.joint.error(f"closes as it leaves the end of its range nearest to zero: {cure}")


def _leaders(tree: UrdfTree, flange: str, state: GripperState, locked: Collection[str]) -> list[UrdfJoint]:
    document, driven = tree.document, _driven_to(tree, flange, locked)
    movable = [
        joint
        for joint in tree.joints
        if not (joint.is_fixed or joint.mimic or joint in driven) and _driven_to(tree, joint.parent, locked) == driven
    ]
    beyond = [joint for joint in movable if joint.name not in locked]
    held = [joint.name for joint in movable if joint.name in locked and joint not in tree.path_to(flange)]
    if not state.joints:
        if len(beyond) != 1:
            raise InputError(f"{document.file}: gripper{_unclear(beyond, flange, held)}")
        return beyond
    for name in state.joints:
        joint = known_joint(document, name, "gripper.joints")
        if joint.mimic:
            raise joint.error(f"follows '{joint.mimic.leader}': name that one under gripper.joints")
        if name in locked:
            raise joint.error("is held by `gripper` and by `locked`: remove it from one of them")
        if joint not in beyond:
            known = [joint.name for joint in beyond]
            hint = did_you_mean(name, known) or f": expected one of {listed(known)}"
            raise joint.error(f"is named under gripper.joints, but does not move beyond the flange '{flange}'{hint}")
    return [document.joints[name] for name in state.joints]


def _unclear(beyond: Sequence[UrdfJoint], flange: str, held: Sequence[str]) -> str:
    """Why the joints that open a gripper have to be named, or why there are none."""
    if beyond:
        names = listed(joint.name for joint in beyond)
        return (
            f".joints: expected the joints that open it, as those beyond the flange '{flange}' that move are: {names}"
        )
    text = f": expected a joint beyond the flange '{flange}' that moves, got none"
    return f"{text} but {listed(held)}, held by `locked`: remove from there what opens the gripper" if held else text


def _driven_to(tree: UrdfTree, link: str, locked: Collection[str]) -> list[UrdfJoint]:
    """Joints from the base to a link that may move."""
    return [joint for joint in tree.path_to(link) if not joint.is_fixed and joint.name not in locked]


def _angle(leaders: Sequence[UrdfJoint], angle: float) -> float:
    """Position of the one joint of turning fingers."""
    joint = leaders[0]
    if len(leaders) > 1:
        raise leaders[1].error("is named under gripper.joints: expected one joint for angle_deg: lock the other one")
    if joint.kind == "prismatic":
        raise joint.error("slides: expected gripper.opening_mm, got angle_deg")
    lower, upper = joint.limit.ends
    if not lower - RANGE_TOL <= angle <= upper + RANGE_TOL:
        allowed = f"{in_user_unit(joint, lower)} to {in_user_unit(joint, upper)}"
        raise joint.error(f"expected gripper.angle_deg within {allowed}, got {in_user_unit(joint, angle)}")
    return angle


def _fingers(document: UrdfDocument, leader: UrdfJoint) -> list[Finger]:
    """The sliding joints that a leading one moves, itself first."""
    followers = _followers(document, leader)
    for joint in (leader, *(joint for joint, _ in followers)):
        if joint.kind != "prismatic":
            lower, upper = leader.limit.ends
            cure = "state the position of the leading joint under `locked`"
            if leader.kind != "prismatic":
                cure = f"state angle_deg from {np.degrees(lower):.6g} to {np.degrees(upper):.6g}"
            raise joint.error(f"turns, so the opening of the gripper is not proportional to its position: {cure}")
    sign = _sign(leader)
    return [Finger(leader, sign), *(Finger(joint, sign * mimic.multiplier) for joint, mimic in followers)]


def _followers(document: UrdfDocument, leader: UrdfJoint) -> list[tuple[UrdfJoint, UrdfMimic]]:
    mimics = [(joint, joint.mimic) for joint in document.joints.values()]
    return [(joint, mimic) for joint, mimic in mimics if mimic and mimic.leader == leader.name]


def _sign(joint: UrdfJoint) -> float:
    """-1 for a finger that opens towards negative positions: one whose range ends at zero or below."""
    return -1.0 if joint.limit.ends[1] <= 0.0 else 1.0


def _closed_end(joint: UrdfJoint) -> float:
    """The end of a finger's range at which it is closed, in [m]: the lowest position, or zero where it ends there."""
    lower, upper = joint.limit.ends
    if not np.isfinite(upper - lower):
        raise joint.error("has no limits, so it has no closed end: state its position under `locked`")
    return lower if _sign(joint) > 0.0 else upper


def _range(document: UrdfDocument, leader: UrdfJoint) -> float:
    """Travel in [m] of a joint that leads from its closed end, as far as those that follow it reach, too."""
    closed, (lower, upper) = _closed_end(leader), leader.limit.ends
    travel = upper - lower
    for joint, mimic in _followers(document, leader):
        lower, upper = joint.limit.ends
        start = mimic.multiplier * closed + mimic.offset
        if not lower - RANGE_TOL <= start <= upper + RANGE_TOL:
            within = f"{in_user_unit(joint, lower)} to {in_user_unit(joint, upper)}"
            raise joint.error(
                f"follows '{leader.name}' to {in_user_unit(joint, start)} where the gripper is closed, beyond its own "
                f"limits of {within}: state the position of '{leader.name}' under `locked`"
            )
        rate = _sign(leader) * mimic.multiplier
        if rate != 0.0:
            travel = min(travel, max(0.0, ((upper if rate > 0.0 else lower) - start) / rate))
    return travel


def _direction(finger: Finger, configuration: ZeroConfiguration) -> Array:
    """Unit direction in B in which a finger opens."""
    return np.sign(finger.ratio) * configuration.X_BJ[finger.joint.name][:3, :3] @ finger.joint.axis_J


def _middle(link: str, bodies: Sequence[Body], u: Array) -> float:
    """Middle of the bodies of a link along a unit direction of B in [m]; NaN for a link without any."""
    ends = [
        body.X_BS[:3, 3] @ u + support_point(body.shape, n) @ n * sign
        for body in bodies
        if body.link_name == link
        for sign, n in ((1.0, u @ body.X_BS[:3, :3]), (-1.0, -u @ body.X_BS[:3, :3]))
    ]
    return float(0.5 * (min(ends) + max(ends))) if ends else np.nan


def _words(fingers: Sequence[Finger]) -> str:
    return " and ".join(f"'{finger.joint.name}'" for finger in fingers)
