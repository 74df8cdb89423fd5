"""The weighted, damped pseudo-inverse against the optimality conditions that define it."""

import numpy as np
import pytest

from cellplan.errors import NoSolutionError
from cellplan.planning.methods.weighted_pseudo_inverse import LARGEST_DAMPING, SINGULAR_REGION, damped_velocities
from cellplan.planning.tracking.weighted_inverse import WeightedInverse

RNG = np.random.default_rng(11)


def weighted_speeds(J, xdot, weights, damping):
    return damped_velocities(WeightedInverse(J, weights), xdot, damping)


def test_speeds_solve_the_optimality_conditions():
    """Smallest ``1/2 qd^T W qd`` with ``J qd = xd``: its Karush-Kuhn-Tucker system solved directly."""
    J, xdot, weights = RNG.normal(size=(18, 24)), RNG.normal(size=18), RNG.uniform(0.2, 5.0, 24)
    kkt = np.block([[np.diag(weights), J.T], [J, np.zeros((18, 18))]])
    expected = np.linalg.solve(kkt, np.concatenate([np.zeros(24), xdot]))[:24]

    speeds = weighted_speeds(J, xdot, weights, None)

    np.testing.assert_allclose(speeds, expected, atol=1e-11)  # condition number below 1e3, squared


def test_unit_weights_give_the_moore_penrose_inverse():
    J, xdot = RNG.normal(size=(6, 9)), RNG.normal(size=6)
    np.testing.assert_allclose(weighted_speeds(J, xdot, np.ones(9), None), np.linalg.pinv(J) @ xdot, atol=1e-12)


def test_heavier_joint_moves_less():
    J, xdot = RNG.normal(size=(3, 6)), RNG.normal(size=3)
    light = weighted_speeds(J, xdot, np.ones(6), None)
    heavy = weighted_speeds(J, xdot, np.array([1, 1, 100.0, 1, 1, 1]), None)
    assert abs(heavy[2]) < 0.1 * abs(light[2])
    np.testing.assert_allclose(J @ heavy, xdot, atol=1e-12)


def test_joint_with_a_zero_column_stands_still():
    J = RNG.normal(size=(3, 6))
    J[:, 4] = 0.0
    assert weighted_speeds(J, RNG.normal(size=3), np.ones(6), None)[4] == 0.0


def test_no_damping_away_from_singularities():
    J = np.diag([1.0, 0.5, SINGULAR_REGION * 1.001])
    xdot = np.ones(3)
    np.testing.assert_allclose(J @ weighted_speeds(J, xdot, np.ones(3), None), xdot, rtol=1e-12)


@pytest.mark.parametrize("s", [0.0, 1e-9, 1e-4, 0.3 * SINGULAR_REGION, 0.99 * SINGULAR_REGION])
def test_speeds_stay_bounded_through_a_singularity(s):
    """With damping the gain is ``s / (s^2 + lambda^2)``, at most about ``1 / lambda_max``."""
    J = np.diag([1.0, 1.0, s])
    speeds = weighted_speeds(J, np.array([0.0, 0.0, 1.0]), np.ones(3), None)
    lambda_squared = (1 - (s / SINGULAR_REGION) ** 2) * LARGEST_DAMPING**2
    assert speeds[2] == pytest.approx(s / (s**2 + lambda_squared))
    assert abs(speeds[2]) <= 1.0 / SINGULAR_REGION * 1.01


def test_singular_without_damping_is_refused_by_name():
    J = np.diag([1.0, 1.0, 0.0])
    with pytest.raises(NoSolutionError, match=r"singular and solver\.damping is 0"):
        weighted_speeds(J, np.ones(3), np.ones(3), 0.0)
