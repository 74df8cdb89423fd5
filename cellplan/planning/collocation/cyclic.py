"""Closed path: an accurate motion that brings every joint back at the end of each cycle."""

from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.planning.collocation.joint_polynomials import CollocatedPath, joined
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.euler.cycle_closing import SAME_POSE, closing_drift, not_back
from cellplan.planning.timing.schedule import common_cycles
from cellplan.planning.tracking.problem import TrackingProblem

PERIODIC: Final = 3e-9  # [rad] or [m] by which joints may be off after a cycle that is repeated: they would jump by it


class _NoConvergenceError(NoSolutionError):
    """Collocation does not converge over a cycle."""


def closed_path(run: AccurateRun, problem: TrackingProblem) -> CollocatedPath | None:
    """A path that closes in every cycle; None where collocation does not converge.

    A path that is open, or a cycle that does not close, is refused.

    Each cycle gets a drift of its own, in one direction and at rest at both ends. Where the targets of a cycle are
    those of the one before, it repeats its motion: a drift alone would let rounding grow from cycle to cycle, as the
    map of one cycle onto the next need not be a contraction. Before the first cycle and after the last one there is
    nothing to close, and no drift.
    """
    bounds, start = _bounds(run, problem.motion.schedule), problem.motion.start
    for begin, end in pairwise(bounds):
        _refuse_open(run, problem, begin, end)
    try:
        path = _whole(run, start, begin=0.0, end=bounds[0])
        before: CollocatedPath | None = None
        for begin, end in pairwise(bounds):
            again = None if before is None else run.repeated(before, begin=begin)
            cycle = _closing(run, problem, path.last, begin=begin, end=end) if again is None else again
            path = joined(path, cycle)
            before = cycle if np.max(np.abs(cycle.last - cycle.start)) <= PERIODIC else None
        return joined(path, _whole(run, path.last, begin=bounds[-1], end=run.end))
    except _NoConvergenceError:
        return None


def _bounds(run: AccurateRun, schedule: Schedule) -> list[float]:
    """Times in [s] between which the cycles lie; the whole motion when the tasks keep no common cycles."""
    ends = common_cycles(schedule)
    return [0.0, run.end] if ends is None else np.clip(ends, 0.0, run.end).tolist()


def _refuse_open(run: AccurateRun, problem: TrackingProblem, begin: float, end: float) -> None:
    """Stop where a tool is not back at the end of a cycle; the tasks come first among what asks for tools."""
    gaps = run.gaps(begin, end)
    for task, gap in zip(problem.tasks, gaps.tolist(), strict=True):
        if gap > SAME_POSE:
            raise InputError(not_back(problem.cell, task, end))


def _closing(run: AccurateRun, problem: TrackingProblem, q: Array, *, begin: float, end: float) -> CollocatedPath:
    """Motion of one cycle that brings the joints back."""
    paths: list[CollocatedPath] = []

    def moved(drift: Array) -> Array:
        paths[:] = [_whole(run, q, begin=begin, end=end, drift=drift)]
        return paths[0].last - q

    sample = int(np.argmin(np.abs(problem.times - begin)))
    closing_drift(problem, q, moved, duration=end - begin, sample=sample)
    return paths[0]


def _whole(run: AccurateRun, q: Array, *, begin: float, end: float, drift: Array | None = None) -> CollocatedPath:
    """Motion up to a time, not less far."""
    path = run.path(q, begin=begin, end=end, drift=drift)
    if path.end < end - TIME_TOLERANCE:
        raise _NoConvergenceError("collocation did not converge over the first cycle")
    return path
