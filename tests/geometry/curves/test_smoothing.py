"""Smoothing: closed forms, a second solver, the gap to the bound, and what must not depend on how points are listed."""

import numpy as np
import pytest
from scipy.optimize import minimize

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.smoothing import Differences, Smoothest, Tube, smoothest

EZ = np.array([0.0, 0.0, 1.0])
WIDTH = 1e-3  # of tubes


def uneven(count: int) -> Array:
    """Parameters from 0 to 1 whose distances differ by up to a factor of 2."""
    widths = 1.0 + np.random.default_rng(count).uniform(size=count - 1)
    return np.concatenate([[0.0], np.cumsum(widths)]) / widths.sum()


def noisy_line(count: int, *, seed: int = 1) -> tuple[Array, Array]:
    """Points of a straight line, and the same with noise of half the width between the ends."""
    s = uneven(count)
    line = s[:, None] * np.array([1.0, 2.0, -0.5])
    noise = np.random.default_rng(seed).uniform(-0.25, 0.25, (count, 3)) * WIDTH
    noise[[0, -1]] = 0.0
    return line, line + noise


def round_tube(count: int, radius: float) -> Tube:
    return Tube.of_positions(None, np.full(count, radius), into=np.zeros(count))


def ends(count: int) -> Flags:
    fixed = np.zeros(count, dtype=bool)
    fixed[[0, -1]] = True
    return fixed


def of_open(values: Array, tube: Tube, fixed: Flags | None = None) -> tuple[Smoothest, Differences]:
    count = len(values)
    differences = Differences(uneven(count), kinks=np.zeros(count, dtype=bool), is_closed=False)
    return smoothest(values, differences, tube, fixed=ends(count) if fixed is None else fixed), differences


def test_roughness_of_a_parabola_is_its_second_derivative() -> None:
    s = uneven(30)
    differences = Differences(s, kinks=np.zeros(30, dtype=bool), is_closed=False)

    second = differences.of(s[:, None] ** 2 * np.array([3.0, 0.0, 4.0]))

    centres = 0.5 * (s[2:] - s[:-2])
    assert np.linalg.norm(second, axis=1) == pytest.approx(10.0 * np.sqrt(centres), rel=1e-9)


@pytest.mark.parametrize("count", [3, 16, 17, 200])
def test_noise_on_a_straight_line_becomes_the_line(count: int) -> None:
    line, values = noisy_line(count)

    smooth, differences = of_open(values, round_tube(count, WIDTH))

    assert np.abs(smooth.values - line).max() < 0.01 * WIDTH
    assert differences.roughness(smooth.values) < 1e-3 * differences.roughness(values)
    assert np.array_equal(smooth.values[[0, -1]], values[[0, -1]])


def test_fixed_points_and_a_tube_that_does_not_bind_leave_least_squares() -> None:
    count = 40
    fixed = ends(count)
    fixed[[11, 23, 30]] = True
    _, values = noisy_line(count)
    values[fixed] += np.random.default_rng(3).normal(size=(5, 3)) * 0.05

    smooth, differences = of_open(values, round_tube(count, 10.0), fixed)

    matrix = np.array([differences.of(np.outer(row, EZ))[:, 2] for row in np.eye(count)]).T
    best = np.linalg.lstsq(matrix[:, ~fixed], -matrix[:, fixed] @ values[fixed], rcond=None)[0]
    assert smooth.values[~fixed] == pytest.approx(best, abs=1e-4)
    assert smooth.bound == pytest.approx(differences.roughness(smooth.values), rel=1e-5)


@pytest.mark.parametrize("into", [0.0, 0.3, 1.0])
def test_the_bound_of_a_tube_that_binds_is_met_within_the_tube(into: float) -> None:
    count = 150
    values = np.stack([uneven(count), np.sin(9.0 * uneven(count)), np.zeros(count)], axis=1)
    values += np.random.default_rng(2).uniform(-2.0, 2.0, (count, 3)) * WIDTH
    normals = np.tile(EZ, (count, 1))

    smooth, differences = of_open(
        values, Tube.of_positions(normals, np.full(count, WIDTH), into=np.full(count, into * WIDTH))
    )

    off = smooth.values - values
    assert np.linalg.norm(off, axis=1).max() <= WIDTH * (1.0 + 1e-12)
    assert off[:, 2].max() <= into * WIDTH + 1e-15
    reached = differences.roughness(smooth.values)
    assert smooth.bound <= reached <= smooth.bound * (1.0 + 1e-5)
    assert reached < 0.7 * differences.roughness(values)


