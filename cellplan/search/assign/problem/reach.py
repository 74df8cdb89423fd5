"""Common reach: places to which a robot brings the part so that the others can do many tasks there.

An operator reaches what is neither nearer to the centre of its reach nor farther from it than its tool tip mostly is.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import random_configurations
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.assign.problem.goals import Stations, TaskGoal

AROUND: Final = np.linspace(-0.6, 0.6, 7)  # [m] from the middle of the operators' reach, along each axis
SAMPLES: Final = 2000  # configurations that tell the reach of an operator
MOSTLY: Final = (0.1, 0.9)  # [-] quantiles of the distances of its tool tip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reach:
    """Where the tool tip of a robot mostly is."""

    centre: Array  # in the world in [m], shape (3,)
    nearest: float  # [m] from it
    farthest: float  # likewise

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """The reach of a robot, by configurations drawn within its joint limits."""
        configurations = random_configurations(robot.model, SAMPLES, generator(f"reach of {robot.name}"))
        tips = ScrewChain(robot).tool_poses(configurations)[:, :3, 3]
        centre = tips.mean(axis=0)
        nearest, farthest = np.quantile(np.linalg.norm(tips - centre, axis=1), MOSTLY).tolist()
        return cls(centre=centre, nearest=nearest, farthest=farthest)

    def holds(self, p_W: Array) -> Flags:
        """Whether all of some points are within it, shape (K,).

        Args:
            p_W: Points in the world in [m], shape (K, S, 3).
        """
        distances = np.linalg.norm(p_W - self.centre, axis=2)
        return np.all((distances >= self.nearest) & (distances <= self.farthest), axis=1)


def places_in_reach(cell: Cell, goals: Sequence[TaskGoal], X_WP: Array, *, most: int) -> Array:
    """Places of the part in the world in [m], those with most tasks of robots within reach first, shape (K, most, 3).

    Compared are a grid round the middle of the operators' reach, and the place of the first pose.

    Args:
        goals: The tasks, with the robots that may do them.
        X_WP: Poses of the part whose orientations count, shape (K, 4, 4).
        most: Number of places for each of them.
    """
    reach = {robot.name: Reach.of(robot) for robot in cell.robots if robot.name not in cell.positioners}
    middle = np.mean([it.centre for it in reach.values()], axis=0)
    grid = np.stack(np.meshgrid(AROUND, AROUND, AROUND, indexing="ij"), axis=-1).reshape(-1, 3)
    compared = np.concatenate([X_WP[:1, :3, 3], middle + grid])
    places = []
    for X in X_WP:
        station, count = Stations(holder=None, q=np.zeros((1, 0)), X_WP=X[None]), np.zeros(len(compared))
        for goal in goals:
            if any(flags.any() for flags in station.allowed(goal).values()):
                tips = compared[:, None] + goal.X_PT[:, :3, 3] @ X[:3, :3].T
                count += sum(reach[name].holds(tips) for name in goal.robots if name in reach)
        places.append(compared[np.argsort(-count, kind="stable")[:most]])
    return np.array(places)
