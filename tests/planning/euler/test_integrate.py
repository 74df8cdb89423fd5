"""Integration of the cooperative motion: order of the error, who moves, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import random_cell

from cellplan.errors import DivergedError, NoSolutionError
from cellplan.geometry.transforms import inverse, pose_from, rotation_exp
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.kinematics.screw_chain import ScrewChain

DURATION = 0.5  # [s]


def relative_pose(cell, task, q):
    X_WP = ScrewChain(cell.robot("holder")).tool_poses(q[:, cell.columns("holder")]) @ inverse(
        cell.part.held_by[0].X_PT
    )
    return inverse(X_WP) @ ScrewChain(cell.robot(task.robot)).tool_poses(q[:, cell.columns(task.robot)])


def lissajous_schedule(cell, start, step):
    """Smooth relative motion from the start posture: a small loop and a small turn, with exact twists."""
    times = np.arange(round(DURATION / step) + 1) * step
    phase = 2 * np.pi * times / DURATION
    scheduled = []
    for task in cell.tasks:
        X0 = relative_pose(cell, task, start[None])[0]
        offset = 0.02 * np.stack([np.cos(phase) - 1, np.sin(phase), 0 * phase], axis=1)
        velocity = 0.02 * 2 * np.pi / DURATION * np.stack([-np.sin(phase), np.cos(phase), 0 * phase], axis=1)
        turn = np.zeros((len(times), 3))
        turn[:, 2] = 0.1 * np.sin(phase)
        omega = np.zeros((len(times), 3))
        omega[:, 2] = 0.1 * 2 * np.pi / DURATION * np.cos(phase)
        scheduled.append(
            TaskSchedule(
                task=task,
                X_PT=pose_from(rotation_exp(turn) @ X0[:3, :3], X0[:3, 3] + offset),
                V_PT_P=np.concatenate([velocity, omega], axis=1),
                travelled=times,
                length=1.0,
                end=DURATION,
            )
        )
    return Schedule(times=times, tasks=tuple(scheduled))


def largest_error(cell, schedule, motion):
    return max(
        np.linalg.norm(s.X_PT[:, :3, 3] - relative_pose(cell, s.task, motion.q)[:, :3, 3], axis=1).max()
        for s in schedule.tasks
    )


def solved(step, *, gain_times_step=0.5, moving=None, cell=None):
    cell = cell or random_cell(31, operators=2, joints=7)
    cell = replace(cell, solver=cell.solver.changed(gain_per_s=gain_times_step / step))
    start = np.random.default_rng(0).uniform(-1, 1, cell.joint_count)
    schedule = lissajous_schedule(cell, start, step)
    everyone = [robot.name for robot in cell.robots]
    return cell, schedule, integrate_schedule(MotionTask(cell, schedule, moving or everyone, start))


def test_error_is_of_second_order_when_gain_times_step_is_kept():
    """Euler's error is |J q''| dt / (2 K), so with K dt fixed halving the step quarters it."""
    coarse, fine = (largest_error(*solved(step)) for step in (2e-3, 1e-3))
    assert coarse / fine == pytest.approx(4.0, rel=0.1)  # what is left is the next order in the step


def test_only_the_named_robots_move():
    cell, schedule, motion = solved(2e-3, moving=["op0", "op1"])
    assert np.ptp(motion.q[:, cell.columns("holder")], axis=0).max() == 0.0
    assert np.ptp(motion.q[:, cell.columns("op0")], axis=0).max() > 1e-3
    assert largest_error(cell, schedule, motion) < 1e-3


def test_feedback_removes_a_start_error_at_the_rate_of_the_gain():
    """``e(t + dt) = (1 - K dt) e(t)`` for a tool that is to stand still (Eq. D.7)."""
    cell = random_cell(33, operators=1)
    step, share = 1e-3, 0.2
    cell = replace(cell, solver=cell.solver.changed(gain_per_s=share / step))
    start = np.random.default_rng(1).uniform(-1, 1, cell.joint_count)
    task = cell.tasks[0]
    X = np.tile(relative_pose(cell, task, start[None])[0], (41, 1, 1))
    X[:, :3, 3] += [1e-4, -2e-4, 1e-4]
    still = TaskSchedule(task=task, X_PT=X, V_PT_P=np.zeros((41, 6)), travelled=np.zeros(41), length=1.0, end=0.0)
    schedule = Schedule(times=np.arange(41) * step, tasks=(still,))

    motion = integrate_schedule(MotionTask(cell, schedule, ["holder", "op0"], start))

    error = np.linalg.norm(X[:, :3, 3] - relative_pose(cell, task, motion.q)[:, :3, 3], axis=1)
    np.testing.assert_allclose(error[1:] / error[:-1], 1 - share, rtol=5e-3)  # curvature of the arms over 0.2 mm


def test_equal_motion_of_positioner_and_operators_is_never_needed():
    """Without a desired twist nothing moves at all."""
    cell = random_cell(34, operators=2, joints=7)
    cell = replace(cell, solver=cell.solver.changed(gain_per_s=100.0))
    start = np.random.default_rng(2).uniform(-1, 1, cell.joint_count)
    schedule = lissajous_schedule(cell, start, 5e-3)
    still = tuple(
        replace(s, X_PT=np.broadcast_to(s.X_PT[0], s.X_PT.shape), V_PT_P=np.zeros_like(s.V_PT_P))
        for s in schedule.tasks
    )
    motion = integrate_schedule(MotionTask(cell, replace(schedule, tasks=still), [r.name for r in cell.robots], start))
    assert np.abs(motion.q - start).max() < 1e-12


def test_lost_path_is_named_with_its_instant():
    cell = random_cell(31, operators=2, joints=7)
    start = np.random.default_rng(0).uniform(-1, 1, cell.joint_count)
    schedule = lissajous_schedule(cell, start, 2e-3)
    X = schedule.tasks[1].X_PT.copy()
    X[100:, 0, 3] += 5.0
    broken = replace(schedule, tasks=(schedule.tasks[0], replace(schedule.tasks[1], X_PT=X)))
    with pytest.raises(DivergedError, match=r"at 0\.200 s the tool of 'op1' is \d+ mm from task 'task_op1'"):
        integrate_schedule(MotionTask(cell, broken, [r.name for r in cell.robots], start))


def test_task_without_free_joints_is_refused_without_damping():
    cell = random_cell(31, operators=1)
    cell = replace(cell, solver=cell.solver.changed(damping=0.0))
    start = np.random.default_rng(0).uniform(-1, 1, cell.joint_count)
    schedule = lissajous_schedule(cell, start, 2e-3)
    with pytest.raises(NoSolutionError, match="singular"):
        integrate_schedule(MotionTask(cell, schedule, [], start))
