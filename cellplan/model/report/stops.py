"""What happens when one robot of a cell stops and the others go on for a while and then brake on their path."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellplan.model.cell.cell import Cell
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.units import si_or_none


@dataclass(frozen=True, slots=True, kw_only=True)
class StopInstant:
    """When a figure of a stop is reached."""

    stopped: str  # name of the robot that stops
    going: str  # name of the robot that goes on
    at_s: float  # instant in [s] at which the one stops
    path_s: float  # time in [s] of the program that the other has reached; more than ``at_s``, or the same


@dataclass(frozen=True, slots=True, kw_only=True)
class StopDepth:
    """Greatest depth of the tool of a task in the part while the tool, or what carries the part, has stopped."""

    task: str  # name of the task
    depth: float  # depth in [m]
    worst: StopInstant | None  # when it is reached; None where the tool is never deeper than zero


@dataclass(frozen=True, slots=True, kw_only=True)
class StopDistance:
    """Smallest distance of two robots, and of the part that one of them carries, while one of them has stopped."""

    robots: tuple[str, str]  # names of the two robots
    distance: float  # smallest distance measured in [m], zero where they touch; inf where they are nowhere near
    proved: float  # distance in [m] that is proved to be kept by all that must keep a clearance
    bodies: tuple[str, str] | None  # the nearest pair, or the one that touches; None where none was measured
    worst: StopInstant | None  # when it is reached; None likewise
    is_free: bool  # whether it is proved that nothing touches


@dataclass(frozen=True, slots=True, kw_only=True)
class StopGrip:
    """Largest distance of the tool of a further holder from its grasp on the part while a holder has stopped."""

    robot: str  # name of the further holder
    distance: float  # distance in [m]
    worst: StopInstant | None  # when it is reached; None where it never leaves its grasp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StopReport:
    """What happens at worst when any one robot stops at any instant."""

    # time in [s] of its program that each robot still covers after another one stopped, by robot; robots of controllers
    # that do not state it are left out, as if they stopped at once
    runs_on: Mapping[str, float]
    depths: tuple[StopDepth, ...]  # depth of each task's tool
    distances: tuple[StopDistance, ...]  # distances of each pair of robots
    grips: tuple[StopGrip, ...]  # further holders

    @property
    def deepest(self) -> StopDepth | None:
        """The deepest tool; None in a cell without tasks on the part."""
        return max(self.depths, key=lambda stop: stop.depth, default=None)

    @property
    def nearest(self) -> StopDistance | None:
        """The nearest pair of robots; None in a cell of one robot."""
        return min(self.distances, key=lambda stop: (stop.proved, stop.distance), default=None)


def runs_on(controller: ControllerEntry) -> float | None:
    """Time in [s] of its program that a robot covers after another one stopped; None where it is not stated.

    It goes on for the reaction time and then brakes evenly: in half of the braking time it would cover as much.
    """
    if controller.reaction_ms is None and controller.brake_s is None:
        return None
    return (si_or_none(controller.reaction_ms) or 0.0) + 0.5 * (controller.brake_s or 0.0)


def running_on(cell: Cell) -> dict[str, float]:
    """``runs_on`` of all robots of a cell whose controllers state it, by robot."""
    durations = {}
    for robot in cell.robots:
        duration = None if robot.control is None else runs_on(cell.controllers[robot.control.id])
        if duration is not None and duration > 0.0:
            durations[robot.name] = duration
    return durations
