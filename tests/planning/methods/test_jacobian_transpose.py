"""Jacobian transpose: steps that cannot overshoot, its lag, and bounded motion near singularities."""

from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arms import planar_cell, tip_schedule, tips
from hypothesis import given
from hypothesis import strategies as st

from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.solver import SolverEntry
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.methods.jacobian_transpose import (
    LEFT_OPEN,
    LONGEST_MOVE,
    MOST_LOOKS,
    MOST_STEPS,
    jacobian_transpose,
    pulled,
)
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem

LENGTHS = (1.0, 0.8, 0.6)
START = np.array([0.3, 0.9, 0.7])
STEP = 0.01


def arm(gain, *, locked=()):
    solver = SolverEntry(integrator="euler", method="jacobian_transpose", gain_per_s=gain)
    cell = planar_cell(LENGTHS, solver, settle=100.0)
    return replace(cell, motion=replace(cell.motion, locked=locked))


def line(cell, velocity, *, offset=(0.0, 0.0), duration=2.0):
    """The tip is to leave its place, or one beside it, on a straight line."""
    begin = tips(LENGTHS, START[None])[0] + offset
    return tip_schedule(
        cell,
        lambda t: begin + t[:, None] * velocity,
        velocity=lambda t: np.tile(velocity, (len(t), 1)),
        duration=duration,
        step=STEP,
    )


def errors(schedule, motion):
    return np.linalg.norm(schedule.tasks[0].X_PT[:, :2, 3] - tips(LENGTHS, motion.q), axis=1)


@given(
    seed=st.integers(0, 2**32 - 1),
    shape=st.tuples(st.integers(1, 8), st.integers(1, 8)),
    exponents=st.lists(st.floats(-12.0, 1.0), min_size=8, max_size=8),
)
def test_motion_never_leaves_more_than_there_was_and_stays_bounded(seed, shape, exponents):
    """A hundred times: ``s |dq_s| <= 2 |x|`` where steps reach far, ``|dq_s| <= 50 |x|`` where s is below 1/50."""
    rng = np.random.default_rng(seed)
    U, s, Vt = np.linalg.svd(rng.normal(size=shape), full_matrices=False)
    J, x = (U * 10.0 ** np.array(exponents[: len(s)])) @ Vt, rng.normal(size=shape[0])
    move, steps = pulled(J, x, np.ones(shape[1]))
    assert np.isfinite(move).all()
    assert np.linalg.norm(x - J @ move) <= np.linalg.norm(x) * (1 + 1e-9)
    assert np.linalg.norm(move) <= 112.0 * np.linalg.norm(x)
    assert steps <= MOST_STEPS


def test_regular_rows_are_given_what_they_want_by_the_smallest_weighted_motion():
    """What begins at zero stays in the range of ``W^-1 J^T``: the weighted pseudo-inverse is the limit."""
    rng = np.random.default_rng(7)
    J, x, weights = rng.normal(size=(6, 12)), rng.normal(size=6), rng.uniform(0.3, 3.0, 12)
    move, _ = pulled(J, x, weights)
    expected = np.linalg.lstsq(J / np.sqrt(weights), x, rcond=None)[0] / np.sqrt(weights)
    assert np.linalg.norm(x - J @ move) <= LEFT_OPEN * np.linalg.norm(x) * 1.0001
    s = np.linalg.svd(J / np.sqrt(weights), compute_uv=False)[-1]
    assert np.linalg.norm(np.sqrt(weights) * (move - expected)) <= LEFT_OPEN * np.linalg.norm(x) / s * 1.0001


def test_one_step_is_the_law_as_printed():
    """Orthonormal rows need one step only: a multiple of ``J^T e``."""
    J = np.linalg.qr(np.random.default_rng(8).normal(size=(7, 3)))[0].T
    e = np.array([0.3, -0.1, 0.2])
    move, steps = pulled(J, e, np.ones(7))
    np.testing.assert_allclose(move, (1 - 0.1**steps) * J.T @ e, atol=1e-15)


@pytest.mark.parametrize("speed", [0.05, 0.1])
def test_the_tool_lags_behind_in_proportion_to_its_speed(speed):
    """``e = (1 / K - dt) v``, as no velocity is fed forward."""
    cell = arm(20.0)
    schedule = line(cell, np.array([-speed, 0.0]))
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    # curvature of the arm and a thousandth left open per step
    assert errors(schedule, motion)[-1] == pytest.approx((1 / 20.0 - STEP) * speed, rel=0.02)


def test_a_gain_of_one_per_step_leaves_no_lag():
    cell = arm(1.0 / STEP)
    schedule = line(cell, np.array([-0.1, 0.05]))
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    assert errors(schedule, motion).max() < 2e-6  # a thousandth of 1.1 mm per step, and the arm's curvature over it


@pytest.mark.parametrize("gain", [1.0, pytest.param(50.0, marks=pytest.mark.slow), 199.0])
@pytest.mark.parametrize("offset", [(-0.8, -0.9), (2.0, 0.0), (-1.0, -1.5)])
def test_far_and_unreachable_points_are_approached_without_leaps(gain, offset):
    cell = arm(gain)
    schedule = line(cell, np.zeros(2), offset=offset, duration=0.4)
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    error = errors(schedule, motion)
    assert np.abs(np.diff(motion.q, axis=0)).max() <= LONGEST_MOVE * MOST_LOOKS + 1e-12  # rounding of the sum
    assert error[-1] < error[0]
    assert error.max() <= error[0] * 1.01


def test_a_joint_that_fails_stands_still_and_the_others_take_over():
    cell = arm(1.0 / STEP, locked=(LockedJointEntry(robot="arm", joint="j1", from_s=0.995),))
    schedule = line(cell, np.array([-0.1, 0.05]))
    motion = integrate_schedule(MotionTask(cell, schedule, ["arm"], START))
    assert np.all(np.diff(motion.q[101:, 1]) == 0.0)
    assert np.abs(np.diff(motion.q[:98, 1])).min() > 0.0
    assert errors(schedule, motion).max() < 1e-4


def test_steps_are_counted():
    cell = arm(50.0)
    step = jacobian_transpose(
        TrackingProblem(MotionTask(cell, line(cell, np.array([0.1, 0.0])), ["arm"], np.zeros(cell.joint_count)))
    )(0, START)
    assert step.iterations > 1
