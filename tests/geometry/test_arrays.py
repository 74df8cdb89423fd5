"""Where a peak is, on every processor."""

import numpy as np
import pytest

from cellplan.geometry.arrays import first_peak


@pytest.mark.parametrize("seed", range(5))
def test_rounding_does_not_move_a_peak_that_lasts(seed: int) -> None:
    lasting = np.concatenate([np.linspace(0.0, 1.0, 11), np.ones(20), np.linspace(1.0, 0.0, 11)])

    assert first_peak(lasting + np.random.default_rng(seed).uniform(-1e-7, 1e-7, len(lasting))) == 10


def test_a_peak_of_one_row_is_where_it_is_and_nothing_has_one_at_the_start() -> None:
    assert first_peak(np.array([1.0, 3.0, 2.99, 2.0])) == 1
    assert first_peak(np.zeros(3)) == 0
