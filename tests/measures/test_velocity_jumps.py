"""Jumps of the desired speed, and what they are in rows of any step, on motions known by hand."""

from dataclasses import dataclass

import numpy as np
import pytest

from cellplan.geometry.transforms import Array
from cellplan.measures.accelerations import joint_accelerations
from cellplan.measures.velocity_jumps import desired_jumps, joint_jumps

SPEED = 0.3  # [rad/s] or [m/s]
CYCLE = 0.004  # [s]
STEPS = (0.001, 0.004, 0.02, 0.05)


def smooth(tau: Array) -> Array:
    inside = np.clip(tau, 0.0, 1.0)
    return inside**3 * (10.0 - 15.0 * inside + 6.0 * inside**2)


def approached(times: Array, start: float) -> Array:
    """A smooth approach that ends at the start, then even motion."""
    return 0.05 * smooth(times / start) + SPEED * np.maximum(times - start, 0.0)


def rows(step: float) -> Array:
    return np.arange(round(2.0 / step) + 1) * step


@dataclass(frozen=True)
class Desired:
    """A tool that rests, runs evenly along x or turns evenly about z, and rests."""

    turns: bool = False
    is_smooth: bool = False

    @property
    def times(self) -> Array:
        return rows(0.05)

    @property
    def jumps(self) -> Array:
        return np.array([0.0, 0.5, 1.0, 1.5, 2.0])

    def poses(self, times: Array) -> tuple[Array, ...]:
        share = np.clip(times - 0.5, 0.0, 1.0)
        travel = SPEED * (smooth(share) if self.is_smooth else share)
        X_PT = np.tile(np.eye(4), (len(times), 1, 1))
        if self.turns:
            X_PT[:, 0, 0] = X_PT[:, 1, 1] = np.cos(travel)
            X_PT[:, 1, 0], X_PT[:, 0, 1] = np.sin(travel), -np.sin(travel)
        else:
            X_PT[:, 0, 3] = travel
        return (X_PT,)


@pytest.mark.parametrize("turns", [False, True])
def test_the_desired_speed_jumps_where_even_motion_starts_and_ends(turns: bool) -> None:
    assert desired_jumps(Desired(turns=turns)).tolist() == [0.5, 1.5]


@pytest.mark.parametrize("turns", [False, True])
def test_a_smooth_law_has_no_jumps(turns: bool) -> None:
    assert not len(desired_jumps(Desired(turns=turns, is_smooth=True)))


@pytest.mark.parametrize("start", [1.0, 1.0004, 1.0117])
@pytest.mark.parametrize("step", STEPS)
def test_a_jump_after_an_approach_is_found_at_and_between_rows_of_any_step(step: float, start: float) -> None:
    times = rows(step)
    jumps = joint_jumps(times, approached(times, start)[:, None], np.array([start]))[:, 0]

    assert np.argmax(jumps) == round(start / step)
    assert jumps.max() == pytest.approx(SPEED, rel=0.1)
    assert np.count_nonzero(jumps) == 1


@pytest.mark.parametrize("step", STEPS)
def test_a_known_jump_counts_over_the_cycle_of_the_controller(step: float) -> None:
    times = rows(step)
    result = joint_accelerations(times, approached(times, 1.0)[:, None], cycle=CYCLE, jumps_at=np.array([1.0]))

    row = round(1.0 / step)
    assert result.values[row, 0] == pytest.approx(SPEED / min(step, CYCLE), rel=0.1)
    assert result.is_jump[row, 0]


@pytest.mark.parametrize("step", STEPS)
def test_a_joint_that_moves_smoothly_where_the_tool_jumps_has_no_jump(step: float) -> None:
    times = rows(step)
    q = smooth(0.5 * times)[:, None]
    result = joint_accelerations(times, q, cycle=CYCLE, jumps_at=np.array([0.42, 1.0]))

    assert not result.is_jump.any()
    assert result.values.max() == pytest.approx(10.0 / np.sqrt(3.0) / 4.0, rel=0.01)


def test_a_jump_at_the_ends_of_the_clock_is_one_out_of_rest() -> None:
    times = rows(0.02)
    jumps = joint_jumps(times, SPEED * times[:, None], np.array([0.0, 2.0]))[:, 0]

    assert jumps[[0, -1]] == pytest.approx([SPEED, SPEED])
    assert not jumps[1:-1].any()
