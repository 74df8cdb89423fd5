"""Closer look: the tool errors of a resolved motion at every instant of the clock, beside those between its nodes."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Schedule
from cellplan.model.name_order import NameOrder
from cellplan.model.progress import Progress, silent
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.plan_motion import resolve
from cellplan.planning.timing.timed_path import TimedTasks, distinct

LOOKS: Final = 4  # at most, each at a motion with more nodes than the one before


def plan_within_accuracy(
    cell: Cell,
    timed: TimedTasks,
    schedule: Schedule,
    *,
    start: Array,
    moving: Sequence[str],
    progress: Progress = silent,
) -> Motion:
    """Resolve a run as `resolve` does, and look at the tool errors at every instant of the clock.

    What `resolve` knows of the error between nodes follows from points between them. Should an instant of the clock
    show more than is allowed, it becomes an end of panels, and the run is resolved again. What the motion says of the
    error between its nodes holds for these instants as well.

    Robots and tasks are resolved in the order of their names, so that the order in which a file lists them changes
    nothing, not even where a search goes from joint to joint.

    The arguments and errors are those of `resolve`.
    """
    order = NameOrder.of(cell)
    cell, start = order.cell, order.sorted(start)
    timed = replace(timed, paths=tuple(sorted(timed.paths, key=lambda path: path.task.name)))
    schedule = replace(schedule, tasks=tuple(sorted(schedule.tasks, key=lambda each: each.task.name)))
    for _ in range(LOOKS):
        motion = resolve(cell, timed, schedule, start=start, moving=moving, progress=progress)
        seen, closer = _looked_at(motion, cell, timed, schedule, moving=moving)
        if not len(closer):
            break
        timed = replace(timed, looked_at=distinct(np.concatenate([timed.looked_at, closer])))
    return replace(seen, q=order.as_listed(seen.q))


def _looked_at(
    motion: Motion, cell: Cell, timed: TimedTasks, schedule: Schedule, *, moving: Sequence[str]
) -> tuple[Motion, Array]:
    """The motion, with the largest error that was seen, and instants in [s] that ask for nodes."""
    made = motion.resolution
    if made is None or made.error_between is None:
        return motion, np.zeros(0)
    last = len(motion.q) if made.euler_from is None else int(np.searchsorted(schedule.times, made.euler_from))
    run = AccurateRun(cell, timed, start=motion.q[0], moving=moving)
    errors = run.errors(schedule, motion.q[:last])
    worst = max(made.error_between, float(errors.max(initial=0.0)))
    seen = replace(motion, resolution=replace(made, error_between=worst))
    return seen, schedule.times[:last][_peaks(errors, cell.solver.accuracy)]


def _peaks(errors: Array, allowed: float) -> NDArray[np.bool_]:
    """Where errors, shape (N,), are above what is allowed and not below their neighbours, shape (N,)."""
    padded = np.concatenate([[-np.inf], errors, [-np.inf]])
    peaks: NDArray[np.bool_] = (errors > allowed) & (errors >= padded[:-2]) & (errors > padded[2:])
    return peaks
