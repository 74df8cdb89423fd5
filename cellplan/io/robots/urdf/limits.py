"""Joint limits: those of the URDF, tightened or supplied by the cell."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.io.robots.urdf.document import UrdfJoint
from cellplan.io.robots.urdf.tree import in_user_unit

ROOM: Final = 1e-9  # [rad] or [m]: degrees in a cell do not read back to the last bit
MAX_TURN: Final = 4.0 * np.pi  # [rad] limits beyond two turns each way are slips of the unit
MAX_TRAVEL: Final = 20.0  # [m]
MAX_TURN_SPEED: Final = 100.0  # [rad/s] the fastest wrists reach 20
MAX_TRAVEL_SPEED: Final = 10.0  # [m/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointLimits:
    """Limits of one joint from the cell in [rad], [m] and their rates; None leaves the URDF's.

    Attributes:
        lower: Lowest position.
        upper: Highest position.
        velocity: Largest speed.
        acceleration: Largest acceleration, if known.
        jerk: Largest jerk, if known.
        wraps: Whether a continuous joint may turn without end.
    """

    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    wraps: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """Complete limits of one joint; infinite positions where it may turn without end.

    ``rated_velocity`` is the URDF's own top speed where the cell names another; None where it does not.
    """

    lower: float
    upper: float
    velocity: float
    rated_velocity: float | None = None


def joint_range(joint: UrdfJoint, desired: JointLimits, followers: Iterable[UrdfJoint]) -> Range:
    """Limits of a driven joint: the tightest of the URDF's, the cell's and those of the joints that follow it.

    Raises:
        InputError: A limit is missing, is widened by the cell, leaves no room or has an unlikely size.
    """
    lower, upper = _positions(joint, desired)
    velocity = _speed(joint, desired)
    for follower in followers:
        lower, upper, velocity = _within_follower(follower, lower, upper, velocity=velocity)
    if not lower < upper:
        got = f"{in_user_unit(joint, lower)} and {in_user_unit(joint, upper)}"
        raise joint.error(f"expected the lower limit below the upper one, got {got}")
    _require_likely(joint, Range(lower=lower, upper=upper, velocity=velocity))
    rated = None if desired.velocity is None else joint.limit.velocity
    return Range(lower=lower, upper=upper, velocity=velocity, rated_velocity=rated)


def _positions(joint: UrdfJoint, desired: JointLimits) -> tuple[float, float]:
    """Lower and upper limit."""
    if desired.wraps:
        return _endless(joint, desired)
    given = joint.limit
    if given.lower is None or given.upper is None:
        if desired.lower is None or desired.upper is None:
            raise joint.error(_missing_positions(joint))
        return desired.lower, desired.upper
    for name, own, new, is_wider in (
        ("lower", given.lower, desired.lower, desired.lower is not None and desired.lower < given.lower - ROOM),
        ("upper", given.upper, desired.upper, desired.upper is not None and desired.upper > given.upper + ROOM),
    ):
        if is_wider and new is not None:
            got = f"{in_user_unit(joint, new)} against {in_user_unit(joint, own)} in the URDF"
            raise joint.error(f"expected the {name} limit of the cell to tighten the URDF's, got {got}")
    return max(given.lower, _or(desired.lower, given.lower)), min(given.upper, _or(desired.upper, given.upper))


def _endless(joint: UrdfJoint, desired: JointLimits) -> tuple[float, float]:
    """Limits of a joint that the cell lets turn without end."""
    if joint.kind != "continuous":
        raise joint.error(f"expected `wrap: true` only for a continuous joint, got a {joint.kind} one")
    if desired.lower is not None or desired.upper is not None:
        raise joint.error("expected either `wrap: true` or limits, got both")
    return -np.inf, np.inf


def _missing_positions(joint: UrdfJoint) -> str:
    """What to write in the cell when the URDF has no position limits."""
    unit = "mm" if joint.kind == "prismatic" else "deg"
    bounds = f"`limits: {{{joint.name}: {{lower_{unit}: …, upper_{unit}: …}}}}`"
    if joint.kind == "continuous":
        return (
            f"is continuous: give it {bounds}, or `limits: {{{joint.name}: {{wrap: true}}}}` to let it turn without end"
        )
    return f"has no room between 'lower' and 'upper' in the URDF: give it {bounds}"


def _speed(joint: UrdfJoint, desired: JointLimits) -> float:
    """Speed limit."""
    own, new = joint.limit.velocity, desired.velocity
    unit = "mm_s" if joint.kind == "prismatic" else "deg_s"
    if own is None and new is None:
        cure = f"give it `limits: {{{joint.name}: {{velocity_{unit}: …}}}}`"
        raise joint.error(f"has no positive velocity limit in the URDF: {cure}")
    if new is not None and not new > 0.0:
        raise joint.error(f"expected a positive velocity limit, got {in_user_unit(joint, new, '/s')}")
    if own is not None and new is not None and new > own * (1.0 + ROOM):
        got = f"{in_user_unit(joint, new, '/s')} against {in_user_unit(joint, own, '/s')} in the URDF"
        raise joint.error(f"expected the velocity limit of the cell to tighten the URDF's, got {got}")
    return min(_or(own, np.inf), _or(new, np.inf))


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


def _require_likely(joint: UrdfJoint, limits: Range) -> None:
    """Refuse limits that look like degrees taken for radians or millimetres taken for metres."""
    slides = joint.kind == "prismatic"
    largest = max((abs(end) for end in (limits.lower, limits.upper) if np.isfinite(end)), default=0.0)
    if largest > (MAX_TRAVEL if slides else MAX_TURN):
        hint = "20 m, got {:g} m: is the unit mm?" if slides else "two turns, got {:g} rad: is the unit degrees?"
        raise joint.error(f"expected position limits within {hint.format(largest)}")
    if limits.velocity > (MAX_TRAVEL_SPEED if slides else MAX_TURN_SPEED):
        hint = "10 m/s, got {:g} m/s: is the unit mm/s?" if slides else "100 rad/s, got {:g} rad/s: is it in deg/s?"
        raise joint.error(f"expected a velocity limit of at most {hint.format(limits.velocity)}")


def _or(value: float | None, other: float) -> float:
    """The value, or the other one where there is none."""
    return other if value is None else value
