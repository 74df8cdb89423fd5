"""Both filtered inverses against the claims of Vargas 2012 on his three cases, for several steps, and in a cell."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from builders.planar_arms import planar_cell, tip_jacobians, tip_schedule, tips
from builders.random_cells import random_cell
from builders.vargas_cases import TRANSIENT, vargas_run

from cellplan.errors import DivergedError
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.solver import FilteredInverseEntry, SolverEntry
from cellplan.planning.methods import method_named
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem

METHODS = ("damped_least_squares", "filtered_inverse", "filtered_inverse_ii")
STEPS = [pytest.param(1e-3, marks=pytest.mark.slow), pytest.param(5e-3, marks=pytest.mark.slow), 20e-3]


@cache
def runs(name, step):
    """One run per method, of which everything is finite: ``Motion`` refuses anything else."""
    return {method: vargas_run(name, method, step) for method in METHODS}


def settled(run, values):
    return values[run.times >= TRANSIENT]


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_case_one_is_the_same_for_all_methods_and_never_damped(step):
    result = runs("I", step)
    for run in result.values():
        # Euler's error |x''| dt / (2 K) is 1e-5 m at 1 ms; the lag of the filter adds less than 5e-5 m
        assert settled(run, run.error).max() < 5e-5 + 0.01 * step  # so the tips are as near to each other
        assert run.manipulability.min() > 1.0  # w0


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_case_two_lets_the_filtered_inverses_nearer_to_the_singular_point_with_less_error(step):
    result = runs("II", step)
    damped = result["damped_least_squares"]
    for method in METHODS[1:]:
        run = result[method]
        assert settled(run, run.error).max() < 0.6 * settled(damped, damped.error).max()
        assert settled(run, run.manipulability).min() < settled(damped, damped.manipulability).min() < 1.0


@pytest.mark.slow
@pytest.mark.parametrize("step", STEPS)
def test_case_three_avoids_the_singular_point_below_four_radians_per_second_and_comes_back(step):
    for run in runs("III", step).values():
        assert run.manipulability.min() > 0.01
        near = np.abs(run.times - 20.0) < 3.0
        assert 0.05 < run.error[near].max() < 0.3  # the path leads through the point, the arm past it
        assert run.speed < 4.0
        assert run.error[run.times >= 30.0].max() < 2e-4 + 0.01 * step


def test_a_step_of_a_tenth_of_a_second_changes_nothing_in_kind():
    """Euler's steps of the filter would blow up above 0.6 ms."""
    for method in METHODS[1:]:
        run = vargas_run("III", method, 0.1)
        assert run.speed < 4.0
        assert run.error[-1] < 1e-3


LENGTHS = (1.0, 0.8, 0.6)
STEP = 0.01
VELOCITY = np.array([0.2, -0.3])


def arm_problem(q, *, filter_gain, gain=5.0, weights=(1.0, 1.0, 1.0), zero=False, offset=(0.0, 0.0)):
    """An arm whose tip is to leave its place, or one beside it, at a constant velocity."""
    solver = SolverEntry(
        integrator="euler",
        method="filtered_inverse",
        gain_per_s=gain,
        seed=0,
        filtered_inverse=FilteredInverseEntry(gain_per_s=filter_gain, start="zero" if zero else "inverse"),
    )
    cell = planar_cell(LENGTHS, solver, settle=10.0)
    cell = replace(cell, robots=(replace(cell.robots[0], weights=np.array(weights)),))
    begin = tips(LENGTHS, np.array([q]))[0] + offset
    schedule = tip_schedule(
        cell,
        lambda t: begin + t[:, None] * VELOCITY,
        velocity=lambda t: np.tile(VELOCITY, (len(t), 1)),
        duration=20 * STEP,
        step=STEP,
    )
    return TrackingProblem(MotionTask(cell, schedule, ["arm"], np.zeros(cell.joint_count)))


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("zero", [True, False])
def test_endless_filter_gain_gives_the_weighted_pseudo_inverse(method, zero):
    q, weights = np.array([0.2, 0.9, -1.4]), (0.5, 3.0, 1.0)
    advanced = method_named(method)(arm_problem(q, filter_gain=1e8, weights=weights, zero=zero))(0, q)
    expected = method_named("weighted_pseudo_inverse")(arm_problem(q, filter_gain=1.0, weights=weights))(0, q)
    np.testing.assert_allclose(advanced.q, expected.q, atol=1e-14)


@pytest.mark.parametrize("method", METHODS[1:])
def test_filter_that_has_not_begun_moves_nothing(method):
    """With Theta at zero and next to no gain nothing has settled yet."""
    q = np.array([0.2, 0.9, -1.4])
    assert np.abs(method_named(method)(arm_problem(q, filter_gain=1e-9, zero=True))(0, q).q - q).max() < 1e-12


