"""Desired tool poses of a phase at other times than those of its rows."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.clock import Clock
from cellplan.model.motion.motion import Schedule


def schedule_at(schedule: Schedule, times: Array) -> Schedule:
    """The same tasks at other times of the same phase, from the paths that are known at any time.

    Times after the end of the phase have the poses of its end.

    Args:
        schedule: The tasks at the rows of a run, on the phase's own time.
        times: Times in [s], increasing from 0, shape (M,), M at least 2.

    Raises:
        ValueError: The poses of a task are known at its rows only.
    """
    if not schedule.is_continuous:
        raise ValueError("schedule: expected paths that are known between the rows of a run too")
    inside = np.minimum(times, schedule.times[-1])
    nominal = inside if schedule.clock is None else schedule.clock.at(inside)
    rate = np.gradient(nominal, times)[:, None]
    clock = None if schedule.clock is None else Clock(times=times, sigma=nominal)
    tasks = []
    for task, path, X_PT in zip(schedule.tasks, schedule.paths, schedule.poses(inside), strict=True):
        _, V_PT_P, travelled = path.targets(nominal)
        tasks.append(replace(task, X_PT=X_PT, V_PT_P=rate * V_PT_P, travelled=travelled))
    return replace(schedule, times=times, tasks=tuple(tasks), clock=clock)
