"""Common cycles: the times at which the cycles of all tasks begin and end together."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import Schedule

SAME_PERIOD: Final = 1e-9  # [s] difference of cycles that take equally long: rounding


def common_cycles(schedule: Schedule) -> Array | None:
    """Times in [s] between which the cycles of all tasks lie, shape (cycles + 1,); None when they differ."""
    every = [np.array([task.begin, *task.cycle_ends]) for task in schedule.tasks]
    same = all(len(times) == len(every[0]) and np.max(np.abs(times - every[0])) <= SAME_PERIOD for times in every)
    return every[0] if same and len(every[0]) > 1 else None
