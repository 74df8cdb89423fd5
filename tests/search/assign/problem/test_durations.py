"""Least durations beside a closed form: one joint from rest to rest under a limit of its speed."""

from dataclasses import replace

import numpy as np
from builders.assignments import small_instance

from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.search.assign.problem.durations import with_stand_offs
from cellplan.search.assign.problem.table import TaskMode

STEP = 0.01  # [s]


def test_each_joint_takes_at_least_its_time_from_rest_to_rest() -> None:
    """Of 0.6 rad at 1 rad/s and 4 rad/s2: 0.6 s and 0.25 s to get going; rounding takes up to two steps at each end."""
    goal = next(iter(small_instance(0, 2).goals.values()))
    limits = JointLimitsInTime(velocity=np.ones(2), acceleration=np.full(2, 4.0), jerk=np.full(2, np.inf))
    q = np.array([[0.0, 0.0], [0.6, 0.1], [0.7, 0.1], [0.7, 0.7]])
    slow = TaskMode(task=goal.name, robot="a", station=0, spin=0.0, q=q, margin=0.1)
    fast = replace(slow, q=0.5 * q)

    alone = with_stand_offs(goal, {(goal.name, "a", 0): [slow]}, {"a": limits}, STEP)
    both = with_stand_offs(goal, {(goal.name, "a", 0): [slow, fast], ("x", "a", 0): []}, {"a": limits}, STEP)

    assert 0 <= 2 * 85 - (alone.steps - goal.steps) <= 4
    assert 0 <= 2 * 55 - (both.steps - goal.steps) <= 4
    assert with_stand_offs(goal, {}, {"a": limits}, STEP).steps == goal.steps
