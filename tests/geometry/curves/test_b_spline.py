"""Clamped B-splines: what their definition demands, and derivatives against differences."""

import numpy as np
import pytest

from cellplan.geometry.curves.b_spline import UniformBSpline

SHARES = np.linspace(0.0, 1.0, 41)


@pytest.mark.parametrize(("degree", "count"), [(1, 2), (3, 4), (3, 9), (5, 6), (5, 18)])
def test_the_functions_add_up_to_one_and_each_end_belongs_to_one(degree: int, count: int) -> None:
    values = UniformBSpline(degree=degree, count=count).basis(SHARES)

    np.testing.assert_allclose(values.sum(axis=1), 1.0, rtol=0.0, atol=1e-15)
    assert values.min() >= 0.0
    np.testing.assert_array_equal(values[[0, -1]], np.eye(count)[[0, -1]])


@pytest.mark.parametrize("degree", [3, 5])
def test_mean_knots_as_coefficients_give_the_straight_line(degree: int) -> None:
    spline = UniformBSpline(degree=degree, count=degree + 6)
    knots = np.concatenate([np.zeros(degree + 1), spline.inner_knots, np.ones(degree + 1)])
    means = np.array([knots[k + 1 : k + 1 + degree].mean() for k in range(spline.count)])  # Greville's abscissae

    np.testing.assert_allclose(spline.basis(SHARES) @ means, SHARES, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(spline.basis(SHARES, 1) @ means, 1.0, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(spline.basis(SHARES, 2) @ means, 0.0, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize(("degree", "derivative"), [(3, 1), (3, 2), (5, 1), (5, 2), (5, 3)])
def test_derivatives_are_those_of_central_differences(degree: int, derivative: int) -> None:
    spline = UniformBSpline(degree=degree, count=11)
    step, inside = 1e-6, SHARES[1:-1] + 0.003  # off the knots, where third derivatives of cubics jump

    values = spline.basis(inside, derivative)
    ends = [spline.basis(inside + side * step, derivative - 1) for side in (1.0, -1.0)]

    np.testing.assert_allclose(values, (ends[0] - ends[1]) / (2.0 * step), rtol=1e-6, atol=1e-6 * np.abs(values).max())


def test_fewer_functions_than_the_degree_needs_are_refused() -> None:
    with pytest.raises(ValueError, match="B-spline of degree 5: expected more than 5 functions"):
        UniformBSpline(degree=5, count=5)
