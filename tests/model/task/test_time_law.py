"""Time laws go from nothing to all, and their rates are their derivatives."""

import numpy as np
import pytest

from cellplan.model.task.task import TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance, peak_rate, reached_at

LAWS = [
    TimeLaw(kind=TimeLawKind.CONSTANT),
    TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.25),
    TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.5),
    TimeLaw(kind=TimeLawKind.TRAPEZOID, ramp=0.01),
    TimeLaw(kind=TimeLawKind.QUINTIC),
]


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_law_goes_from_nothing_to_all_and_never_back(law: TimeLaw) -> None:
    tau = np.linspace(0.0, 1.0, 1001)

    share = advance(law, tau)

    assert share.share[0] == 0.0
    assert share.share[-1] == 1.0
    assert np.all(np.diff(share.share) > 0.0)
    assert np.allclose(share.share + share.share[::-1], 1.0, atol=1e-15)  # speeding up mirrors slowing down


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_rates_are_derivatives(law: TimeLaw) -> None:
    tau, h = np.linspace(0.013, 0.987, 200), 1e-6
    kinks = np.array([law.ramp, 1.0 - law.ramp])
    tau = tau[np.abs(tau[:, None] - kinks).min(axis=1) > 2.0 * h]

    above, here, below = advance(law, tau + h), advance(law, tau), advance(law, tau - h)

    assert np.allclose((above.share - below.share) / (2.0 * h), here.rate, atol=1e-9)
    assert np.allclose((above.rate - below.rate) / (2.0 * h), here.acceleration, atol=1e-8)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_peak_rate_is_the_largest_rate(law: TimeLaw) -> None:
    assert advance(law, np.linspace(0.0, 1.0, 2001)).rate.max() == pytest.approx(peak_rate(law), rel=1e-12)


@pytest.mark.parametrize("law", LAWS[1:], ids=str)
def test_trapezoid_and_quintic_rest_at_both_ends(law: TimeLaw) -> None:
    assert advance(law, np.array([0.0, 1.0])).rate.tolist() == [0.0, 0.0]


def test_quintic_starts_and_ends_without_acceleration() -> None:
    assert advance(LAWS[-1], np.array([0.0, 1.0])).acceleration.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("drops", [(1.0, 1.0), (1.0, 0.25), (0.0, 1.0), (0.5, 0.0), (0.0, 0.0), (0.3, 0.8)])
def test_a_steady_law_between_speeds_is_its_own_integral_and_begins_and_ends_at_them(drops: tuple) -> None:
    law, tau, ramp = TimeLaw(kind=TimeLawKind.STEADY), np.linspace(0.0, 1.0, 10_001), 0.2
    every = np.tile(drops, (len(tau), 1))
    now = advance(law, tau, ramp, every)

    h = tau[1]
    assert np.abs((now.share[2:] - now.share[:-2]) / (2.0 * h) - now.rate[1:-1]).max() < 1e-5
    slope = np.abs((now.rate[2:] - now.rate[:-2]) / (2.0 * h) - now.acceleration[1:-1])
    assert slope.max() < 5e-2  # at the ends of ramps the acceleration has a corner
    assert (now.share[0], now.share[-1]) == (0.0, pytest.approx(1.0, abs=1e-15))
    assert now.rate[[0, -1]] / now.rate.max() == pytest.approx(1.0 - np.array(drops))
    assert np.abs(reached_at(law, now.share, np.full(len(tau), ramp), every) - tau).max() < 1e-7
