"""Tracking problem: what a resolution method is asked at every instant, and what it may ask back."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import DivergedError
from cellplan.geometry.transforms import Array, inverse
from cellplan.kinematics.combined import CellState, CombinedModel
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.planning.cooperation import column_signs, constraint_rows, cooperation_jacobian, pose_errors

LOST_DISTANCE: Final = 0.5  # [m] a tool this far from its path has left it for good: the posture means nothing any more


@dataclass(frozen=True, slots=True, eq=False)
class FirstOrder:
    """All tasks at one instant and posture, to first order; only the components that they constrain.

    Attributes:
        J: Rows of the cooperation Jacobian, shape (m, nq).
        twist: Wanted tool twists relative to the part, shape (m,).
        error: Pose errors, wanted minus actual, shape (m,).
    """

    J: Array
    twist: Array
    error: Array


class TrackingProblem:
    """All tasks of one run on the common clock, and the joints that may move for them.

    Attributes:
        times: Instants in [s], shape (N,).
        tasks: The tasks, one block row each.
        wanted: Wanted tool poses X_PT, shape (N, tasks, 4, 4).
        twists: Wanted tool twists in P, linear first, shape (N, tasks, 6).
        signs: +1 where a joint moves a task's tool, -1 where it moves the part, 0 elsewhere, shape (tasks, nq).
        weights: Joint weights, shape (nq,).
        gain: Error feedback gain in [1/s].
        damping: Largest damping factor; None leaves it to the method.
    """

    def __init__(self, cell: Cell, schedule: Schedule, moving: Sequence[str]) -> None:
        """Gather what stays the same from step to step."""
        tasks = tuple(scheduled.task for scheduled in schedule.tasks)
        names = [robot.name for robot in cell.robots]
        self._model = CombinedModel(cell)
        self._operators = [names.index(task.robot) for task in tasks]
        self._rows = [constraint_rows(scheduled.task, scheduled.X_PT) for scheduled in schedule.tasks]
        self._is_whole = all(len(task.axes) == 6 and not task.is_spin_free for task in tasks)
        self._is_spin_free = [task.is_spin_free for task in tasks]
        self._is_linear = np.array([[float(axis in task.axes) for axis in range(3)] for task in tasks])
        self.times, self.tasks = schedule.times, tasks
        self.wanted = np.stack([scheduled.X_PT for scheduled in schedule.tasks], axis=1)
        self.twists = np.stack([scheduled.V_PT_P for scheduled in schedule.tasks], axis=1)
        self.signs = column_signs(cell, self._model, tasks, moving)
        self.weights = np.concatenate([robot.weights for robot in cell.robots])
        self.gain, self.damping = cell.solver.gain, cell.solver.damping

    def step(self, k: int) -> float:
        """Time from instant k to the next in [s]."""
        return float(self.times[k + 1] - self.times[k])

    def state(self, q: Array) -> CellState:
        """Kinematics of the whole cell at a stacked joint vector, shape (nq,)."""
        return self._model.state(q)

    def first_order(self, k: int, q: Array) -> FirstOrder:
        """The tasks at instant k and posture q, to first order.

        Raises:
            DivergedError: A tool lost its path.
        """
        state = self.state(q)
        X_WT = state.X_WT[self._operators]
        J = cooperation_jacobian(state, X_WT[:, :3, 3], self.signs)
        error = pose_errors(self.wanted[k], inverse(state.X_WP) @ X_WT, self._is_spin_free)
        self._refuse_lost_path(error)
        if self._is_whole:
            return FirstOrder(J.reshape(-1, J.shape[2]), self.twists[k].reshape(-1), error.reshape(-1))
        picks = [rows[k] for rows in self._rows]
        return FirstOrder(
            np.concatenate([pick @ block for pick, block in zip(picks, J, strict=True)]),
            np.concatenate([pick @ twist for pick, twist in zip(picks, self.twists[k], strict=True)]),
            np.concatenate([pick @ part for pick, part in zip(picks, error, strict=True)]),
        )

    def _refuse_lost_path(self, error: Array) -> None:
        """Stop where going on would be meaningless; not a number counts as lost."""
        distances = np.linalg.norm(error[:, :3] * self._is_linear, axis=1)
        if distances.max() < LOST_DISTANCE and np.isfinite(error.sum()):
            return
        worst = int(np.argmax(distances))
        task = self.tasks[worst]
        raise DivergedError(
            f"the tool of '{task.robot}' is {1e3 * distances[worst]:.0f} mm from task '{task.name}': "
            "the path cannot be followed from this start posture"
        )
