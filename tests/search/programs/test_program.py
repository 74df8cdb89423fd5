"""The solver by the conditions of an optimum."""

import numpy as np
import pytest

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


def test_contradictory_rows_have_no_answer() -> None:
    rows = np.array([[1.0], [-1.0]])
    assert least(np.ones(1), np.ones(1), rows, np.array([-1.0, -1.0]), (-np.ones(1) * 9, np.ones(1) * 9)) is None
