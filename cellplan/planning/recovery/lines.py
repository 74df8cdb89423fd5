"""Lines: a tool straight in one direction of the world, its orientation kept, from where its robot stands."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.kinematics.pinocchio_model import CombinedModel
from cellplan.model.cell import Cell

STEP: Final = 0.002  # [m] between two configurations of a line
CLOSED: Final = 1e-7  # [m, rad] within which the tool is on the line
ITERATIONS: Final = 12
LONGEST_MOVE: Final = 0.15  # [rad, m] of a joint from one configuration to the next: more is near a singularity
DAMPING: Final = 1e-5  # of the normal equations, in shares of their largest entry
COUNTS: Final = (6, 5, 3)  # components that are kept: all, all but the turn about the tool's axis, the place only
TILT: Final = 0.4  # [-] tangent of the angle between the tool's axis and the directions tried beside it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RetractLine:
    """A straight retract of one robot."""

    robot: str  # its name
    lengths: Array  # how far the tool has come at each configuration in [m], shape (M,), from 0
    q: Array  # the joints of the robot, shape (M, n)
    words: str  # the direction

    def up_to(self, length: float) -> "RetractLine":
        """Its beginning; all of it where it is shorter."""
        count = int(np.searchsorted(self.lengths, length + 0.5 * STEP))
        return RetractLine(robot=self.robot, lengths=self.lengths[:count], q=self.q[:count], words=self.words)


class Lines:
    """Straight lines of the tools of a cell from one stacked configuration."""

    def __init__(self, cell: Cell, q: Array) -> None:
        """Place the cell.

        Args:
            q: Stacked joint positions in [rad] or [m], shape (nq,).
        """
        self._cell, self._q, self._model = cell, q, CombinedModel(cell)
        self._X_WT = self._model.state(q).X_WT

    def directions(self, robot: str, others: Iterator[str] | tuple[str, ...] = ()) -> list[tuple[Array, str]]:
        """Unit directions in the world that the tool of a robot may leave in, the best first, each in words.

        Args:
            others: Robots that work on what this robot holds, and stand still: it may leave along their tools.
        """
        R = self._X_WT[self._cell.index(robot)][:3, :3]
        up = np.array([0.0, 0.0, 1.0])
        x, y, z = R.T
        candidates = [(-z, "along its tool axis")]
        is_holder = robot in self._cell.positioners
        for other in others:
            candidates.insert(0, (self._X_WT[self._cell.index(other)][:3, 2], f"along the tool axis of '{other}'"))
        if is_holder:
            candidates.insert(0, (up, "upwards"))
        for side in (x, -x, y, -y):
            leaning = -z + TILT * side
            candidates.append((leaning / np.linalg.norm(leaning), "beside its tool axis"))
        return candidates if is_holder else [*candidates, (up, "upwards")]

    def line(self, robot: str, direction: Array, words: str, *, longest: float) -> RetractLine | None:
        """The line of a robot as far as it comes within its joint limits; None where it comes nowhere.

        Args:
            direction: Unit vector in the world, shape (3,).
            longest: Length in [m] at which it ends at the latest.
        """
        for count in COUNTS:
            q = self._followed(robot, direction, longest, count)
            if len(q) > 1:
                return RetractLine(robot=robot, lengths=np.arange(len(q), dtype=np.float64) * STEP, q=q, words=words)
        return None

    def _followed(self, robot: str, direction: Array, longest: float, count: int) -> Array:
        """Configurations of a robot along a line, shape (M, n); its own only where the next one is not reached."""
        index, columns = self._cell.index(robot), self._cell.columns(robot)
        model, X = self._cell.robot(robot).model, self._X_WT[index]
        configurations = [self._q[columns]]
        for number in range(1, round(longest / STEP) + 1):
            goal = X[:3, 3] + number * STEP * direction
            guess = configurations[-1] if number == 1 else 2.0 * configurations[-1] - configurations[-2]
            q = self._reached(index, columns, guess, goal, X[:3, :3], count)
            if q is None or np.abs(q - configurations[-1]).max() > LONGEST_MOVE:
                break
            if np.any((q < model.lower) | (q > model.upper)):
                break
            configurations.append(q)
        return np.array(configurations)

    def _reached(self, index: int, columns: slice, guess: Array, goal: Array, R: Array, count: int) -> Array | None:
        """Joints of a robot that put its tool at a point with an orientation; None where Newton's steps do not."""
        q = self._q.copy()
        q[columns] = guess
        weights = 1.0 / self._cell.robots[index].weights
        for _ in range(ITERATIONS):
            state = self._model.state(q)
            X = state.X_WT[index]
            turn = R.T @ X[:3, :3]
            turned = 0.5 * np.array([turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]])
            error = np.concatenate([R.T @ (goal - X[:3, 3]), turned])[:count]
            if np.abs(error).max() < CLOSED:
                return q[columns]
            screws = state.screws_W[:, columns] * self._model.carries_flange[index, columns]
            linear = screws[:3] + np.cross(screws[3:].T, X[:3, 3]).T
            J = np.concatenate([R.T @ linear, R.T @ screws[3:]])[:count]
            normal = (J * weights) @ J.T
            normal += DAMPING * DAMPING * np.trace(normal) * np.eye(count)
            q[columns] += weights * (J.T @ np.linalg.solve(normal, error))
        return None
