"""Accelerations and jerk of rows against motions that are known in closed form."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from builders.scene_builders import fixed_part, make_cell
from hypothesis import given
from hypothesis import strategies as st

from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_exp
from cellplan.measures.accelerations import jerks, joint_accelerations, part_acceleration, point_accelerations

CYCLE = 0.004  # [s]


def clock(step: float, duration: float = 1.0) -> Array:
    return np.arange(round(duration / step) + 1) * step


def quintic(times: Array) -> Array:
    tau = times / times[-1]
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)


def ramp(times: Array) -> Array:
    """Evenly up to speed during the first half, evenly down during the second: 4 /s2 all along."""
    tau = times / times[-1]
    return np.where(tau < 0.5, 2.0 * tau**2, 1.0 - 2.0 * (1.0 - tau) ** 2) * times[-1] ** 2


def sizes(times: Array, positions: Array) -> Array:
    return joint_accelerations(times, positions[:, None], cycle=CYCLE).values[:, 0]


@pytest.mark.parametrize("step", [0.001, 0.004, 0.01, 0.02, 0.05])
def test_a_quintic_from_rest_to_rest_has_its_peak_and_no_jump(step: float) -> None:
    times = clock(step)
    rows = joint_accelerations(times, quintic(times)[:, None], cycle=CYCLE)

    assert rows.values.max() == pytest.approx(10.0 / np.sqrt(3.0), rel=0.03)
    assert not rows.is_jump.any()


@pytest.mark.parametrize("step", [0.001, 0.004, 0.01, 0.02, 0.05])
def test_even_speeding_up_from_rest_is_no_jump(step: float) -> None:
    times = clock(step)
    rows = joint_accelerations(times, ramp(times)[:, None], cycle=CYCLE)

    assert rows.values.max() == pytest.approx(4.0, rel=1e-6)
    assert not rows.is_jump.any()


@pytest.mark.parametrize("step", [0.001, 0.01])
def test_speeds_that_grow_by_the_same_amount_in_every_step_are_no_jump(step: float) -> None:
    speeds = 3.0 * step * np.concatenate([np.arange(1, 51), np.arange(50, 0, -1)])  # what a bounded solver does
    positions = np.concatenate([[0.0], np.cumsum(speeds * step)])

    assert sizes(clock(step, 100 * step), positions).max() == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize(("step", "over"), [(0.001, 0.001), (0.004, 0.004), (0.02, CYCLE), (0.05, CYCLE)])
def test_a_motion_that_starts_and_ends_at_speed_jumps_over_the_step_or_the_cycle(step: float, over: float) -> None:
    times = clock(step)
    rows = joint_accelerations(times, 0.3 * times[:, None], cycle=CYCLE)

    assert rows.values[[0, -1], 0] == pytest.approx([0.3 / over, 0.3 / over])
    assert rows.values[1:-1].max() < 1e-6
    assert rows.is_jump[[0, -1], 0].all()


@pytest.mark.parametrize("step", [0.001, 0.02])
def test_a_jump_in_the_middle_of_a_program_is_found(step: float) -> None:
    times = clock(step)
    rows = joint_accelerations(times, np.maximum(times - 0.5, 0.0)[:, None], cycle=CYCLE)

    k = int(np.searchsorted(times, 0.5 - 1e-9))
    assert rows.values[k, 0] == pytest.approx(1.0 / min(step, CYCLE))
    assert rows.is_jump[k, 0]


def test_a_joint_that_stands_still_has_no_acceleration() -> None:
    times = clock(0.001)
    assert np.all(sizes(times, np.full(len(times), 1.2345)) == 0.0)


def test_accelerations_of_a_point_on_a_circle() -> None:
    times = clock(0.001)
    angle = 2.0 * np.pi * quintic(times)
    points = 0.5 * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)

    result = np.linalg.norm(point_accelerations(times, points), axis=1)

    middle = len(times) // 2  # fastest there, and not speeding up
    assert result[middle] == pytest.approx(0.5 * (2.0 * np.pi * 1.875) ** 2, rel=1e-3)
    assert result[0] == pytest.approx(0.0, abs=0.1)


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=40), st.sampled_from([0.001, 0.004, 0.03]))
def test_accelerations_times_the_step_add_up_to_nothing(speeds: list[float], step: float) -> None:
    positions = np.concatenate([[0.2], 0.2 + np.cumsum(np.array(speeds) * step)])
    times = clock(step, step * len(speeds))

    change = point_accelerations(times, positions).sum() * step

    assert change == pytest.approx(0.0, abs=1e-9)  # from rest to rest


@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=40), st.sampled_from([0.001, 0.004, 0.03]))
def test_a_motion_run_backwards_has_the_same_accelerations(speeds: list[float], step: float) -> None:
    positions = np.concatenate([[0.2], 0.2 + np.cumsum(np.array(speeds) * step)])
    times = clock(step, step * len(speeds))

    assert sizes(times, positions[::-1])[::-1] == pytest.approx(sizes(times, positions), abs=1e-6)


@pytest.mark.parametrize("step", [0.0005, 0.001, 0.003, 0.004, 0.01, 0.02])
def test_jerk_of_a_quintic_is_right_for_steps_shorter_and_longer_than_the_window(step: float) -> None:
    times = clock(step, 0.999 if step == 0.003 else 1.0)
    jerk = jerks(times, point_accelerations(times, quintic(times))[:, None, None], window=CYCLE)

    exact = 60.0 / times[-1] ** 3
    assert exact * (1.0 - 10.0 * max(step, CYCLE)) <= jerk.max() <= exact * (1.0 + 1e-6)


def test_a_jump_of_acceleration_counts_over_the_window_and_not_over_the_step() -> None:
    times = clock(0.001)
    jerk = jerks(times, point_accelerations(times, ramp(times))[:, None, None], window=CYCLE)

    assert jerk.max() == pytest.approx(8.0 / CYCLE, rel=1e-6)  # from +4 to -4


@pytest.mark.parametrize("window", [0.001, 0.0025, 0.004, 0.05, 3.0])
def test_jerk_is_the_largest_change_over_any_window_of_that_length(window: float) -> None:
    generator = np.random.default_rng(3)
    times = clock(0.01, 0.4)
    accelerations = generator.normal(size=len(times))
    known = np.concatenate([[-0.01], times, [0.41]])
    values = np.concatenate([[0.0], accelerations, [0.0]])
    from_times = np.concatenate([known, known - window])  # a piecewise linear change is largest at a corner
    changes = np.interp(from_times + window, known, values) - np.interp(from_times, known, values)

    jerk = jerks(times, accelerations[:, None, None], window=window)

    assert jerk.max() * window == pytest.approx(np.abs(changes).max(), rel=1e-6)


def test_a_corner_of_the_part_is_accelerated_as_the_rotation_of_a_rigid_body_says() -> None:
    """``a + alpha x r + w x (w x r)`` of every corner, from the derivatives of a motion in closed form."""
    size, axis = np.array([0.4, 0.1, 0.2]), np.array([2.0, -1.0, 2.0]) / 3.0
    X_PS = pose((0.1, -0.2, 0.3), (0.3, -0.5, 0.8))
    part = replace(fixed_part(Box(tuple(size)), np.eye(4)), X_PS=X_PS)
    times = clock(0.0005)
    tau = times / times[-1]
    shift, turn = np.array([0.7, -0.4, 0.2]), 1.5
    rate, change = 30.0 * (tau * (1.0 - tau)) ** 2, 60.0 * tau * (1.0 - tau) * (1.0 - 2.0 * tau)
    R = rotation_exp(turn * quintic(times)[:, None] * axis)
    X_WP = pose_from(R, quintic(times)[:, None] * shift)
    corners = np.array([size * signs / 2.0 for signs in product((-1, 1), repeat=3)]) @ X_PS[:3, :3].T + X_PS[:3, 3]
    r = np.einsum("nij,kj->nki", R, corners)
    w, alpha = (turn * derivative[:, None, None] * axis for derivative in (rate, change))
    exact = change[:, None, None] * shift + np.cross(alpha, r) + np.cross(w, np.cross(w, r))

    measured = part_acceleration(make_cell(part=part), times, X_WP, window=CYCLE)

    sizes_of_corners = np.linalg.norm(exact, axis=-1)
    assert measured.corner.peak == pytest.approx(sizes_of_corners.max(), rel=1e-4)
    k = int(np.argmax(sizes_of_corners.max(axis=1)))
    assert measured.corner.peak_at_s == pytest.approx(times[k], abs=0.01)
    jerk = np.linalg.norm(np.gradient(exact, times, axis=0), axis=-1).max()
    assert measured.corner.peak_jerk == pytest.approx(jerk, rel=0.03)  # over a cycle, less than at one instant
