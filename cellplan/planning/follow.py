"""Follow the schedule: integrate joint speeds so that every tool stays on its path on the moving part."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import DivergedError, NoSolutionError
from cellplan.geometry.transforms import Array, inverse
from cellplan.kinematics.combined import CellState, CombinedModel
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.planning.cooperation import column_signs, constraint_rows, cooperation_jacobian, pose_errors
from cellplan.planning.methods import METHODS

LOST_DISTANCE: Final = 0.5  # [m] a tool this far from its path has left it for good: the posture means nothing any more
TOLD_EVERY: Final = 200  # [samples] between two words on progress


def follow(
    cell: Cell, schedule: Schedule, *, start: Array, moving: Sequence[str], progress: Progress = silent
) -> Motion:
    r"""Integrate the cooperative motion by Euler's method with pose-error feedback ([Ribeiro2010]_ Fig. 23, Eq. D.1).

    .. math:: \dot q = J^\# (\dot x_d + K e), \qquad q(t + dt) = q(t) + \dot q \, dt

    so that the error obeys ``e_dot + K e = 0`` (Eq. D.7).

    Args:
        cell: The cell.
        schedule: Wanted tool poses and twists on the common clock.
        start: Stacked start posture, shape (nq,), in [rad] or [m].
        moving: Names of the robots that may move.
        progress: Who wants to know how far it is.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no joint speeds.
    """
    model = CombinedModel(cell)
    follower = _Follower(cell, schedule, model, moving)
    q = np.empty((len(schedule.times), cell.joint_count))
    q[0] = start
    steps = np.diff(schedule.times)
    for k, step in enumerate(steps):
        try:
            q[k + 1] = q[k] + follower.joint_speeds(k, model.state(q[k])) * step
        except NoSolutionError as error:
            raise type(error)(f"{cell.origin.at('motion')}: at {schedule.times[k]:.3f} s {error}") from None
        if k % TOLD_EVERY == 0:
            progress("planning", k / len(steps))
    return Motion(times=schedule.times, q=q)


class _Follower:
    """What stays the same from step to step."""

    def __init__(self, cell: Cell, schedule: Schedule, model: CombinedModel, moving: Sequence[str]) -> None:
        tasks = [scheduled.task for scheduled in schedule.tasks]
        names = [robot.name for robot in cell.robots]
        self._tasks = tasks
        self._operators = [names.index(task.robot) for task in tasks]
        self._signs = column_signs(cell, model, tasks, moving)
        self._wanted = np.stack([scheduled.X_PT for scheduled in schedule.tasks], axis=1)
        self._twists = np.stack([scheduled.V_PT_P for scheduled in schedule.tasks], axis=1)
        self._rows = [constraint_rows(scheduled.task, scheduled.X_PT) for scheduled in schedule.tasks]
        self._is_whole = all(len(task.axes) == 6 and not task.is_spin_free for task in tasks)
        self._is_linear = np.array([[float(axis in task.axes) for axis in range(3)] for task in tasks])
        self._is_spin_free = [task.is_spin_free for task in tasks]
        self._weights = np.concatenate([robot.weights for robot in cell.robots])
        self._method = METHODS[cell.solver.method]
        self._gain, self._damping = cell.solver.gain, cell.solver.damping

    def joint_speeds(self, k: int, state: CellState) -> Array:
        """Joint speeds at instant k, shape (nq,)."""
        X_WT = state.X_WT[self._operators]
        J = cooperation_jacobian(state, X_WT[:, :3, 3], self._signs)
        error = pose_errors(self._wanted[k], inverse(state.X_WP) @ X_WT, self._is_spin_free)
        self._refuse_lost_path(error)
        twist = self._twists[k] + self._gain * error
        if self._is_whole:
            rows, wanted = J.reshape(-1, J.shape[2]), twist.reshape(-1)
        else:
            picks = [rows[k] for rows in self._rows]
            rows = np.concatenate([pick @ block for pick, block in zip(picks, J, strict=True)])
            wanted = np.concatenate([pick @ part for pick, part in zip(picks, twist, strict=True)])
        return self._method(rows, wanted, self._weights, self._damping)

    def _refuse_lost_path(self, error: Array) -> None:
        """Stop where going on would be meaningless; not a number counts as lost."""
        distances = np.linalg.norm(error[:, :3] * self._is_linear, axis=1)
        if distances.max() < LOST_DISTANCE and np.isfinite(error.sum()):
            return
        worst = int(np.argmax(distances))
        task = self._tasks[worst]
        raise DivergedError(
            f"the tool of '{task.robot}' is {1e3 * distances[worst]:.0f} mm from task '{task.name}': "
            "the path cannot be followed from this start posture"
        )
