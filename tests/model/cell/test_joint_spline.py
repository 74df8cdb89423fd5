"""Joint splines: at rest at both ends, and the nearest one to a motion."""

import numpy as np
import pytest

from cellplan.model.cell.joint_spline import JointSpline, basis

SHARES = np.linspace(0.0, 1.0, 101)


def spline(degree: int, count: int = 9) -> JointSpline:
    return JointSpline(coefficients=np.random.default_rng(5).normal(size=(count, 3)), degree=degree)


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("count", [2, 3, 9])
def test_it_begins_and_ends_at_rest_without_acceleration(degree: int, count: int) -> None:
    path, ends = spline(degree, count), np.array([0.0, 1.0])

    np.testing.assert_allclose(path.at(ends), path.coefficients[[0, -1]], rtol=0.0, atol=1e-15)
    for derivative in (1, 2):
        np.testing.assert_allclose(path.at(ends, derivative), 0.0, rtol=0.0, atol=1e-12)
        assert np.abs(path.at(SHARES, derivative)).max() > 1.0


def test_equal_coefficients_stand_still_to_the_last_bit() -> None:
    still = JointSpline(coefficients=np.tile([0.1, -0.7], (6, 1)), degree=5)

    np.testing.assert_array_equal(still.at(SHARES), np.tile([0.1, -0.7], (len(SHARES), 1)))


@pytest.mark.parametrize("degree", [3, 5])
def test_the_fit_of_its_own_rows_is_the_spline_itself(degree: int) -> None:
    path = spline(degree)

    fit = JointSpline.fitted(SHARES, path.at(SHARES), count=9, degree=degree)

    np.testing.assert_allclose(fit.coefficients, path.coefficients, rtol=0.0, atol=1e-12)


def test_the_basis_is_the_derivative_of_the_path_by_each_coefficient() -> None:
    path, moved = spline(5), spline(5).coefficients.copy()
    moved[4, 1] += 0.25

    change = JointSpline(coefficients=moved, degree=5).at(SHARES, 1) - path.at(SHARES, 1)

    np.testing.assert_allclose(change[:, 1], 0.25 * basis(SHARES, 9, 5, 1)[:, 4], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(change[:, [0, 2]], 0.0, rtol=0.0, atol=1e-15)


def test_one_coefficient_is_no_path() -> None:
    with pytest.raises(ValueError, match="joint spline: expected at least 2 finite configurations"):
        JointSpline(coefficients=np.zeros((1, 6)), degree=3)
