"""Law II of the filtered inverse: its feedback never drives the error up, however bad the filter is."""

import numpy as np
from builders.planar_arms import planar_cell, tip_jacobians, tip_schedule, tips
from hypothesis import given
from hypothesis import strategies as st

from cellplan.model.settings.solver import FilteredInverseEntry, SolverEntry
from cellplan.planning.methods.filtered_inverse_ii import filtered_inverse_ii
from cellplan.planning.methods.support.filtered_jacobian import FilteredMotion
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem

LENGTHS = (2.0, 1.0, 1.0)
ANGLE = st.floats(-3.0, 3.0)


def resting_problem(q):
    """The tip is to go to a place nearby and rest there; the filter hardly moves."""
    solver = SolverEntry(
        integrator="euler",
        method="filtered_inverse_ii",
        gain_per_s=1.0,
        seed=0,
        filtered_inverse=FilteredInverseEntry(gain_per_s=1e-12),
    )
    cell = planar_cell(LENGTHS, solver, settle=1.0)
    point = tips(LENGTHS, q[None])[0] + [0.01, -0.02]
    schedule = tip_schedule(
        cell,
        lambda t: np.tile(point, (len(t), 1)),
        velocity=lambda t: np.zeros((len(t), 2)),
        duration=1e-3,
        step=1e-4,
    )
    return TrackingProblem(MotionTask(cell, schedule, ["arm"], np.zeros(cell.joint_count)))


@given(q=st.tuples(ANGLE, ANGLE, ANGLE), seed=st.integers(0, 2**32 - 1))
def test_the_error_falls_even_with_a_random_filter(q, seed):
    """``e . e_dot = -K |P^T e|^2`` (Eq. 37 for a tool at rest)."""
    q = np.array(q)
    motion = FilteredMotion(resting_problem(q), lambda theta, J: theta @ theta.T @ J.T)
    motion.theta = np.random.default_rng(seed).normal(size=(3, 2))
    P = tip_jacobians(LENGTHS, q[None])[0] @ motion.theta
    e = np.array([0.01, -0.02])

    moved = motion.advance(0, q).q

    change = tips(LENGTHS, moved[None])[0] - tips(LENGTHS, q[None])[0]
    expected = 1e-4 * np.sum((P.T @ e) ** 2)
    assert abs(e @ change - expected) < 1e-3 * expected + 1e-9  # second order in the move


def test_law_two_is_the_filter_times_its_square():
    q = np.array([0.3, 0.8, -0.4])
    J = tip_jacobians(LENGTHS, q[None])[0]
    pinv = np.linalg.pinv(J)
    moved = filtered_inverse_ii(resting_problem(q))(0, q).q
    np.testing.assert_allclose((moved - q) / 1e-4, pinv @ pinv.T @ J.T @ [0.01, -0.02], atol=1e-10)
