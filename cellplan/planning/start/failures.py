"""Start failures: what a search for a start has seen, kept so that it can say what stands in the way of one."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Relation

MOST_CANDIDATES: Final = 24  # configurations of a robot, or of the cell, that are considered again
MOST_GOALS: Final = 6  # goals of a robot that are considered again


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MissedGoal:
    """Where a tool was desired: a task or grasp, the desired tip, and the frame that it is given in, in the world."""

    relation: Relation
    X_PT: Array
    X_WP: Array


@dataclass(slots=True, kw_only=True)
class Failures:
    """What the search has seen of each robot, by name."""

    # configurations within the limits that reach a goal, each with that of the positioner
    arrived: dict[str, list[tuple[Array, Array | None]]] = field(default_factory=dict)
    missed: dict[str, list[MissedGoal]] = field(default_factory=dict)  # goals that no configuration reaches
    misses: dict[str, int] = field(default_factory=dict)  # how many such goals there were
    beyond: dict[str, list[Array]] = field(default_factory=dict)  # reaching a goal with a joint out of its limits
    # smallest distance in [m] and [rad] of a given start from its task or grasp, as the part was held
    off: dict[str, tuple[float, float]] = field(default_factory=dict)
    touching: list[Array] = field(default_factory=list)  # configurations of the whole cell in which something touches

    def reached(self, robot: str, q: Array, holder_configuration: Array | None) -> None:
        """Keep configurations of a robot, shape (K, n), that reach its goal with the positioner at one of its own."""
        arrived = self.arrived.setdefault(robot, [])
        arrived += [(configuration, holder_configuration) for configuration in q[: MOST_CANDIDATES - len(arrived)]]

    def unreached(self, robot: str, goal: MissedGoal, *, beyond: Array) -> None:
        """Keep a goal that a robot does not reach, and configurations that do outside its limits, shape (K, n)."""
        self.misses[robot] = self.misses.get(robot, 0) + 1
        goals = self.missed.setdefault(robot, [])
        if len(goals) < MOST_GOALS:
            goals.append(goal)
        outside = self.beyond.setdefault(robot, [])
        outside += list(beyond[: MOST_CANDIDATES - len(outside)])

    def off_path(self, robot: str, distance: tuple[float, float]) -> None:
        """Keep the distance of a given start from its task if it is the smallest so far."""
        self.misses[robot] = self.misses.get(robot, 0) + 1
        self.off[robot] = min(distance, self.off.get(robot, (np.inf, np.inf)))

    def touched(self, q: Array) -> None:
        """Keep a configuration of the whole cell, shape (nq,), in which something touches."""
        if len(self.touching) < MOST_CANDIDATES:
            self.touching.append(q)
