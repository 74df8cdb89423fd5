"""References of all tools at the times of windows, as a batch."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Grasp
from cellplan.model.motion import Schedule
from cellplan.planning.collocation.batch_tasks import Reference
from cellplan.planning.collocation.start_offset import StartOffset
from cellplan.planning.collocation.windows import Window
from cellplan.planning.timing.timed_path import TimedTasks


class BatchTargets:
    """The tools of timed tasks, then those of further holders, whose grasps never change."""

    def __init__(self, timed: TimedTasks, grasps: Sequence[Grasp], offset: StartOffset | None = None) -> None:
        """Take the desired motions of all tools.

        Args:
            timed: The tasks on the common clock.
            grasps: Grasps of the further holders that move.
            offset: How far the tools stand beside their paths at the start; None when they stand on them.
        """
        self._timed, self._grasps, self._offset = timed, tuple(grasps), offset

    def in_windows(self, windows: Sequence[Window]) -> list[Reference]:
        """Targets at the times of each window; each sees corners from inside its panels."""
        times = np.concatenate([window.sample_times for window in windows])
        begins, ends = (np.concatenate(parts) for parts in zip(*(window.stretches for window in windows), strict=True))
        desired = self.at(times, begins, ends)
        cuts = np.cumsum([0, *(len(window.sample_times) for window in windows)]).tolist()
        return [desired.between(low, high) for low, high in pairwise(cuts)]

    def at(self, times: Array, begins: Array, ends: Array) -> Reference:
        """Targets at times in [s], each between two breaks, shape (N,) each."""
        return self._from_start(times, self.on_path(times, begins, ends))

    def on_path(self, times: Array, begins: Array, ends: Array) -> Reference:
        """The same, as if all tools stood on their paths at the start."""
        return _in_batches([path.at(times, (begins, ends)) for path in self._timed.paths], self._grasps)

    def sampled(self, schedule: Schedule, samples: slice) -> Reference:
        """Targets at some samples of the clock, from the sampled tasks."""
        return self._from_start(schedule.times[samples], sampled(schedule, samples, self._grasps))

    def _from_start(self, times: Array, desired: Reference) -> Reference:
        """Targets moved so that they begin where the tools are."""
        if self._offset is None:
            return desired
        return Reference(*self._offset.applied(times, desired.R, desired.p, desired.twists))


def sampled(schedule: Schedule, samples: slice, grasps: Sequence[Grasp]) -> Reference:
    """Desired tool poses at some samples of the clock: scheduled tasks, then further holders."""
    return _in_batches([(task.X_PT[samples], task.V_PT_P[samples]) for task in schedule.tasks], grasps)


def _in_batches(tasks: Sequence[tuple[Array, Array]], grasps: Sequence[Grasp]) -> Reference:
    """Poses and twists of the tasks, and the grasps beside them, as a batch."""
    X = np.empty((4, 4, len(tasks) + len(grasps), len(tasks[0][0])))
    twists = np.zeros((6, X.shape[2], X.shape[3]))
    for index, (X_PT, V_PT_P) in enumerate(tasks):
        X[:, :, index], twists[:, index] = np.moveaxis(X_PT, 0, -1), V_PT_P.T
    for index, grasp in enumerate(grasps, start=len(tasks)):
        X[:, :, index] = grasp.X_PT[:, :, None]
    return Reference(X[:3, :3], X[:3, 3], twists)