@pytest.mark.parametrize("method", METHODS[1:])
def test_secondary_motion_does_not_show_while_the_filter_lags(method):
    q, drift = np.array([0.2, 0.9, -1.4]), np.array([0.3, -0.2, 0.5])
    speeds = []
    for desired in (None, lambda _k, _q: drift):
        problem = arm_problem(q, filter_gain=3.0, zero=True).with_drift(desired)
        speeds.append((method_named(method)(problem)(0, q).q - q) / STEP)
    change = speeds[1] - speeds[0]
    assert np.linalg.norm(change) > 0.01
    assert np.abs(tip_jacobians(LENGTHS, q[None])[0] @ change).max() < 1e-11


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("filter_gain", [1.0, 1e3, 1e9])
def test_a_far_tip_is_fetched_in_sub_steps(method, filter_gain):
    """0.6 m at 60 /s are 36 m/s: one step of Euler's method would turn a joint by 0.3 rad and more."""
    q = np.array([0.0, 0.4, 0.5])
    problem = arm_problem(q, filter_gain=filter_gain, gain=60.0, offset=(-0.6, -0.2))
    advance = method_named(method)(problem)
    looks = 0
    for k in range(20):
        step = advance(k, q)
        assert np.abs(step.q - q).max() <= 0.05 * step.iterations  # LONGEST_MOVE
        q, looks = step.q, looks + step.iterations
    assert looks > 20
    if filter_gain > 1.0:
        assert np.linalg.norm(tips(LENGTHS, q[None])[0] - problem.desired[19, 0, :2, 3]) < 0.01


@pytest.mark.parametrize("method", METHODS[1:])
def test_speed_that_no_sub_step_follows_is_refused_by_name(method):
    q = np.array([0.2, 0.9, -1.4])
    problem = arm_problem(q, filter_gain=1e3, gain=150.0)
    problem.twists[0] *= 1e6
    with pytest.raises(DivergedError, match=r"asks for a joint speed of \S+ rad/s or m/s: shorten motion\.step_s"):
        method_named(method)(problem)(0, q)


@pytest.mark.parametrize("method", METHODS[1:])
def test_locked_and_idle_joints_stand_exactly_still(method):
    cell = random_cell(41, operators=2, joints=7)
    solver = cell.solver.changed(gain_per_s=50.0, filtered_inverse=FilteredInverseEntry(gain_per_s=100.0))
    locked = LockedJointEntry(robot="op0", joint="j3", from_s=0.095)
    cell = replace(cell, solver=solver, motion=replace(cell.motion, locked=(locked,)))
    q = np.random.default_rng(4).uniform(-1, 1, cell.joint_count)
    problem = TrackingProblem(
        MotionTask(cell, _drifting_schedule(cell, q), ["holder", "op0"], np.zeros(cell.joint_count))
    )
    advance = method_named(method)(problem)
    path = [q]
    for k in range(20):
        path.append(advance(k, path[-1]).q)
    steps, joint = np.diff(path, axis=0), cell.columns("op0").start + 3
    assert np.all(steps[:, cell.columns("op1")] == 0.0)
    assert np.all(steps[10:, joint] == 0.0)
    assert np.abs(steps[:10, joint]).min() > 0.0


def _drifting_schedule(cell, q):
    """Every tool is to leave its place at a constant velocity."""
    model = TrackingProblem(MotionTask(cell, _held(cell, np.tile(np.eye(4), (21, 1, 1))), ["holder"], q)).state(q)
    X_PW = np.linalg.inv(model.X_WP)
    names = [robot.name for robot in cell.robots]
    tasks = []
    for task in cell.tasks:
        X = np.tile(X_PW @ model.X_WT[names.index(task.robot)], (21, 1, 1))
        X[:, :3, 3] += np.outer(np.arange(21) * STEP, [0.02, 0.03, -0.01])
        V = np.tile([0.02, 0.03, -0.01, 0.0, 0.0, 0.0], (21, 1))
        tasks.append(TaskSchedule(task=task, X_PT=X, V_PT_P=V, travelled=np.zeros(21), length=1.0, end=0.2))
    return Schedule(times=np.arange(21) * STEP, tasks=tuple(tasks))


def _held(cell, X):
    still = np.zeros((21, 6))
    tasks = tuple(
        TaskSchedule(task=task, X_PT=X, V_PT_P=still, travelled=np.zeros(21), length=1.0, end=0.2)
        for task in cell.tasks
    )
    return Schedule(times=np.arange(21) * STEP, tasks=tasks)
