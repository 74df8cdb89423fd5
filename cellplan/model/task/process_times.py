"""When a tool rests at the ends of its path, has a process on, and has its demanded feed."""

from itertools import pairwise

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.task.task import TIME_TOLERANCE, Task

Spans = tuple[tuple[float, float], ...]


def leaves_at(task: Task, corners: Array) -> float:
    """Time in [s] at which a tool leaves the end of its path: after the delay of its process, and a dwell.

    Args:
        corners: Times in [s] at which the stretches of its path begin, and the one at which the last ends; so below.
    """
    return float(corners[-1]) + task.off_delay + task.dwell


def process_span(task: Task, corners: Array) -> tuple[float, float]:
    """Times in [s] between which a process is on; without one, those at which the path starts and ends."""
    return task.start, float(corners[-1]) + task.off_delay


def fixed_rests(task: Task, corners: Array) -> Spans:
    """Stretches of time in [s] that a retimed program keeps: the delays of a process, and a dwell."""
    on, off = process_span(task, corners)
    ends = (on, float(corners[0])), (float(corners[-1]), off), (off, leaves_at(task, corners))
    return tuple((begin, end) for begin, end in ends if end - begin > TIME_TOLERANCE)


def demanded_spans(task: Task, corners: Array) -> Spans:
    """Stretches of time in [s] in which the feed of a process is demanded: between its ramps."""
    if task.process is None:
        return ()
    ramp = task.process.ramp_s
    spans = ((begin + ramp, end - ramp) for begin, end in pairwise(corners.tolist()))
    return tuple((begin, end) for begin, end in spans if end - begin > TIME_TOLERANCE)


def ramp_shares(task: Task, corners: Array) -> Array:
    """Share of the time of each stretch that a ramp of its time law takes, shape (corners - 1,)."""
    duration = np.diff(corners)
    return np.full(len(duration), task.time_law.ramp) if task.process is None else task.process.ramp_s / duration
