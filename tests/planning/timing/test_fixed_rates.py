"""Demanded rates of the nominal time, by closed forms: laws of processes, rests that last, motion beside a process."""

from itertools import pairwise

import numpy as np
import pytest

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.task.task import TimeLaw, TimeLawKind
from cellplan.model.task.time_law import advance, reached_at
from cellplan.planning.timing.fixed_rates import AtFixedRate, FixedRate
from cellplan.planning.timing.path_length import stretches
from cellplan.planning.timing.retime import JointLimitsInTime, Retimer

STEP = 0.01


def test_a_steady_law_keeps_its_rate_between_smooth_ramps() -> None:
    law, tau = TimeLaw(kind=TimeLawKind.STEADY), np.linspace(0.0, 1.0, 20001)
    ramp = 0.125
    shares = advance(law, tau, ramp)

    assert shares.share[-1] == 1.0
    assert np.abs(np.gradient(shares.share, tau) - shares.rate).max() < 1e-6
    assert np.abs(np.gradient(shares.rate, tau) - shares.acceleration)[1:-1].max() < 0.01
    steady = (tau >= ramp) & (tau <= 1.0 - ramp)
    assert np.ptp(shares.rate[steady]) == 0.0
    assert shares.rate[steady][0] == pytest.approx(1.0 / (1.0 - ramp))
    assert np.abs(reached_at(law, shares.share, np.full(len(tau), ramp)) - tau).max() < 1e-7


def moving(breaks: Array) -> JointPath:
    """A joint that goes from 0 to 1 rad and back as half a cosine, over 4 s."""
    u = chebyshev(16).nodes
    nodes = [0.5 * (1.0 - np.cos(0.5 * np.pi * (a + (b - a) * u)))[None] for a, b in pairwise(breaks)]
    return JointPath(np.zeros(1), breaks, nodes)


def retimer(velocity: float, *rates: FixedRate) -> Retimer:
    bounds = JointLimitsInTime(velocity=np.array([velocity]), acceleration=np.full(1, 1e3), jerk=np.full(1, np.inf))

    def slower(sigma: Array, q: Array) -> float:
        return float(np.abs(np.diff(q[:, 0])).max() / STEP / velocity)

    return Retimer(bounds=bounds, step=STEP, feed_share=lambda s: np.zeros(len(s)), slower=slower, fixed_rates=rates)


def test_the_rate_is_one_where_it_is_demanded_and_faster_beside_it() -> None:
    path = moving(np.linspace(0.0, 4.0, 9))
    retimed_motion = retimer(2.0, FixedRate(begin=0.5, end=1.5, tolerance=0.05)).fastest(path)
    rate, middle = np.diff(retimed_motion.sigma) / STEP, 0.5 * (retimed_motion.sigma[1:] + retimed_motion.sigma[:-1])

    inside = (retimed_motion.sigma[:-1] >= 0.5) & (retimed_motion.sigma[1:] <= 1.5)
    assert np.count_nonzero(inside) >= 98
    assert np.abs(rate[inside] - 1.0).max() < 1e-9
    assert rate[middle > 2.5].min() > 1.5
    assert np.abs(np.diff(path.at(retimed_motion.sigma)[:, 0])).max() / STEP <= 2.0


def test_a_limit_lowers_the_rate_within_its_tolerance_and_no_further() -> None:
    """The joint has 0.785 rad/s at 1 s: 0.76 rad/s ask for 3 % less, 0.5 rad/s for more than 5 %."""
    whole = FixedRate(begin=0.0, end=4.0, tolerance=0.05)
    path = moving(np.linspace(0.0, 4.0, 9))
    retimed_motion = retimer(0.76, whole).fastest(path)
    slow = retimer(0.5, whole).fastest(path)

    rate = np.diff(retimed_motion.sigma) / STEP
    assert rate.min() >= 0.95
    assert rate.max() < 0.98
    assert np.ptp(rate) < 1e-9
    assert np.diff(slow.sigma).min() / STEP < 0.95
    assert np.abs(np.diff(path.at(slow.sigma)[:, 0])).max() / STEP <= 0.5


def test_a_rest_of_all_joints_lasts_as_long_as_is_demanded_of_it() -> None:
    rest = np.array([[1.0, 1.0]])
    path = JointPath(
        np.zeros(1), np.array([0.0, 1.0, 3.0, 4.0]), [np.array([[0.0, 1.0]]), rest, np.array([[1.0, 0.0]])]
    )
    retimed_motion = retimer(10.0, FixedRate(begin=1.25, end=2.0), FixedRate(begin=1.75, end=2.5)).fastest(path)

    waits = (retimed_motion.sigma >= 1.25) & (retimed_motion.sigma <= 2.5)
    assert np.count_nonzero(waits) == 124  # 1.25 s: the rows at its ends are those at 1 s and at 3 s
    assert np.diff(retimed_motion.sigma[waits]) == pytest.approx(np.full(123, STEP))
    assert np.all(np.diff(retimed_motion.sigma) > 0.0)
    slower = retimed_motion.lasting(retimed_motion.steps + 50)
    assert slower.steps == retimed_motion.steps + 50
    assert np.count_nonzero((slower.sigma >= 1.25) & (slower.sigma <= 2.5)) == 124


def test_rows_of_any_number_of_steps_take_that_number() -> None:
    piece = stretches(moving(np.linspace(0.0, 4.0, 9)), np.ones(1))[0]
    motion = AtFixedRate(piece, np.array([[0.5, 1.0]]), 1.0, STEP)
    for count in (60, 100, 200, 400):
        sigma = motion.rows(count)
        assert len(sigma) == count + 1
        assert (sigma[0], sigma[-1]) == (piece.sigma[0], piece.sigma[-1])
        assert np.all(np.diff(sigma) > 0.0)
        inside = (sigma[:-1] >= 0.5) & (sigma[1:] <= 1.0)
        assert np.diff(sigma)[inside] == pytest.approx(np.full(np.count_nonzero(inside), STEP))
