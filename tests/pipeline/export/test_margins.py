"""How far rounded rows may be off straight motion: against corner paths that are sampled densely."""

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from cellplan.model.exported import Interpolation, RobotRows
from cellplan.pipeline.export.margins import off_chords
from cellplan.pipeline.export.played import Played

SHARE = 0.4


def bound(q: np.ndarray, times: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """What one robot may be off in each step."""
    rows = RobotRows(robot="a", q=q, times=times)
    played = SimpleNamespace(
        run=SimpleNamespace(cell=SimpleNamespace(robots=[SimpleNamespace(name="a")])),
        rows={"a": rows},
        exported=("a",),
        interpolation=Interpolation.LINEAR,
        shares={"a": shares},
    )
    return off_chords(cast("Played", played), times)


def straight(q: np.ndarray, times: np.ndarray, at: float) -> np.ndarray:
    return np.array([np.interp(at, times, column) for column in q.T])


@pytest.mark.parametrize("seed", range(20))
def test_no_parabola_at_a_row_is_farther_off_than_the_bound(seed: int) -> None:
    """Each leaves within its own share on either side; it is compared with straight motion at the same time."""
    rng = np.random.default_rng(seed)
    q, times = rng.normal(size=(3, 4)), np.cumsum(rng.uniform(0.1, 2.0, 3))
    h, v = np.diff(times), np.diff(q, axis=0) / np.diff(times)[:, None]

    allowed = bound(q, times, np.array([0.0, SHARE, 0.0]))

    largest = np.zeros(4)
    for first, last in [(SHARE, SHARE), *rng.uniform(0.0, SHARE, (10, 2))]:
        before, after = first * h[0], last * h[1]
        for s in np.linspace(0.0, 1.0, 200):
            path = q[1] - (1.0 - s) ** 2 * before * v[0] + s**2 * after * v[1]
            time = times[1] - (1.0 - s) ** 2 * before + s**2 * after
            largest = np.maximum(largest, np.abs(path - straight(q, times, time)))
    assert np.all(largest <= allowed[0] + 1e-12)
    np.testing.assert_array_equal(allowed[0], allowed[1])


@pytest.mark.parametrize("seed", range(5))
def test_the_chord_of_a_corner_is_off_by_the_bound_itself(seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, times = rng.normal(size=(3, 4)), np.cumsum(rng.uniform(0.1, 2.0, 3))
    ends = [straight(q, times, times[1] + by) for by in (-SHARE * (times[1] - times[0]), SHARE * (times[2] - times[1]))]
    part = (times[1] - times[0]) / (times[2] - times[0])  # of the chord at the time of the row

    allowed = bound(q, times, np.array([0.0, SHARE, 0.0]))

    np.testing.assert_allclose(np.abs(ends[0] + part * (ends[1] - ends[0]) - q[1]), allowed[0], rtol=1e-9)


def test_even_motion_in_uneven_steps_is_off_by_nothing() -> None:
    times = np.array([0.0, 0.1, 1.0, 1.1, 3.0])

    allowed = bound(times[:, None] * np.array([1.0, -2.0]), times, np.full(5, 0.5))

    np.testing.assert_allclose(allowed, 0.0, atol=1e-12)


def test_only_the_steps_beside_a_rounded_row_are_off() -> None:
    q = np.random.default_rng(1).normal(size=(6, 2))

    allowed = bound(q, np.arange(6.0), np.array([0.0, 0.0, 0.3, 0.0, 0.0, 0.0]))

    assert np.all(allowed[1:3] > 0.0)
    np.testing.assert_array_equal(allowed[[0, 3, 4]], 0.0)
