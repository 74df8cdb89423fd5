"""Damped least squares against the optimum that defines it, the borders of its region, and singular rows."""

from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arms import planar_cell, tip_jacobians, tip_schedule, tips
from hypothesis import given
from hypothesis import strategies as st

from cellplan.errors import NoSolutionError
from cellplan.model.settings.solver import DampedLeastSquaresEntry, SolverEntry
from cellplan.planning.methods.damped_least_squares import (
    LARGEST_DAMPING,
    damped_least_squares,
    gain_share,
    nearness,
    squared_damping,
)
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.weighted_inverse import WeightedInverse

LENGTHS = (2.0, 1.0, 1.0)
GAIN = 5.0
STEP = 0.01
VELOCITY = np.array([0.3, -0.2])
BY_VALUE = DampedLeastSquaresEntry(region=0.5)
BY_MANIPULABILITY = DampedLeastSquaresEntry(measure="manipulability", region=1.0)


def one_step(q, *, settings=BY_VALUE, damping="auto", weights=(1.0, 1.0, 1.0), drift=None):
    """Joint speeds of the first step of an arm whose tip is to leave its place at a constant velocity."""
    solver = SolverEntry(
        integrator="euler",
        method="damped_least_squares",
        gain_per_s=GAIN,
        damping=damping,
        damped_least_squares=settings,
    )
    cell = planar_cell(LENGTHS, solver, settle=1.0)
    cell = replace(cell, robots=(replace(cell.robots[0], weights=np.array(weights)),))
    offset = np.array([0.01, 0.02])
    begin = tips(LENGTHS, np.array([q]))[0] + offset
    schedule = tip_schedule(
        cell,
        lambda t: begin + t[:, None] * VELOCITY,
        velocity=lambda t: np.tile(VELOCITY, (len(t), 1)),
        duration=5 * STEP,
        step=STEP,
    )
    problem = TrackingProblem(MotionTask(cell, schedule, ["arm"], np.zeros(cell.joint_count)))
    if drift is not None:
        problem = problem.with_drift(lambda _k, _q: drift)
    speeds = (damped_least_squares(problem)(0, np.array(q)).q - q) / STEP
    return tip_jacobians(LENGTHS, np.array([q]))[0], VELOCITY + GAIN * offset, speeds


@pytest.mark.parametrize("weights", [(1.0, 1.0, 1.0), (0.3, 2.0, 7.0)])
@pytest.mark.parametrize("bend", [0.0, 0.05, 0.2])
def test_speeds_make_the_damped_sum_of_squares_smallest(bend, weights):
    """Least squares on ``[J; lambda W^1/2]``, by another decomposition."""
    J, xdot, speeds = one_step((0.3, bend, -bend), damping=0.1, weights=weights)
    s = np.linalg.svd(J / np.sqrt(weights), compute_uv=False)[-1]
    factor = 0.1 * np.sqrt(max(0.0, 1 - (s / 0.5) ** 2))
    assert factor > 0.0

    stacked = np.vstack([J, factor * np.diag(np.sqrt(weights))])
    expected = np.linalg.lstsq(stacked, np.concatenate([xdot, np.zeros(3)]), rcond=None)[0]

    np.testing.assert_allclose(speeds, expected, atol=1e-10)  # divided by the step of 0.01 s


def test_away_from_singularities_the_twist_is_met_exactly():
    J, xdot, speeds = one_step((0.3, 1.0, 1.0))
    np.testing.assert_allclose(J @ speeds, xdot, atol=1e-11)


@pytest.mark.parametrize(("settings", "largest"), [(BY_VALUE, 0.09), (BY_MANIPULABILITY, 0.3)])
def test_damping_grows_steadily_from_nothing_at_the_border(settings, largest):
    """Nicolato's factor is squared (Eq. 2.12); Vargas adds his as it stands (Eq. 9)."""
    measures = np.linspace(0.0, 1.5 * settings.region, 3001)
    squares = [squared_damping(m, settings, largest=0.3) for m in measures]
    assert squares[0] == pytest.approx(largest)
    assert np.all(np.diff(squares) <= 0.0)
    assert np.max(np.abs(np.diff(squares))) < 1.5 * largest * 2 / 3000 * 1.01  # slope at most 2 per region: no jump
    assert squared_damping(settings.region, settings, largest=0.3) == 0.0


