"""The solver by the conditions of an optimum, and multipliers as derivatives of the least value by the bounds."""

import numpy as np
import pytest

from cellplan.geometry.arrays import Array
from cellplan.search.programs.program import least


@pytest.mark.parametrize("seed", range(4))
def test_answers_meet_the_conditions_of_an_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, rows = 12, 90
    A, top = rng.normal(size=(rows, n)), rng.uniform(0.1, 1.0, rows)
    cost, weights = rng.normal(size=n), np.full(n, 1e-3)
    bounds = -np.full(n, 0.3), np.full(n, 0.3)
    result = least(cost, weights, A, top, bounds)
    assert result is not None
    assert (A @ result.at - top).max() <= 1e-9
    assert np.abs(result.at).max() <= 0.3 + 1e-9
    assert result.multipliers.min() >= -1e-9
    balance = cost + weights * result.at + A.T @ result.multipliers + result.of_bounds
    np.testing.assert_allclose(balance, 0.0, atol=1e-7)
    np.testing.assert_allclose(result.multipliers * (A @ result.at - top), 0.0, atol=1e-8)


@pytest.mark.parametrize("seed", range(3))
def test_multipliers_are_the_derivatives_of_the_least_value_by_the_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, rows, step = 8, 40, 1e-6
    A, top = rng.normal(size=(rows, n)), rng.uniform(0.1, 1.0, rows)
    cost, weights, wide = rng.normal(size=n), rng.uniform(0.5, 2.0, n), np.full(n, 0.15)

    def value(top: Array, lower: Array, upper: Array) -> float:
        result = least(cost, weights, A, top, (lower, upper))
        assert result is not None
        return float(cost @ result.at + 0.5 * weights @ result.at**2)

    result = least(cost, weights, A, top, (-wide, wide))
    assert result is not None
    assert (np.count_nonzero(result.multipliers > 1e-6), np.count_nonzero(np.abs(result.of_bounds) > 1e-6)) > (0, 0)
    for row in np.flatnonzero(result.multipliers > -1e-9):
        up, down = (value(top + sign * step * (np.arange(rows) == row), -wide, wide) for sign in (1.0, -1.0))
        assert (up - down) / (2.0 * step) == pytest.approx(-result.multipliers[row], abs=1e-4)
    for k in range(n):
        moved = step * (np.arange(n) == k)
        up, down = (value(top, -wide + sign * moved, wide + sign * moved) for sign in (1.0, -1.0))
        assert (up - down) / (2.0 * step) == pytest.approx(-result.of_bounds[k], abs=1e-4)


def test_the_units_of_rows_and_variables_change_multipliers_but_not_the_step() -> None:
    rng = np.random.default_rng(7)
    n, rows = 6, 20
    A, top = rng.normal(size=(rows, n)), rng.uniform(0.1, 1.0, rows)
    cost, weights, wide = rng.normal(size=n), rng.uniform(0.5, 2.0, n), np.full(n, 0.3)
    of_rows, of_variables = rng.uniform(0.1, 10.0, rows), rng.uniform(0.1, 10.0, n)

    plain = least(cost, weights, A, top, (-wide, wide))
    scaled = least(
        cost * of_variables,
        weights * of_variables**2,
        of_rows[:, None] * A * of_variables,
        of_rows * top,
        (-wide / of_variables, wide / of_variables),
    )

    assert plain is not None
    assert scaled is not None
    np.testing.assert_allclose(scaled.at * of_variables, plain.at, atol=1e-6)
    np.testing.assert_allclose(scaled.multipliers * of_rows, plain.multipliers, atol=1e-5)
    np.testing.assert_allclose(scaled.of_bounds / of_variables, plain.of_bounds, atol=1e-5)


def test_contradictory_rows_have_no_answer() -> None:
    rows = np.array([[1.0], [-1.0]])
    assert least(np.ones(1), np.ones(1), rows, np.array([-1.0, -1.0]), (-np.ones(1) * 9, np.ones(1) * 9)) is None
