"""What happens when one robot of a cell stops and the others go on for a while and then brake on their path."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellplan.model.cell.cell import Cell
from cellplan.model.settings.controllers import ControllerEntry
from cellplan.model.settings.units import si_or_none


@dataclass(frozen=True, slots=True, kw_only=True)
class StopInstant:
    """When a figure of a stop is reached.

    Attributes:
        stopped: Name of the robot that stops.
        going: Name of the robot that goes on.
        at_s: Instant in [s] at which the one stops.
        path_s: Time in [s] of the program that the other has reached; more than ``at_s``, or the same.
    """

    stopped: str
    going: str
    at_s: float
    path_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StopDepth:
    """Greatest depth of the tool of a task in the part while the tool, or what carries the part, has stopped.

    Attributes:
        task: Name of the task.
        depth: Depth in [m].
        worst: When it is reached; None where the tool is never deeper than zero.
    """

    task: str
    depth: float
    worst: StopInstant | None


@dataclass(frozen=True, slots=True, kw_only=True)
class StopDistance:
    """Smallest distance of two robots, and of the part that one of them carries, while one of them has stopped.

    Attributes:
        robots: Names of the two robots.
        distance: Smallest distance measured in [m], zero where they touch; inf where they are nowhere near.
        proved: Distance in [m] that is proved to be kept by all that must keep a clearance.
        bodies: The nearest pair, or the one that touches; None where none was measured.
        worst: When it is reached; None likewise.
        is_free: Whether it is proved that nothing touches.
    """

    robots: tuple[str, str]
    distance: float
    proved: float
    bodies: tuple[str, str] | None
    worst: StopInstant | None
    is_free: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class StopGrip:
    """Largest distance of the tool of a further holder from its grasp on the part while a holder has stopped.

    Attributes:
        robot: Name of the further holder.
        distance: Distance in [m].
        worst: When it is reached; None where it never leaves its grasp.
    """

    robot: str
    distance: float
    worst: StopInstant | None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StopReport:
    """What happens at worst when any one robot stops at any instant.

    Attributes:
        runs_on: Time in [s] of its program that each robot still covers after another one stopped, by robot; robots
            of controllers that do not state it are left out, as if they stopped at once.
        depths: Depth of each task's tool.
        distances: Distances of each pair of robots.
        grips: Further holders.
    """

    runs_on: Mapping[str, float]
    depths: tuple[StopDepth, ...]
    distances: tuple[StopDistance, ...]
    grips: tuple[StopGrip, ...]

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
