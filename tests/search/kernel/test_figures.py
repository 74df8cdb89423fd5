"""Peaks between nodes."""

import numpy as np
import pytest

from cellplan.search.kernel.figures import Peaks

T = np.sort(np.concatenate([np.linspace(0.0, 3.0, 40), [1.0]]))


def test_the_peak_of_a_parabola_is_found_between_nodes() -> None:
    values = np.stack([2.0 - (T - 1.234) ** 2, T, -3.0 + (T - 2.02) ** 2], axis=1)[None]
    peaks = Peaks.of(T, values, in_magnitude=True)
    np.testing.assert_allclose(peaks.value[0], [2.0, 3.0, 3.0], atol=1e-12)


def test_its_derivative_is_that_of_the_difference() -> None:
    def values(x: float) -> np.ndarray:
        return np.stack([np.sin(x * T), -np.exp(x * np.cos(T))], axis=1)[None]

    step = 1e-5
    peaks = Peaks.of(T, values(1.7), in_magnitude=True)
    rates = (values(1.7 + step) - values(1.7 - step))[0, :, :, None] / (2 * step)
    sides = [Peaks.of(T, values(1.7 + s * step), in_magnitude=True).value[0] for s in (1.0, -1.0)]
    found = peaks.derivatives(0, rates)[:, 0]
    np.testing.assert_allclose(found, (sides[0] - sides[1]) / (2 * step), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_corner_at_a_double_node_is_no_parabola(turn: float) -> None:
    peaks = Peaks.of(T, (1.0 - turn * np.abs(T - 1.0))[None, :, None])
    assert peaks.value[0, 0] == pytest.approx(1.0 if turn > 0.0 else 3.0, abs=1e-12)