def test_left_to_the_program_no_direction_is_driven_harder_than_at_the_border():
    """``s / (s^2 + lambda^2) <= 1 / epsilon`` for every s below epsilon."""
    for s in np.linspace(0.0, 0.5, 501):
        assert s / (s**2 + squared_damping(s, BY_VALUE, largest=None) + 1e-300) <= 2.0 + 1e-12
    assert squared_damping(0.0, BY_MANIPULABILITY, largest=None) == LARGEST_DAMPING**2


@pytest.mark.parametrize(("ratio", "share"), [(0.0, 0.0), (1.0, 0.0), (2.5, 0.25), (4.0, 1.0), (9.0, 1.0)])
def test_feedback_fades_between_four_regions_and_one(ratio, share):
    assert gain_share(ratio * 0.02, 0.02) == pytest.approx(share)


@pytest.mark.parametrize("bend", [0.0, 0.05, 0.2])
def test_speeds_are_those_of_the_printed_law(bend):
    """``J^T (J J^T + lambda I)^-1 v`` with ``lambda = lambda_0 (1 - w / w_0)^2`` ([Vargas2012]_ Eqs. 9 and 10)."""
    J, xdot, speeds = one_step((0.3, bend, -bend), settings=BY_MANIPULABILITY, damping=0.3)
    w = np.sqrt(np.linalg.det(J @ J.T))
    assert w < 1.0
    damping = 0.3 * (1.0 - w) ** 2
    np.testing.assert_allclose(speeds, J.T @ np.linalg.solve(J @ J.T + damping * np.eye(2), xdot), atol=1e-10)


def test_shaped_gain_leaves_only_the_desired_twist_in_the_region():
    settings = BY_VALUE.changed(shape_gain=True)
    _, _, shaped = one_step((0.3, 0.02, -0.02), settings=settings, damping=0.1)
    J, _, whole = one_step((0.3, 0.02, -0.02), damping=0.1)
    s = np.linalg.svd(J, compute_uv=False)[-1]
    M = J @ J.T + (1 - (s / 0.5) ** 2) * 0.01 * np.eye(2)
    np.testing.assert_allclose(shaped, J.T @ np.linalg.solve(M, VELOCITY), atol=1e-10)
    assert not np.allclose(shaped, whole)


def test_manipulability_is_the_root_of_the_determinant():
    J = np.random.default_rng(3).normal(size=(6, 9))
    measure = nearness(WeightedInverse(J, np.full(9, 4.0)), BY_MANIPULABILITY)
    assert measure == pytest.approx(np.sqrt(np.linalg.det(J @ J.T / 4.0)), rel=1e-10)


@given(
    q=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    near=st.floats(0.0, 1e-3),
    measure=st.sampled_from(["singular_value", "manipulability"]),
)
def test_speeds_are_bounded_by_the_damping_wherever_the_arm_stands(q, near, measure):
    """``|qdot| <= |v| max(1 / (2 lambda), 1 / s)``: with damping 0.1 the gain at a stretched arm is at most 5."""
    _, xdot, speeds = one_step(
        (q[0], near, 0.0), settings=DampedLeastSquaresEntry(measure=measure, region=1.0), damping=0.1
    )
    assert np.isfinite(speeds).all()
    assert np.linalg.norm(speeds) <= 1.01 * np.linalg.norm(xdot) * 5.0  # 1.01: lambda is a little below its largest


def test_secondary_motion_does_not_show_in_a_damped_configuration():
    drift = np.array([0.4, -0.7, 0.9])
    J, _, with_drift = one_step((0.3, 0.05, 0.1), damping=0.1, drift=drift)
    _, _, without = one_step((0.3, 0.05, 0.1), damping=0.1)
    assert np.linalg.norm(with_drift - without) > 0.1
    assert np.abs(J @ (with_drift - without)).max() < 1e-10


@pytest.mark.parametrize("damping", [0.0, 1e-12])
def test_singular_rows_without_damping_are_refused_by_name(damping):
    with pytest.raises(NoSolutionError, match=r"singular and not damped: raise solver\.damping"):
        one_step((0.0, 0.0, 0.0), damping=damping)
