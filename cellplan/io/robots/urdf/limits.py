"""Joint limits: those of the URDF, tightened or supplied by the cell."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from cellplan.io.robots.limits import StatedLimits, limit_findings, tightest
from cellplan.io.robots.urdf.document import UrdfJoint
from cellplan.io.robots.urdf.tree import in_user_unit


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Complete limits of one joint; infinite positions where it may turn without end.

    ``rated_velocity`` is the velocity limit of the URDF where the cell states one; None where it does not.
    """

    lower: float
    upper: float
    velocity: float
    rated_velocity: float | None = None


def joint_range(joint: UrdfJoint, cell: StatedLimits, followers: Iterable[UrdfJoint]) -> Range:
    """Limits of a driven joint: the tightest of the URDF's, the cell's and those of the joints that follow it.

    Raises:
        InputError: A limit is missing or of an unlikely size, is widened by the cell, or leaves no range.
    """
    given = joint.limit
    own = StatedLimits(lower=given.lower, upper=given.upper, velocity=given.velocity)
    for key, text in limit_findings(own, cell, is_revolute=joint.kind != "prismatic"):
        raise joint.error(f"{key}: {text}")
    limits = tightest(own, cell)
    lower, upper = _endless(joint, cell) if cell.wraps else (limits.lower, limits.upper)
    if lower is None or upper is None:
        raise joint.error(_missing_positions(joint))
    velocity = _velocity(joint, limits)
    for follower in followers:
        lower, upper, velocity = _within_follower(follower, lower, upper, velocity=velocity)
    if not lower < upper:
        ends = f"{in_user_unit(joint, lower)} and {in_user_unit(joint, upper)}"
        raise joint.error(f"expected a lower limit below the upper one, got {ends}")
    rated_velocity = None if cell.velocity is None else given.velocity
    return Range(lower=lower, upper=upper, velocity=velocity, rated_velocity=rated_velocity)


def _endless(joint: UrdfJoint, cell: StatedLimits) -> tuple[float, float]:
    """Limits of a joint that the cell lets turn without end."""
    if joint.kind != "continuous":
        raise joint.error(f"expected `wrap: true` only for a continuous joint, got a {joint.kind} one")
    if cell.lower is not None or cell.upper is not None:
        raise joint.error("expected either `wrap: true` or limits, got both")
    return -np.inf, np.inf


def _missing_positions(joint: UrdfJoint) -> str:
    """What to write in the cell when the URDF has no position limits."""
    unit = "mm" if joint.kind == "prismatic" else "deg"
    bounds = f"`limits: {{{joint.name}: {{lower_{unit}: …, upper_{unit}: …}}}}`"
    if joint.limit.position_fault:
        return f"{joint.limit.position_fault}: state {bounds} of the robot in the cell"
    if joint.kind == "continuous":
        return (
            f"is continuous: give it {bounds}, or `limits: {{{joint.name}: {{wrap: true}}}}` to let it turn without end"
        )
    return f"has no room between 'lower' and 'upper' in the URDF: give it {bounds}"


def _velocity(joint: UrdfJoint, limits: StatedLimits) -> float:
    """Velocity limit."""
    if limits.velocity is None:
        unit = "mm_s" if joint.kind == "prismatic" else "deg_s"
        cure = f"`limits: {{{joint.name}: {{velocity_{unit}: …}}}}`"
        if joint.limit.velocity_fault:
            raise joint.error(f"{joint.limit.velocity_fault}: state {cure} of the robot in the cell")
        raise joint.error(f"has no positive velocity limit in the URDF: give it {cure}")
    if not limits.velocity > 0.0:
        raise joint.error(f"expected a positive velocity limit, got {in_user_unit(joint, limits.velocity, '/s')}")
    return limits.velocity


def _within_follower(follower: UrdfJoint, lower: float, upper: float, *, velocity: float) -> tuple[float, float, float]:
    """Limits of a leader that keep its follower within its own."""
    mimic, limit = follower.mimic, follower.limit
    if mimic is None or mimic.multiplier == 0.0:
        return lower, upper, velocity
    if limit.lower is not None and limit.upper is not None:
        ends = sorted(((end - mimic.offset) / mimic.multiplier) for end in (limit.lower, limit.upper))
        lower, upper = max(lower, ends[0]), min(upper, ends[1])
    if limit.velocity is not None:
        velocity = min(velocity, limit.velocity / abs(mimic.multiplier))
    return lower, upper, velocity
