"""Smoothed chains: random rough curves stay in their tubes, get no rougher, and reach the bound where it is theirs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellplan.cache import store
from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import chord_lengths, smooth_through
from cellplan.geometry.curves.smoothed_chain import Chain, SmoothedValues, angles_between, unit

ROUNDED = 1e-9  # [-] of a length or an angle


def rough(seed: int, *, is_closed: bool, is_curved: bool) -> tuple[Chain, Array, Array, np.random.Generator]:
    """A chain of 3 to 60 places with points and axes that are rough by up to 1 mm and some degrees."""
    random = np.random.default_rng(seed)
    count = int(random.integers(5 if is_closed else 3, 60))
    s = np.linspace(0.0, 1.0, count, endpoint=not is_closed) + random.uniform(-0.3, 0.3, count) / count
    along = 2.0 * np.pi * s if is_closed else 2.0 * s
    points = 0.08 * np.stack([np.cos(along), np.sin(along), 0.2 * np.sin(3.0 * along)], axis=1)
    points += random.uniform(-1.0, 1.0, (count, 3)) * 10.0 ** random.uniform(-5.0, -3.0)
    axes = unit(random.normal(size=(count, 3)) * 10.0 ** random.uniform(-4.0, -1.5) - [0.0, 0.0, 1.0])
    kinks, fixed = np.zeros((2, count), dtype=bool)
    kinks[1:-1] = (random.uniform(size=count - 2) < 0.1) & (not is_curved)
    fixed[[0, -1]] = True, not is_closed
    ends = np.vstack([points, points[:1]]) if is_closed else points
    chain = Chain(knots=chord_lengths(ends), kinks=kinks, fixed=fixed | kinks, is_closed=is_closed, is_curved=is_curved)
    return chain, points, axes, random


def densely(chain: Chain, values: Array) -> Array:
    """Values along the curve through those of a chain, at other places than those at which it was held to the tube."""
    values = np.vstack([values, values[:1]]) if chain.is_closed else values
    u = np.interp(np.linspace(0.0, 1.0, 13 * len(values)), np.linspace(0.0, 1.0, len(values)), chain.knots)
    if not chain.is_curved:
        return np.stack([np.interp(u, chain.knots, column) for column in values.T], axis=1)
    breaks = np.zeros(len(values), dtype=bool)
    breaks[[0, -1]] = not chain.is_closed
    return smooth_through(chain.knots, values, breaks=breaks).evaluate(u, (chain.knots[0], chain.knots[-1]))[0]


def is_no_rougher(result: SmoothedValues, chain: Chain, given_values: Array) -> bool:
    stays = np.array_equal(result.values[chain.fixed], given_values[chain.fixed])
    return stays and 0.0 <= result.bound <= result.smoothed <= result.given * (1.0 + ROUNDED)


@given(st.integers(0, 10**6), st.sampled_from([(False, True), (True, True), (False, False)]))
def test_random_rough_curves_stay_in_their_tubes_and_get_no_rougher(seed: int, kind: tuple[bool, bool]) -> None:
    chain, points, axes, random = rough(seed, is_closed=kind[0], is_curved=kind[1])
    radius, angle = 10.0 ** random.uniform(-5.0, -2.5), 10.0 ** random.uniform(-4.0, -0.5)
    into = radius * float(random.choice([0.0, 0.3, 1.0]))

    moved = chain.with_points(points, axes, radius=radius, into=into)
    turned = chain.with_axes(axes, angle=angle)

    off = densely(chain, moved.values - points)
    assert np.linalg.norm(off, axis=1).max() <= radius * 1.01  # between the places at which it was held to it
    if chain.is_curved:
        assert np.sum(off * densely(chain, axes), axis=1).max() <= into + 0.01 * radius
    assert angles_between(unit(densely(chain, turned.values)), unit(densely(chain, axes))).max() <= 1.01 * angle
    assert is_no_rougher(moved, chain, points)
    assert is_no_rougher(turned, chain, axes)
    if not chain.is_curved:  # straight sides are in the tube where their ends are
        assert moved.smoothed - moved.bound <= 1e-5 * moved.given


def test_a_curve_that_swings_between_its_points_costs_little_of_the_bound() -> None:
    chain, points, axes, _ = rough(3, is_closed=False, is_curved=True)

    moved = chain.with_points(points, axes, radius=2e-3, into=1e-3)

    assert moved.smoothed < 0.9 * moved.given
    assert moved.smoothed <= 1.02 * moved.bound


@pytest.mark.parametrize("inward", [1.0, -1.0])
def test_depth_on_a_curved_surface_is_that_of_the_tangent_plane(inward: float) -> None:
    """Points on a cylinder of 20 mm with noise along its axis; the tool works outside on it, or in a bore."""
    count, size, radius = 60, 0.02, 5e-4
    angles = np.linspace(0.0, 2.0, count)
    out = np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)
    points = size * out + np.outer(np.random.default_rng(2).uniform(-4e-4, 4e-4, count), [0.0, 0.0, 1.0])
    fixed = np.isin(np.arange(count), [0, count - 1])
    chain = Chain(knots=chord_lengths(points), kinks=fixed & False, fixed=fixed, is_closed=False, is_curved=True)

    moved = chain.with_points(points, -inward * out, radius=radius, into=0.0)

    depths = inward * (size - np.linalg.norm(moved.values[:, :2], axis=1))
    tangential = np.linalg.norm(np.cross(moved.values - points, out), axis=1)
    assert moved.smoothed < 0.5 * moved.given
    assert tangential.max() > 0.5 * radius
    if inward > 0.0:
        assert depths.max() <= 1e-9  # the tangent plane is outside of a shaft
    else:
        # that of a bore is in the wall by t^2 / 2R at a distance t
        assert depths.max() <= radius**2 / (2.0 * size) + 1e-9
        assert np.all(depths <= tangential**2 / (2.0 * size) + 1e-9)


@pytest.mark.slow
def test_ten_thousand_points_reach_their_bound() -> None:
    random, count = np.random.default_rng(1), 10_000
    s = np.arange(count) * 1e-3
    points = np.stack([s, 0.05 * np.sin(2.0 * s), 0.0 * s], axis=1) + random.uniform(-85e-6, 85e-6, (count, 3))
    axes = unit(random.uniform(-0.015, 0.015, (count, 3)) - [0.0, 0.0, 1.0])
    fixed = np.isin(np.arange(count), [0, count - 1])
    chain = Chain(knots=chord_lengths(points), kinks=fixed & False, fixed=fixed, is_closed=False, is_curved=True)

    moved = chain.with_points(points, axes, radius=2e-4, into=1e-4)
    turned = chain.with_axes(axes, angle=np.deg2rad(2.0))

    assert moved.smoothed < 1e-3 * moved.given
    assert moved.smoothed < 1.02 * moved.bound
    assert turned.smoothed < 1e-4 * turned.given
    assert turned.smoothed < 1.1 * turned.bound


def test_what_was_smoothed_before_is_recalled_to_the_last_bit(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setenv("CELLPLAN_CACHE", str(tmp_path))
    chain, points, axes, _ = rough(11, is_closed=False, is_curved=True)
    first = chain.with_points(points, axes, radius=2e-4, into=0.0)
    store.forget()  # of this process: what is in the folder stays

    again = chain.with_points(points, axes, radius=2e-4, into=0.0)
    other = chain.with_points(points, axes, radius=3e-4, into=0.0)

    assert np.array_equal(again.values, first.values)
    assert again[1:] == first[1:]
    assert other.smoothed < first.smoothed
