"""Accelerations: requirements of a cell, and those of the written motion at joints, tools, part and processes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Final

from cellplan.model.units import DisplayUnit, joint_unit

USUAL_FULL_SPEED_IN: Final = (0.25, 0.25, 0.25, 0.15)  # [s] axes 1 to 3, then all others: arms of 5 to 20 kg do it
USUAL_CYCLE: Final = 0.004  # [s] of a controller that interpolates joints


class LimitSource(StrEnum):
    """Where the acceleration limit of a joint comes from."""

    STATED = "stated"
    ASSUMED = "assumed"
    UNLIMITED = "unlimited"
    NOT_STATED = "not_stated"


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerationRule:
    """Against which accelerations the joints of one robot are judged.

    A stated limit of a joint always counts, unless accelerations are not judged at all.
    """

    # for joints without a stated limit, the seconds in which they are taken to reach their top speed, in the order of
    # the joints; the last one counts for all further joints. Empty: nothing is assumed.
    full_speed_in: tuple[float, ...] = USUAL_FULL_SPEED_IN
    is_unlimited: bool = False  # whether neither accelerations nor jerk are judged
    reason: str = ""  # why they are not; empty where none is given


USUAL_ACCELERATION: Final = AccelerationRule()


@dataclass(frozen=True, slots=True, kw_only=True)
class JointAcceleration:
    """The acceleration and jerk of one joint in [rad] or [m] and seconds."""

    robot: str  # name of the robot
    joint: str  # name of the joint
    is_revolute: bool  # whether it turns rather than slides
    peak: float  # largest acceleration, the step out of rest and the one into rest included
    peak_at_s: float  # its instant
    limit: float | None  # what is allowed; None where nothing is
    source: LimitSource  # where the limit comes from
    peak_jerk: float  # largest change of acceleration over ``window``, divided by it
    peak_jerk_at_s: float  # its instant
    jerk_limit: float | None  # what is allowed; None where nothing is stated or nothing is judged
    window: float  # time in [s] over which jerk is taken
    is_jump: bool = False  # whether the peak is a jump of speed, out of rest or at a corner

    @property
    def ratio(self) -> float | None:
        """Largest acceleration as a share of its limit; None where there is no limit."""
        return None if self.limit is None else self.peak / self.limit

    @property
    def display_unit(self) -> DisplayUnit:
        """Unit in which its positions are printed."""
        return joint_unit(is_revolute=self.is_revolute)


@dataclass(frozen=True, slots=True, kw_only=True)
class PointAcceleration:
    """Acceleration in [m/s^2] and jerk in [m/s^3] of a point in the world, with their times in [s]."""

    peak: float
    peak_at_s: float
    peak_jerk: float
    peak_jerk_at_s: float
    window: float


@dataclass(frozen=True, slots=True, kw_only=True)
class PartAcceleration:
    """How the part is accelerated: at the centre of its bounding box, and at that corner of it that has most."""

    centre: PointAcceleration
    corner: PointAcceleration


@dataclass(frozen=True, slots=True, kw_only=True)
class ProcessSpeed:
    """How fast a tool tip moves on the part, or in the world for a task that is given there, while its task runs."""

    mean: float  # mean speed in [m/s] from the start of the path, once the tool has settled, to its end
    peak: float  # largest speed between two samples
    peak_at_s: float  # its instant
    steady_share: float  # share of that time, 0..1, in which the speed is within ``STEADY_FRACTION`` of the peak
    slower: tuple[tuple[float, float], ...]  # stretches of time in [s] in which it is lower, as (from, to)


@dataclass(frozen=True, slots=True, kw_only=True)
class NotJudged:
    """Something of a robot's accelerations that was not judged, and why; an empty robot stands for the whole cell."""

    robot: str
    what: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionAccelerations:
    """All accelerations of a written motion; the robots stand still before its first row and after its last one."""

    joints: tuple[JointAcceleration, ...] = ()  # one entry per joint of every robot
    tools: Mapping[str, PointAcceleration] = field(default_factory=dict)  # the tool tip of each robot, by robot
    part: PartAcceleration | None = None  # the part; None when no robot holds it
    # process speed by task; a task whose tool stands still has none
    process: Mapping[str, ProcessSpeed] = field(default_factory=dict)
    not_judged: tuple[NotJudged, ...] = ()  # what was left out


UNKNOWN_ACCELERATIONS: Final = MotionAccelerations()
STEADY_FRACTION: Final = 0.05  # [-] of the peak: a process speed that varies less is constant


def full_speed_in(rule: AccelerationRule, index: int) -> float | None:
    """Seconds in which a joint, counted from 0, is taken to reach its top speed; None where nothing is assumed."""
    return rule.full_speed_in[min(index, len(rule.full_speed_in) - 1)] if rule.full_speed_in else None
