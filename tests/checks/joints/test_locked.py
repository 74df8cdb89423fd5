"""Joints that fail: standing still is checked from the tables, and a task that is lost names the joint."""

from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arm import START, circle_schedule, planar_arm_cell

from cellplan.checks.joints.locked import check_locked, with_locked_joints
from cellplan.checks.tools.tracking import check_accuracy
from cellplan.measures.tool_errors import part_poses, task_accuracy
from cellplan.model.robot.robot import JointKind
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain

TIMES = np.linspace(0.0, 4.0, 4001)


def locked_cell(*locks, **changes):
    cell = planar_arm_cell(method="weighted_pseudo_inverse", limits={"q2": changes})
    locked = tuple(LockedJointEntry(robot="arm", joint=joint, from_s=since) for joint, since in locks)
    return replace(cell, motion=replace(cell.motion, locked=locked))


def moving_until(stop, *, then=0.0):
    """The second joint turns evenly at 0.1 rad/s until ``stop`` and at another speed afterwards."""
    q = np.zeros((len(TIMES), 4))
    q[:, 1] = 0.1 * np.minimum(TIMES, stop) + then * np.maximum(TIMES - stop, 0.0)
    return {"arm": q}


def test_a_joint_that_stands_still_after_its_failure_passes():
    (check,) = check_locked(locked_cell(("q2", 2.0)), TIMES, moving_until(2.0))
    assert check.passed
    assert check.name == "locked_joint"
    assert check.subject == "arm/q2"
    assert check.message == "joint arm/q2 stands still at 11.4592 deg from 2.000 s on"


def test_a_joint_that_moves_on_is_named_with_amount_and_instant():
    (check,) = check_locked(locked_cell(("q2", 2.0)), TIMES, moving_until(2.5))
    assert not check.passed
    assert check.value == pytest.approx(np.degrees(0.05))
    assert check.at_s == pytest.approx(2.5)
    assert check.message == "joint arm/q2 is locked from 2.000 s on but moves by 2.865 deg, worst at 2.500 s"


def test_the_instant_between_two_samples_counts_from_the_next_one():
    cell = locked_cell(("q2", 1.9995))
    (check,) = check_locked(cell, TIMES, moving_until(2.0))
    assert check.passed
    (check,) = check_locked(cell, TIMES, moving_until(2.001))
    assert not check.passed


def test_sliding_joints_speak_millimetres():
    (check,) = check_locked(locked_cell(("q2", 2.0), kind=JointKind.PRISMATIC), TIMES, moving_until(2.5))
    assert check.unit == "mm"
    assert "moves by 50 mm" in check.message


def test_a_failure_after_the_end_of_a_run_is_reported():
    (check,) = check_locked(locked_cell(("q2", 9.0)), TIMES, moving_until(4.0))
    assert check.passed
    assert check.message == "joint arm/q2 is locked from 9.000 s on, after the end at 4.000 s"


def accuracy_checks(*locks, jump_at=None):
    """Checks of the arm on its circle; ``jump_at`` takes the path away, which no joint is to blame for."""
    cell = locked_cell(*locks)
    schedule = circle_schedule(cell)
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    scheduled = schedule.tasks[0]
    if jump_at is not None:
        X = scheduled.X_PT.copy()
        X[schedule.times >= jump_at, 0, 3] += 1.0
        scheduled = replace(scheduled, X_PT=X)
    chains = {"arm": ScrewChain(cell.robots[0])}
    X_WP = part_poses(cell, chains, {"arm": motion.q})
    errors = task_accuracy(scheduled, chains["arm"], q=motion.q, X_WP=X_WP)
    checks = check_accuracy(schedule, errors, scheduled.task)
    tolerance = scheduled.task.tolerance
    reported = with_locked_joints(checks, errors, tolerance, times=schedule.times, locked=cell.motion.locked)
    return list(checks), reported


def test_other_joints_take_over_and_nothing_is_added():
    before, reported = accuracy_checks(("q2", 0.3))
    assert all(check.passed for check in reported)
    assert reported == before


def test_a_lost_task_names_all_joints_that_had_failed():
    before, reported = accuracy_checks(("q2", 0.3), ("q3", 0.4), ("q1", 0.5), ("q4", 0.9))
    assert not reported[0].passed
    assert reported[0].message == (
        f"{before[0].message}, after arm/q2 locked at 0.300 s and arm/q3 locked at 0.400 s and arm/q1 locked at "
        "0.500 s: the other joints cannot compensate"
    )
    assert reported[1] == before[1]


def test_a_task_lost_before_the_failure_does_not_blame_it():
    before, reported = accuracy_checks(("q2", 0.5), jump_at=0.4)
    assert not reported[0].passed
    assert reported == before