def test_another_solver_reaches_no_smoother_points() -> None:
    count, inner = 8, slice(1, 7)
    _, values = noisy_line(count)
    values += np.random.default_rng(5).normal(size=(count, 3)) * WIDTH
    differences = Differences(uneven(count), kinks=np.zeros(count, dtype=bool), is_closed=False)

    def moved(x: Array) -> Array:
        e = np.zeros((count, 3))
        e[inner] = WIDTH * x.reshape(-1, 3)
        return e

    other = minimize(
        lambda x: np.sum(differences.of(values + moved(x)) ** 2),
        np.zeros(18),
        constraints=[
            {"type": "ineq", "fun": lambda x: 1.0 - np.sum(x.reshape(-1, 3) ** 2, axis=1)},
            {"type": "ineq", "fun": lambda x: -x.reshape(-1, 3)[:, 2]},
        ],
        options={"maxiter": 500, "ftol": 1e-12},
    )
    tube = Tube.of_positions(np.tile(EZ, (count, 1)), np.full(count, WIDTH), into=np.zeros(count))
    smooth = smoothest(values, differences, tube, fixed=ends(count))

    assert other.success
    assert differences.roughness(values + moved(other.x)) == pytest.approx(smooth.bound, rel=1e-4)


def test_axes_that_wobble_about_a_direction_become_that_direction() -> None:
    count = 60
    axes = np.random.default_rng(4).normal(size=(count, 3)) * 0.01 + EZ
    axes[[0, -1]] = EZ
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)

    smooth, _ = of_open(axes, Tube.of_axes(axes, np.full(count, np.deg2rad(5.0))))

    unit = smooth.values / np.linalg.norm(smooth.values, axis=1, keepdims=True)
    assert np.abs(unit - EZ).max() < 1e-5


@pytest.mark.parametrize("degrees", [0.01, 0.3, 3.0])
def test_axes_stay_in_their_cones_and_their_bound_holds_after_they_are_normalised(degrees: float) -> None:
    count = 90
    s = uneven(count)
    axes = np.stack([np.sin(2.0 * s), 0.1 * np.sin(30.0 * s), np.cos(2.0 * s)], axis=1)
    axes += np.random.default_rng(6).normal(size=(count, 3)) * np.deg2rad(degrees)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)

    smooth, differences = of_open(axes, Tube.of_axes(axes, np.full(count, np.deg2rad(degrees))))

    lengths = np.linalg.norm(smooth.values, axis=1, keepdims=True)
    unit = smooth.values / lengths
    assert lengths.max() <= 1.0 + 1e-15
    chords = 2.0 * np.sin(0.5 * np.deg2rad(degrees))
    assert np.linalg.norm(unit - axes, axis=1).max() <= chords * (1.0 + 1e-6)
    reached = differences.roughness(unit)
    assert smooth.bound <= reached < differences.roughness(axes)
    assert differences.roughness(smooth.values) == pytest.approx(smooth.bound, rel=1e-5)


def test_a_closed_chain_is_smoothed_alike_in_both_directions_and_has_no_kink_at_its_start() -> None:
    count = 45
    angles = 2.0 * np.pi * np.arange(count) / count
    values = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    values[1:] += np.random.default_rng(7).uniform(-1.0, 1.0, (count - 1, 3)) * 0.01
    fixed = np.zeros(count, dtype=bool)
    fixed[0] = True
    differences = Differences(np.arange(count + 1) / count, kinks=np.zeros(count, dtype=bool), is_closed=True)
    back = np.append(0, np.arange(count - 1, 0, -1))
    tube = round_tube(count, 0.02)

    smooth = smoothest(values, differences, tube, fixed=fixed)
    reverse = smoothest(values[back], differences, tube, fixed=fixed)

    assert reverse.values[back] == pytest.approx(smooth.values, abs=1e-6)
    second = np.linalg.norm(differences.of(smooth.values), axis=1)
    assert second.max() < 1.5 * second.min()  # near those of a circle, at the start too
    assert differences.roughness(smooth.values) == pytest.approx(smooth.bound, rel=1e-5)


def test_a_kink_stays_out_of_the_roughness() -> None:
    corner = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 2.0, 0.0]])
    kinks = np.array([False, False, True, False, False])

    assert Differences(np.arange(5.0), kinks=kinks, is_closed=False).roughness(corner) == 0.0
    assert Differences(np.arange(5.0), kinks=kinks & False, is_closed=False).roughness(corner) > 0.1
