"""The interpolant: against cubics, against differences, against its bounds, and within the limits of joints."""

import numpy as np

from cellplan.programs.rows.interpolant import HermiteRows, resting, row_velocities

UNEVEN = np.array([0.0, 0.3, 0.35, 0.9, 1.0, 1.7])
UNLIMITED = {"lower": np.array([-np.inf]), "upper": np.array([np.inf])}


def test_a_cubic_with_its_own_speeds_is_given_back() -> None:
    cubic = np.polynomial.Polynomial([0.3, -1.0, 2.0, -0.7])
    curve = HermiteRows(times=UNEVEN, q=cubic(UNEVEN)[:, None], qd=cubic.deriv()(UNEVEN)[:, None])
    t = np.linspace(0.0, 1.7, 401)

    np.testing.assert_allclose(curve.at(t)[:, 0], cubic(t), atol=1e-14)


def test_the_curve_holds_outside_of_its_rows() -> None:
    curve = HermiteRows(times=UNEVEN, q=UNEVEN[:, None], qd=np.ones((6, 1)))

    np.testing.assert_array_equal(curve.at(np.array([-1.0, 2.0]))[:, 0], [0.0, 1.7])


def test_extremes_and_accelerations_are_those_of_a_dense_curve() -> None:
    rng = np.random.default_rng(6)
    times = np.cumsum(rng.uniform(0.1, 1.0, 60))
    curve = HermiteRows(times=times, q=rng.normal(size=(60, 2)), qd=3.0 * rng.normal(size=(60, 2)))
    share = np.linspace(0.0, 1.0, 2001)
    t = times[:-1, None] + np.diff(times)[:, None] * share
    dense = curve.at(t.ravel()).reshape(59, -1, 2)
    bends = np.diff(dense, n=2, axis=1) / (np.diff(times)[:, None, None] / 2000) ** 2

    low, high = curve.extremes()

    np.testing.assert_allclose(low, dense.min(axis=1), atol=1e-5)
    np.testing.assert_allclose(high, dense.max(axis=1), atol=1e-5)
    np.testing.assert_allclose(curve.largest_accelerations(), np.abs(bends).max(axis=1), rtol=5e-3)


def test_speeds_of_uneven_rows_are_those_of_the_parabola_through_them() -> None:
    q = (1.0 + 2.0 * UNEVEN - 3.0 * UNEVEN**2)[:, None]

    qd = row_velocities(UNEVEN, q, rests=np.zeros(6, dtype=bool), **UNLIMITED)

    np.testing.assert_allclose(qd[1:-1, 0], 2.0 - 6.0 * UNEVEN[1:-1], atol=1e-13)


def test_a_robot_rests_at_the_ends_and_where_none_of_its_joints_moves() -> None:
    q = np.array([[0, 0], [1, 0], [1, 1], [1, 1], [1, 1], [2, 1], [3, 1.0]])

    assert resting(q).tolist() == [True, False, True, True, True, False, True]


def test_no_curve_through_rows_at_a_limit_passes_it() -> None:
    """A joint runs up to its limit, turns there between two rows, and comes back."""
    times = 0.01 * np.arange(40)
    q = np.minimum(np.sin(times / 0.39 * np.pi) * 1.01, 1.0)[:, None]
    limits = {"lower": np.array([0.0]), "upper": np.array([1.0])}
    rests = np.zeros(40, dtype=bool)  # other joints of the robot move on
    free = row_velocities(times, q, rests=rests, **UNLIMITED)
    limited = row_velocities(times, q, rests=rests, **limits)

    low, high = HermiteRows(times=times, q=q, qd=limited).extremes()

    assert HermiteRows(times=times, q=q, qd=free).extremes()[1].max() > 1.0 + 1e-6
    assert high.max() <= 1.0
    assert low.min() >= 0.0
    assert np.count_nonzero(np.any(limited != free, axis=1)) < 6
