"""Cubic splines: curves through given values at given parameters, smooth to the second derivative."""

from typing import Final

import numpy as np

from cellplan.geometry.curves.curve import BezierCurve
from cellplan.geometry.transforms import Array

END_POINT_COUNT: Final = 5  # values whose polynomial gives the derivative at an end: of fourth order, as inside


def spline_through(knots: Array, values: Array, *, is_closed: bool) -> BezierCurve:
    """Cubic curve through values at ``knots`` whose first two derivatives are continuous everywhere.

    An open curve ends with the derivative of the polynomial through its last five values. The error is then of fourth
    order in the spacing up to the ends; without a knot next to the end ("not a knot") it would be ten times larger
    there. Cubics are met exactly. A closed curve passes its start as smoothly as every other knot.

    Knots increase, shape (N,): at least two, of a closed curve at least four. Values have the shape (N, 3); the last
    repeats the first when the curve is closed.
    """
    rates = _periodic_rates(knots, values) if is_closed else _open_rates(knots, values)
    third = np.diff(knots)[:, None] / 3.0
    start, end = values[:-1], values[1:]
    control = np.stack([start, start + third * rates[:-1], end - third * rates[1:], end], axis=1)
    return BezierCurve(knots=knots, control=control)


def _open_rates(knots: Array, values: Array) -> Array:
    """Derivatives at the knots of an open spline, shape (N, 3)."""
    width = np.diff(knots)
    h, slopes = width[:, None], np.diff(values, axis=0) / width[:, None]
    ends = [_end_rate(knots, values), _end_rate(knots[::-1], values[::-1])]
    lower, upper = np.append(width[1:], 0.0), np.append(0.0, width[:-1])
    diagonal = np.concatenate([[1.0], 2.0 * (width[:-1] + width[1:]), [1.0]])
    inner = 3.0 * (h[1:] * slopes[:-1] + h[:-1] * slopes[1:])
    return _solve_tridiagonal(lower, diagonal, upper, right=np.vstack([ends[0], inner, ends[1]]))


def _end_rate(knots: Array, values: Array) -> Array:
    """Derivative at the first knot of the polynomial through the first few values, shape (3,)."""
    x, y = knots[:END_POINT_COUNT] - knots[0], values[:END_POINT_COUNT] - values[0]
    return np.linalg.solve(np.vander(x / x[-1], increasing=True), y)[1] / x[-1]


def _periodic_rates(knots: Array, values: Array) -> Array:
    """Derivatives at the knots of a closed spline, shape (N, 3); the last repeats the first.

    The two corner entries of the cyclic system are a matrix of rank one (Sherman and Morrison).
    """
    width = np.diff(knots)
    before, h = np.roll(width, 1), width[:, None]
    slopes = np.diff(values, axis=0) / h
    right = 3.0 * (h * np.roll(slopes, 1, axis=0) + before[:, None] * slopes)
    diagonal = 2.0 * (before + width)
    top, bottom = width[0], before[-1]  # entries at the ends of the first and the last row
    shift = -diagonal[0]
    diagonal[0] -= shift
    diagonal[-1] -= top * bottom / shift
    column = np.zeros((len(width), 1))
    column[0], column[-1] = shift, bottom
    solved = _solve_tridiagonal(width[1:], diagonal, before[:-1], right=np.hstack([right, column]))
    rates, spread = solved[:, :3], solved[:, 3:]
    share = (rates[:1] + top / shift * rates[-1:]) / (1.0 + spread[0] + top / shift * spread[-1])
    rates = rates - spread * share
    return np.concatenate([rates, rates[:1]])


def _solve_tridiagonal(lower: Array, diagonal: Array, upper: Array, *, right: Array) -> Array:
    """Solution of a tridiagonal system by elimination without exchange; spline matrices need none.

    Entries below and above the diagonal have the shape (n - 1,), those on it (n,), right-hand sides (n, k).
    """
    n = len(diagonal)
    x, pivots = right.copy(), diagonal.tolist()
    for k in range(1, n):
        factor = lower[k - 1] / pivots[k - 1]
        pivots[k] -= factor * upper[k - 1]
        x[k] -= factor * x[k - 1]
    x[-1] /= pivots[-1]
    for k in range(n - 2, -1, -1):
        x[k] = (x[k] - upper[k] * x[k + 1]) / pivots[k]
    return x
