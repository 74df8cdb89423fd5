"""Peaks between nodes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan.errors import NotFiniteError
from cellplan.search.kernel.figures import MotionFigures, Peaks, PeakValues
from cellplan.search.kernel.run import run

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
    slopes = peaks.derivatives(0, rates)[:, 0]
    np.testing.assert_allclose(slopes, (sides[0] - sides[1]) / (2 * step), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_corner_at_a_double_node_is_no_parabola(turn: float) -> None:
    peaks = Peaks.of(T, (1.0 - turn * np.abs(T - 1.0))[None, :, None])
    assert peaks.value[0, 0] == pytest.approx(1.0 if turn > 0.0 else 3.0, abs=1e-12)


def test_margins_of_joints_without_limits_are_infinite_and_the_others_stay_as_they_are() -> None:
    values = np.stack([2.0 - (T - 1.234) ** 2, np.full_like(T, -np.inf)], axis=1)

    peaks, crests = Peaks.of(T, values[None]), PeakValues.of(T, values)

    np.testing.assert_array_equal(peaks.value[0, 1], -np.inf)
    np.testing.assert_array_equal(crests.value[:, 1], -np.inf)
    np.testing.assert_array_equal(peaks.value[:, :1], Peaks.of(T, values[None, :, :1]).value)
    np.testing.assert_array_equal(crests.value[:, :1], PeakValues.of(T, values[:, :1]).value)


@pytest.mark.parametrize(("what", "value"), [("q", np.nan), ("q", np.inf), ("qd", np.nan)])
def test_a_figure_that_is_no_number_names_its_joint(reference: SimpleNamespace, what: str, value: float) -> None:
    motions = run(reference.job, reference.layouts)
    broken = getattr(motions, what).copy()
    followed = int(np.flatnonzero(motions.is_followed)[0])
    broken[followed, 5, 7] = value  # the second joint of the second robot
    name = f"{reference.cell.robots[1].name}/{reference.cell.robots[1].model.joint_names[1]}"

    with pytest.raises(NotFiniteError, match=rf"^{name}: expected a finite .* in the search, got (nan|inf)$"):
        MotionFigures.of(reference.job, replace(motions, **{what: broken}))


def test_what_is_no_number_in_a_motion_that_lost_its_path_does_not_count(reference: SimpleNamespace) -> None:
    motions = run(reference.job, reference.layouts)
    q, lost_at = motions.q.copy(), motions.lost_at.copy()
    q[0], lost_at[0] = np.nan, 0.5

    figures = MotionFigures.of(reference.job, replace(motions, q=q, lost_at=lost_at))

    np.testing.assert_array_equal(figures.margins[1:], MotionFigures.of(reference.job, motions).margins[1:])
