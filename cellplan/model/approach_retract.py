"""Stand-off: the tool comes to its path and leaves it along its own axis, so that a program starts and ends clear."""

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.task import Task, TimeLaw, TimeLawKind
from cellplan.model.time_law import advance

REST_TO_REST = TimeLaw(kind=TimeLawKind.QUINTIC)


def stand_off(times: Array, task: Task, X_PT: Array, *, V_PT_P: Array, end: float) -> None:
    """Shift the poses before the start and after the end of a task, in place, where it asks for it.

    An approach goes straight along the tool's axis, from rest to rest, and is over when the path starts; leaving begins
    when the path ends. Before and after that the tool rests off the part.

    Args:
        times: Times in [s], shape (N,).
        X_PT: Reference poses, held still before the start and after the end of the path, shape (N, 4, 4).
        V_PT_P: Reference twists, zero there, shape (N, 6).
        end: Time in [s] at which the tool leaves the end of its path.
    """
    if task.approach is not None:
        _back_off(X_PT, V_PT_P, task.start - times, distance=task.approach.distance, duration=task.approach.duration)
    if task.retract is not None:
        _back_off(X_PT, V_PT_P, times - end, distance=task.retract.distance, duration=-task.retract.duration)


def _back_off(X_PT: Array, V_PT_P: Array, away: Array, *, distance: float, duration: float) -> None:
    """Shift poses that are ``away`` in [s] from an end of the path; a negative duration is that of leaving."""
    off = away > 0.0
    law = advance(REST_TO_REST, np.clip(away[off] / abs(duration), 0.0, 1.0))
    z = X_PT[off, :3, 2]
    X_PT[off, :3, 3] -= (distance * law.share)[:, None] * z
    V_PT_P[off, :3] += (distance / duration * law.rate)[:, None] * z
