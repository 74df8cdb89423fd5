"""The filter of Vargas 2012 against its differential equation, its equilibrium, and Jacobians without rank."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.planning.methods.support.filtered_jacobian import LEAST_AT_START, Relaxation


def derivative(J, theta):
    """Eq. 34 as printed, with Gamma = 1."""
    S_l, S_r = theta @ J - np.eye(J.shape[1]), J @ theta - np.eye(J.shape[0])
    return -(S_l @ J.T + J.T @ S_r)


def integrated(J, theta, *, until, steps):
    h = until / steps
    for _ in range(steps):
        a = derivative(J, theta)
        b = derivative(J, theta + h / 2 * a)
        c = derivative(J, theta + h / 2 * b)
        theta = theta + h / 6 * (a + 2 * b + 2 * c + derivative(J, theta + h * c))
    return theta


def random_jacobian(seed, shape, *, lost=0):
    """A Jacobian with some singular values exactly zero, and a filter that has nothing to do with it."""
    rng = np.random.default_rng(seed)
    U, s, Vt = np.linalg.svd(rng.normal(size=shape), full_matrices=False)
    s[len(s) - lost :] = 0.0
    return (U * s) @ Vt, rng.normal(size=shape[::-1])


@pytest.mark.parametrize(
    "shape", [(2, 3), (6, 6), *(pytest.param(shape, marks=pytest.mark.slow) for shape in ((6, 9), (5, 3), (1, 4)))]
)
@pytest.mark.parametrize("lost", [0, 1])
def test_the_exact_step_is_what_fine_integration_gives(shape, lost):
    J, theta = random_jacobian(1, shape, lost=lost)
    expected = integrated(J, theta, until=0.3, steps=3000)  # error of order 4: (50 * 1e-4)^4 at most
    np.testing.assert_allclose(Relaxation(J).after(0.3, theta), expected, atol=1e-9)


@given(seed=st.integers(0, 2**32 - 1), lost=st.integers(0, 2), time=st.floats(0.0, 10.0), share=st.floats(0.0, 1.0))
def test_two_steps_are_one(seed, lost, time, share):
    J, theta = random_jacobian(seed, (3, 5), lost=lost)
    relaxation = Relaxation(J)
    twice = relaxation.after((1 - share) * time, relaxation.after(share * time, theta))
    np.testing.assert_allclose(twice, relaxation.after(time, theta), atol=1e-11 * (1 + 1 / _smallest(J)))


def _smallest(J):
    s = np.linalg.svd(J, compute_uv=False)
    return s[s > 1e-12].min()


@pytest.mark.parametrize("shape", [(2, 3), (6, 6), (18, 24)])
def test_it_settles_at_the_moore_penrose_inverse(shape):
    J, theta = random_jacobian(2, shape)
    np.testing.assert_allclose(Relaxation(J).after(1e9, theta), np.linalg.pinv(J), rtol=1e-9, atol=1e-9)


def test_with_fewer_joints_than_rows_it_settles_at_the_inverse_too():
    J, theta = random_jacobian(3, (6, 4))
    np.testing.assert_allclose(Relaxation(J).after(1e9, theta), np.linalg.pinv(J), atol=1e-10)


def test_a_lost_direction_stands_still():
    """Property P1 of the paper: with k = 0 the filter keeps its value."""
    theta = np.random.default_rng(5).normal(size=(4, 3))
    np.testing.assert_allclose(Relaxation(np.zeros((3, 4))).after(1e9, theta), theta, atol=1e-14)


@pytest.mark.parametrize("s", [0.0, 1e-300, 1e-160, 1e-9, 1e-3, 1.0, 1e6])
@pytest.mark.parametrize("gain_time", [0.0, 1e-12, 1.0, 1e12])
def test_one_number_follows_the_closed_form_and_grows_with_the_root_of_time_at_most(s, gain_time):
    value = Relaxation(np.array([[s]])).after(gain_time, np.zeros((1, 1)))[0, 0]
    assert np.isfinite(value)
    assert 0.0 <= value <= np.sqrt(gain_time) * 1.0001  # max over s of (1 - exp(-2 g s^2)) / s is 0.903 sqrt(g)
    assert value * s == pytest.approx(-np.expm1(-2 * gain_time * s * s), rel=1e-13, abs=0.0)  # rounding only


def test_it_begins_at_the_pseudo_inverse_which_is_bounded_in_a_singularity():
    J, _ = random_jacobian(6, (3, 5))
    np.testing.assert_allclose(Relaxation(J).inverse(), np.linalg.pinv(J), atol=1e-12)
    for s in (0.0, 1e-9, 0.5 * LEAST_AT_START):
        start = Relaxation(np.diag([1.0, 1.0, s])).inverse()
        np.testing.assert_allclose(start, np.diag([1.0, 1.0, s / LEAST_AT_START**2]), atol=1e-12)
