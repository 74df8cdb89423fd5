"""Splines meet their values, are smooth to the second derivative, and converge with the fourth power of the spacing."""

import numpy as np
import pytest

from cellplan.geometry.curves.curve import BezierCurve
from cellplan.geometry.curves.spline import spline_through
from cellplan.geometry.transforms import Array

UNEVEN = np.array([0.0, 0.3, 0.35, 1.0, 1.8, 1.9, 2.6])


def ends_of_spans(curve: BezierCurve) -> tuple[Array, Array, Array, Array]:
    """First and second derivatives at the starts and ends of all spans."""
    a, b, c, d = np.moveaxis(curve.control, 1, 0)
    width = np.diff(curve.knots)[:, None]
    first = (3.0 * (b - a) / width, 3.0 * (d - c) / width)
    second = (6.0 * (a - 2.0 * b + c) / width**2, 6.0 * (b - 2.0 * c + d) / width**2)
    return *first, *second


@pytest.mark.parametrize("is_closed", [False, True])
def test_two_derivatives_are_continuous_at_every_knot(is_closed: bool) -> None:
    values = np.random.default_rng(1).normal(size=(len(UNEVEN), 3))
    if is_closed:
        values[-1] = values[0]

    curve = spline_through(UNEVEN, values, is_closed=is_closed)

    leaving, arriving, start, end = ends_of_spans(curve)
    assert np.array_equal(curve.control[:, 0], values[:-1])
    assert np.array_equal(curve.control[:, 3], values[1:])
    inner = slice(None) if is_closed else slice(-1)
    scale = np.abs(start).max()  # derivatives of random values at a spacing of 0.05 are in the thousands
    assert np.abs(arriving - np.roll(leaving, -1, axis=0))[inner].max() <= 1e-12 * np.abs(leaving).max()
    assert np.abs(end - np.roll(start, -1, axis=0))[inner].max() <= 1e-12 * scale


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6, 7])
def test_a_polynomial_of_degree_three_or_as_the_number_of_points_allows_is_met(count: int) -> None:
    knots = UNEVEN[:count]
    powers = np.arange(min(count, 4))
    weights = np.random.default_rng(count).normal(size=(len(powers), 3))

    curve = spline_through(knots, (knots[:, None] ** powers) @ weights, is_closed=False)

    u = np.linspace(knots[0], knots[-1], 101)
    p, _ = curve.evaluate(u, (knots[0], knots[-1]))
    assert np.allclose(p, (u[:, None] ** powers) @ weights, rtol=0.0, atol=1e-12)


def test_the_error_falls_with_the_fourth_power_up_to_the_ends() -> None:
    u = np.linspace(0.0, 2.0, 4001)
    errors = []
    for count in (161, 321):
        knots = np.linspace(0.0, 2.0, count)
        curve = spline_through(knots, np.stack([np.sin(knots), np.cos(knots), knots], axis=1), is_closed=False)
        p, _ = curve.evaluate(u, (0.0, 2.0))
        errors.append(np.abs(p - np.stack([np.sin(u), np.cos(u), u], axis=1)).max())

    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.05)
    assert errors[0] == pytest.approx(0.0125**4 / 384.0, rel=0.05)  # the error of a cubic with the right end slopes


def test_values_that_stand_still_stay_still() -> None:
    knots = np.linspace(0.0, 3.0, 9)

    p, v = spline_through(knots, np.full((9, 3), 0.7), is_closed=False).evaluate(np.linspace(0, 3, 50), (0.0, 3.0))

    assert np.all(p == 0.7)
    assert np.all(v == 0.0)
