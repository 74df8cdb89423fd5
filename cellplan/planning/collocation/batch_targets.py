"""Desired tool poses and twists at the times of windows or samples, as a batch: the tasks, then further holders."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Grasp
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.planning.collocation.batch_tasks import Desired
from cellplan.planning.collocation.start_offset import StartOffset
from cellplan.planning.collocation.windows import Window

DesiredAt = Callable[[Array, Array, Array], Desired]  # times in [s] and the breaks before and after, shape (N,) each


def desired_motion(
    paths: Sequence[ClockedPath], grasps: Sequence[Grasp], offset: StartOffset | None = None
) -> DesiredAt:
    """The desired motion of the tools of the tasks, then of further holders, whose grasps never change.

    Args:
        offset: How far the tools stand beside their paths at the start; None when they stand on them.
    """

    def at(times: Array, begins: Array, ends: Array) -> Desired:
        desired = _in_batches([path.at(times, (begins, ends)) for path in paths], grasps)
        return desired if offset is None else offset.applied(times, *desired)

    return at


def in_windows(desired_at: DesiredAt, windows: Sequence[Window]) -> list[Desired]:
    """The desired motion at the times of each window; each sees corners from inside its panels."""
    times = np.concatenate([window.times for window in windows])
    begins, ends = (np.concatenate(parts) for parts in zip(*(window.stretches for window in windows), strict=True))
    X, V = desired_at(times, begins, ends)
    cuts = np.cumsum([0, *(len(window.times) for window in windows)]).tolist()
    return [(X[..., low:high].copy(), V[..., low:high].copy()) for low, high in pairwise(cuts)]


def sampled(schedule: Schedule, samples: slice, grasps: Sequence[Grasp], offset: StartOffset | None = None) -> Desired:
    """The desired motion at some samples of the clock; the arguments are those of `desired_motion`."""
    desired = _in_batches([(task.X_PT[samples], task.V_PT_P[samples]) for task in schedule.tasks], grasps)
    return desired if offset is None else offset.applied(schedule.times[samples], *desired)


def _in_batches(tasks: Sequence[Desired], grasps: Sequence[Grasp]) -> Desired:
    """Poses and twists of the tasks, samples first, and the grasps beside them, samples last."""
    X = np.empty((4, 4, len(tasks) + len(grasps), len(tasks[0][0])))
    V = np.zeros((6, X.shape[2], X.shape[3]))
    for index, (X_PT, V_PT_P) in enumerate(tasks):
        X[:, :, index], V[:, index] = np.moveaxis(X_PT, 0, -1), V_PT_P.T
    for index, grasp in enumerate(grasps, start=len(tasks)):
        X[:, :, index] = grasp.X_PT[:, :, None]
    return X, V
