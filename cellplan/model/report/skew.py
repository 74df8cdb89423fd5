"""Allowed skew: how far the clocks of controllers may be apart before a demand of the cell is no longer proved."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from cellplan.model.cell.cell import Cell

MOST_SKEW: Final = 0.2  # [s] up to which an allowed skew is searched


class SkewLimit(StrEnum):
    """What limits an allowed skew."""

    TOOL = "tool tolerance"
    DEPTH = "tool depth"
    CLEARANCE = "clearance"
    END = "phase end"


@dataclass(frozen=True, slots=True, kw_only=True)
class AllowedSkew:
    """Largest skew of two clocks that is proved to keep one demand."""

    limit: SkewLimit  # the demand
    skew: float  # in [s], either clock ahead of the other; ``MOST_SKEW`` where it is that or more
    subject: str = ""  # task, grasp or bodies that limit it; empty where nothing does
    # time of the part's clock, or else of the first robot's, in [s] at which it does; None likewise
    at_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class PairSkew:
    """Two robots whose clocks are not the same."""

    first: str  # the one robot
    second: str  # the other one
    limits: tuple[AllowedSkew, ...]  # what each demand allows; a demand that does not depend on the two is left out
    stated: float | None = None  # largest difference in [s] that is stated of their clocks; None for nothing stated

    @property
    def least(self) -> AllowedSkew | None:
        """The demand that allows least, the first of these; None without any."""
        return min(self.limits, key=lambda allowed: allowed.skew, default=None)

    @property
    def allowed(self) -> float:
        """Skew in [s] that keeps every demand; ``MOST_SKEW`` where it is that or more."""
        return MOST_SKEW if self.least is None else self.least.skew

    @property
    def is_met(self) -> bool | None:
        """Whether what is stated is no more than what is allowed; None without a statement."""
        return None if self.stated is None else self.stated <= self.allowed


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolSkew:
    """Error of a tool on the part that another controller carries, by the skew of the two clocks."""

    name: str  # name of the task, or of the grasp of a further holder
    robot: str  # the robot of the tool
    carrier: str  # the first holder of the part
    speed: float  # largest speed of the tool in the components that are constrained in [m/s]: what a skew costs
    by_position: float  # skew in [s] that keeps the tolerance in position; ``MOST_SKEW`` where it is that or more
    by_orientation: float  # likewise the tolerance in orientation
    at_s: float | None  # time in [s] at which the smaller one is least; None where nothing limits it
    # upper bound of the position error in [m] at the skew that is stated; None for nothing stated
    position: float | None = None
    orientation: float | None = None  # likewise of the orientation error in [rad]
    # time in [s] that the program has to take, all of it slower by one factor, to keep the tolerance at that skew; None
    # for nothing stated, 0 where any time does, and inf where none does
    shortest_cycle: float | None = None

    @property
    def allowed(self) -> float:
        """Skew in [s] that keeps both; ``MOST_SKEW`` where it is that or more."""
        return min(self.by_position, self.by_orientation)


@dataclass(frozen=True, slots=True, kw_only=True)
class SkewReport:
    """Allowed skew of a run."""

    pairs: tuple[PairSkew, ...]  # all pairs of robots whose clocks are not the same, in the order of the cell
    tools: tuple[ToolSkew, ...]  # all tools on a part that another controller carries
    groups: tuple[tuple[str, ...], ...]  # robots that share a clock

    @property
    def least(self) -> PairSkew | None:
        """The pair that allows least, the first of these; None without any."""
        return min(self.pairs, key=lambda pair: pair.allowed, default=None)

    @property
    def allowed(self) -> float:
        """Skew in [s] between any two clocks that keeps every demand; ``MOST_SKEW`` where it is that or more."""
        return MOST_SKEW if self.least is None else self.least.allowed

    @property
    def alone(self) -> float:
        """Shift in [s] of each clock by itself, forward or back, that keeps every demand.

        Two clocks are then apart by twice as much; half of ``MOST_SKEW`` where it is that or more.
        """
        return 0.5 * self.allowed


def has_clocks(cell: Cell) -> bool:
    """Whether a cell states controllers, and its robots are on more than one clock."""
    return bool(cell.controllers) and len(clock_groups(cell)) > 1


def clock_groups(cell: Cell) -> tuple[tuple[str, ...], ...]:
    """Robots that share a clock, in the order of the cell."""
    groups: dict[tuple[bool, str], list[str]] = {}
    for robot in cell.robots:
        key = (False, robot.name) if robot.control is None else (True, robot.control.id)
        groups.setdefault(key, []).append(robot.name)
    return tuple(tuple(group) for group in groups.values())
