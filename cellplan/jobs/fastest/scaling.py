"""Scaling of a program in time: every duration, feed and start of a cell by one factor."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.model.cell.cell import Cell
from cellplan.model.task.task import Task, TimedPath
from cellplan.model.units import MM

NEAR: Final = 1e-9  # [-] of a number of steps: rounding


def scaled_values(cell: Cell, factor: float) -> dict[str, object]:
    """Values of the cell file with which everything takes longer by a factor, by address; see ``Cell.with_values``.

    Args:
        factor: More than 1 for slower.
    """
    motion = cell.motion
    values: dict[str, object] = {}
    if motion.duration is not None:
        values["motion.duration_s"] = motion.duration * factor
    for index, lock in enumerate(motion.locked):
        if lock.since > 0.0:
            values[f"motion.locked_joints[{index}].from_s"] = lock.since * factor
    for task in cell.tasks:
        values |= {f"tasks.{task.name}.{key}": value for key, value in _scaled_task(task, factor).items()}
    return values


def refuse_fixed_times(cell: Cell) -> None:
    """Refuse trajectories and times to settle, which have times of their own.

    Raises:
        InputError: There is one.
    """
    for task in cell.tasks:
        if isinstance(task.path, TimedPath):
            raise InputError(
                f"{task.where('path')}: expected a path without times, got a trajectory with its own clock"
            )
        if task.settle > 0.0:
            where = task.where("settle_s")
            raise InputError(f"{where}: expected 0 where the shortest cycle is sought, got {task.settle:g}")


def whole_steps(cell: Cell, factor: float, *, longer_than: float = 0.0) -> float:
    """A factor with which the clock takes whole steps, not below a given one and more than another."""
    duration, step = cell.motion.duration, cell.motion.step
    if duration is None:
        return factor
    steps = int(np.ceil(factor * duration / step * (1.0 - NEAR)))
    return max(steps, round(longer_than * duration / step) + 1 if longer_than else 1) * step / duration


def steps_within(seconds: float, step: float) -> int:
    """Number of whole steps that a time holds."""
    return int(np.floor(seconds / step * (1.0 + NEAR)))


def _scaled_task(task: Task, factor: float) -> dict[str, object]:
    """Values of one task, by its keys."""
    values: dict[str, object] = {}
    if task.start > 0.0:
        values["start_s"] = task.start * factor
    if task.duration is not None:
        values["duration_s"] = task.duration * factor
    if task.feed is not None and task.process is None:
        values["feed_mm_s"] = MM * task.feed / factor
    for key, move in (("approach_s", task.approach), ("retract_s", task.retract)):
        if move is not None:
            values[key] = move.duration * factor
    return values
