"""Where all tools are wanted, at the instants of windows, in lanes."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Grasp
from cellplan.model.motion import Schedule
from cellplan.planning.collocation.batch_tasks import Wanted
from cellplan.planning.collocation.start_offset import StartOffset
from cellplan.planning.collocation.windows import Window
from cellplan.planning.timing.timed_path import TimedTasks


class LaneTargets:
    """The tools of timed tasks, then those of further holders, whose grasps never change.

    Attributes:
        offset: How far the tools stand beside their paths at the start; None when they stand on them.
    """

    def __init__(self, timed: TimedTasks, grasps: Sequence[Grasp]) -> None:
        """Take what asks for a tool's motion."""
        self._timed, self._grasps = timed, tuple(grasps)
        self.offset: StartOffset | None = None

    def in_windows(self, windows: Sequence[Window]) -> list[Wanted]:
        """Targets at the instants of each window; each sees corners from inside its panels."""
        times = np.concatenate([window.instants for window in windows])
        begins, ends = (np.concatenate(parts) for parts in zip(*(window.stretches for window in windows), strict=True))
        wanted = self.at(times, begins, ends)
        cuts = np.cumsum([0, *(len(window.instants) for window in windows)]).tolist()
        return [wanted.between(low, high) for low, high in pairwise(cuts)]

    def at(self, times: Array, begins: Array, ends: Array) -> Wanted:
        """Targets at instants in [s], each between two breaks, shape (N,) each."""
        return self._from_start(times, self.on_path(times, begins, ends))

    def on_path(self, times: Array, begins: Array, ends: Array) -> Wanted:
        """The same, as if all tools stood on their paths at the start."""
        return _in_lanes([path.at(times, (begins, ends)) for path in self._timed.paths], self._grasps)

    def sampled(self, schedule: Schedule, instants: slice) -> Wanted:
        """Targets at some instants of the clock, from the sampled tasks."""
        return self._from_start(schedule.times[instants], sampled(schedule, instants, self._grasps))

    def _from_start(self, times: Array, wanted: Wanted) -> Wanted:
        """Targets moved so that they begin where the tools are."""
        if self.offset is None:
            return wanted
        return Wanted(*self.offset.applied(times, wanted.R, wanted.p, wanted.twists))


def sampled(schedule: Schedule, instants: slice, grasps: Sequence[Grasp]) -> Wanted:
    """Where tools are wanted at some instants of the clock: those of scheduled tasks, then those of further holders."""
    return _in_lanes([(task.X_PT[instants], task.V_PT_P[instants]) for task in schedule.tasks], grasps)


def _in_lanes(tasks: Sequence[tuple[Array, Array]], grasps: Sequence[Grasp]) -> Wanted:
    """Poses and twists of the tasks, and the grasps beside them, as lanes."""
    X = np.empty((4, 4, len(tasks) + len(grasps), len(tasks[0][0])))
    twists = np.zeros((6, X.shape[2], X.shape[3]))
    for index, (X_PT, V_PT_P) in enumerate(tasks):
        X[:, :, index], twists[:, index] = np.moveaxis(X_PT, 0, -1), V_PT_P.T
    for index, grasp in enumerate(grasps, start=len(tasks)):
        X[:, :, index] = grasp.X_PT[:, :, None]
    return Wanted(X[:3, :3], X[:3, 3], twists)
