"""Least durations of tasks whose program is retimed: what process, feed and rests demand, and the joints beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.straight_time import straight_steps
from cellplan.search.assign.problem.goals import TaskGoal
from cellplan.search.assign.problem.table import Key, TaskMode

ROUNDED = 2  # steps that a straight move has beyond its time at most


def with_stand_offs(
    goal: TaskGoal, modes: Mapping[Key, Sequence[TaskMode]], bounds: Mapping[str, JointLimitsInTime], step: float
) -> TaskGoal:
    """The task with the time that approach and retraction take at least, by the mode that is fastest in them.

    From rest to rest each joint takes at least as long as it would by itself.

    Args:
        modes: Modes of all tasks.
        bounds: Limits of the joints by robot, shape (n,) each.
        step: Time between two rows in [s].
    """
    of_task = (mode for key, choices in modes.items() if key[0] == goal.name for mode in choices)
    least = min((stand_off_steps(mode, bounds[mode.robot], step) for mode in of_task), default=0)
    return replace(goal, steps=goal.steps + least, stand_off_steps=least)


def stand_off_steps(mode: TaskMode, limits: JointLimitsInTime, step: float) -> int:
    """Steps of both ends of a mode, each joint by itself, without those that rounding up and a limit of jerk add."""
    ends: Array = mode.q[[1, -1]] - mode.q[[0, -2]]
    alone = ends[:, :, None] * np.eye(ends.shape[1])
    one_by_one = straight_steps(np.zeros((2, *alone.shape[1:])), alone, limits, step)
    return int(np.maximum(one_by_one.max(axis=1, initial=0) - ROUNDED, 0).sum())
