"""Curves in space over a parameter: circles, straight sides, rounded corners and smooth curves through points."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices

Interval = tuple[float | Array, float | Array]  # stretch of the parameter, one or one per point: see spans_at

DIFFERENCE: Final = 2e-5  # [-] of a span: half the distance of the places from which a rate follows, to ten digits
MOST_HALVINGS: Final = 16  # of a span that is fitted; the error falls to a sixteenth with each
CORNER_CONTROLS: Final = np.array([-1.0, -0.6, -0.4, 0.4, 0.6, 1.0])  # [-] of a corner, see rounded_sides


class Curve(Protocol):
    """A curve that is smooth between its knots."""

    @property
    def knots(self) -> Array:
        """Increasing parameter values, shape (M + 1,): the first and the last end the curve."""

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives by the parameter, shape (N, 3) each, at ``u`` of shape (N,) within ``interval``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CircleCurve:
    """Full circle ``centre + first cos(u) + second sin(u)``."""

    centre: Array  # centre in [m], shape (3,)
    first: Array  # radius vector to the start in [m], shape (3,)
    second: Array  # radius vector a quarter turn later in [m], shape (3,)

    @property
    def knots(self) -> Array:
        """One smooth span of a full turn in [rad]."""
        return np.array([0.0, 2.0 * np.pi])

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:  # noqa: ARG002
        """Points and derivatives, see `Curve`."""
        cosine, sine = np.cos(u)[:, None], np.sin(u)[:, None]
        return self.centre + cosine * self.first + sine * self.second, cosine * self.second - sine * self.first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BezierCurve:
    """Chain of Bezier spans of one degree."""

    knots: Array  # increasing parameter values, shape (M + 1,)
    control: Array  # control points of each span, shape (M, degree + 1, 3)

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives by de Casteljau's rule, see `Curve`."""
        span = spans_at(self.knots, u, interval)
        width = (self.knots[span + 1] - self.knots[span])[:, None]
        x = (u - self.knots[span])[:, None] / width
        control = list(np.moveaxis(self.control[span], 1, 0))
        steps = [b - a for a, b in pairwise(control)]
        return _casteljau(control, x), len(steps) * _casteljau(steps, x) / width


def spans_at(knots: Array, u: Array, interval: Interval) -> Indices:
    """Index of the span that holds each parameter; at a knot that ends the interval, the span inside it."""
    first = np.searchsorted(knots, interval[0], side="right") - 1
    last = np.searchsorted(knots, interval[1], side="left") - 1
    return np.clip(np.searchsorted(knots, u, side="right") - 1, first, np.maximum(first, last))


def _casteljau(control: list[Array], x: Array) -> Array:
    """Points of Bezier curves at shares ``x``, shape (N, 1), from their control points, shape (N, 3) each."""
    while len(control) > 1:
        control = [a + x * (b - a) for a, b in pairwise(control)]
    return control[0]


def chord_lengths(points: Array) -> Array:
    """Length of the straight sides behind each point, shape (N,), from points of shape (N, 3)."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def straight_sides(knots: Array, points: Array) -> BezierCurve:
    """Straight sides between points of shape (N, 3) that are passed at ``knots``, shape (N,)."""
    return BezierCurve(knots=knots, control=np.stack([points[:-1], points[1:]], axis=1))


def rounded_sides(knots: Array, corners: Array, blend: float) -> BezierCurve:
    """Straight sides with every inner corner rounded from ``blend`` before it to ``blend`` after it.

    The control points of a rounded corner lie on its two sides at ``-1, -3/5, -2/5, 2/5, 3/5, 1`` times ``blend``: the
    quintic then joins the straight sides with the same tangent and zero curvature, stays inside the corner's triangle
    and passes the corner at ``blend / 4`` times the length of the change of direction. Its sharpest curvature at a
    right angle is 1.3 times that of the circular arc between the same points, which would jump.

    The corners are in [m], shape (N, 3), with the length along the straight sides as knots, shape (N,); ``blend`` is at
    most half of the shortest side.
    """
    sides = np.diff(corners, axis=0)
    direction = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    return rounded_lines(knots, corners, direction, np.full(len(corners) - 2, blend))


def rounded_lines(knots: Array, corners: Array, direction: Array, blends: Array) -> BezierCurve:
    """As `rounded_sides`, for values that change at a rate along each side, rounded within a distance of its own.

    Args:
        knots: Parameters of the corners, shape (N,).
        corners: Values there, shape (N, 3).
        direction: Their derivative by the parameter on each side, shape (N - 1, 3).
        blends: Distance by the parameter within which each inner corner is rounded, 0 for not at all, shape (N - 2,);
            two neighbours fit on the side between them.
    """
    blend = blends[:, None]
    before, after = corners[1:-1] - blend * direction[:-1], corners[1:-1] + blend * direction[1:]
    starts, ends = np.vstack([corners[:1], after]), np.vstack([before, corners[-1:]])
    share = np.linspace(0.0, 1.0, len(CORNER_CONTROLS))[:, None]
    lines = starts[:, None] + share * (ends - starts)[:, None]
    along = np.where((CORNER_CONTROLS < 0.0)[:, None], direction[:-1, None], direction[1:, None])
    turns = corners[1:-1, None] + blend[:, None] * CORNER_CONTROLS[:, None] * along
    spans = np.empty((2 * len(lines) - 1, len(CORNER_CONTROLS), 3))
    spans[0::2], spans[1::2] = lines, turns
    edges = np.concatenate(
        [knots[:1], np.column_stack([knots[1:-1] - blends, knots[1:-1] + blends]).ravel(), knots[-1:]]
    )
    is_long = np.diff(edges) > 1e-9 * blends.max(
        initial=0.0
    )  # a side that its two roundings use up leaves no straight rest
    return BezierCurve(knots=np.concatenate([edges[:-1][is_long], edges[-1:]]), control=spans[is_long])


def turns(points: Array) -> Array:
    """Change of direction in [rad] at each inner point of straight sides, shape (N - 2,)."""
    sides = np.diff(points, axis=0)
    t = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    sine = np.linalg.norm(np.cross(t[:-1], t[1:]), axis=1)
    return np.arctan2(sine, np.sum(t[:-1] * t[1:], axis=1))


def smooth_through(knots: Array, values: Array, *, breaks: Flags) -> BezierCurve:
    """Cubic curve through values of shape (N, 3) at ``knots``, with continuous derivatives except at the breaks.

    Knots increase; ``breaks`` says where the derivative may jump, shape (N,), see `tangents`.
    """
    width = np.diff(knots)[:, None]
    leaving, arriving = tangents(np.diff(values, axis=0) / width, width, breaks)
    return BezierCurve(knots=knots, control=cubic_controls(width, (values[:-1], values[1:]), (leaving, arriving)))


def by_differences(
    values: Callable[[Array, Interval], Array], knots: Array, u: Array, interval: Interval
) -> tuple[Array, Array]:
    """Values of a function that is smooth between knots, shape (N, 3), and their rates by three places of a span.

    Args:
        values: The function, at parameters of shape (M,) within an interval.
        knots: Increasing parameters, shape (K + 1,).
        u: Parameters, shape (N,), within ``interval``.
    """
    span = spans_at(knots, u, interval)
    low, high = knots[span], knots[span + 1]
    h = DIFFERENCE * (high - low)
    x = np.clip(u, low + h, high - h)
    within = np.tile(low, 4), np.tile(high, 4)
    at_u, before, middle, after = np.split(values(np.concatenate([u, x - h, x, x + h]), within), 4)
    h, off = h[:, None], (u - x)[:, None]
    return at_u, (after - before) / (2.0 * h) + off * (after - 2.0 * middle + before) / h**2


def cubic_fit(curve: Curve, *, tolerance: float) -> BezierCurve:
    """Cubics with the values and derivatives of a curve, halved until the middle of each is within a tolerance of it.

    The curve is smooth between its knots, which all become knots; the tolerance has the unit of its values.
    """
    edges = np.asarray(curve.knots, dtype=float)
    for _ in range(MOST_HALVINGS):
        low, high = edges[:-1], edges[1:]
        width = np.diff(edges)[:, None]
        (start, leaving), (end, arriving) = (curve.evaluate(u, (low, high)) for u in (low, high))
        control = cubic_controls(width, (start, end), (leaving, arriving))
        middle = curve.evaluate(0.5 * (low + high), (low, high))[0]
        off = np.linalg.norm(middle - _casteljau(list(np.moveaxis(control, 1, 0)), np.full((len(low), 1), 0.5)), axis=1)
        is_open = off > tolerance
        if not np.any(is_open):
            break
        edges = np.insert(edges, np.flatnonzero(is_open) + 1, 0.5 * (low + high)[is_open])
    return BezierCurve(knots=edges, control=control)


def cubic_controls(width: Array, ends: tuple[Array, Array], rates: tuple[Array, Array]) -> Array:
    """Control points of cubics with values and derivatives of shape (M, 3) at both ends of widths of shape (M, 1)."""
    (start, end), (leaving, arriving) = ends, rates
    return np.stack([start, start + leaving * width / 3.0, end - arriving * width / 3.0, end], axis=1)


def tangents(slopes: Array, widths: Array, breaks: Flags) -> tuple[Array, Array]:
    """Derivatives at both ends of each span, shape (M, 3) each, so that a parabola through three neighbours is met.

    Inside, the derivative is the mean of the neighbouring slopes, weighted with the opposite widths. At a break it
    comes from the span's own side alone: a span between two breaks is straight. When neither the first nor the last
    knot is a break, the curve is closed and the two are neighbours.

    Slopes are the mean derivatives of the spans, shape (M, 3), widths their parameter widths, shape (M, 1); ``breaks``
    says at which knots the derivative may jump, shape (M + 1,).
    """
    before, after = np.roll(slopes, 1, axis=0), slopes
    width_before = np.roll(widths, 1, axis=0)
    inner = (widths * before + width_before * after) / (widths + width_before)
    inner = np.vstack([inner, inner[:1]])
    start_breaks, end_breaks = breaks[:-1, None], breaks[1:, None]
    leaving = np.where(start_breaks, np.where(end_breaks, slopes, 2.0 * slopes - inner[1:]), inner[:-1])
    arriving = np.where(end_breaks, np.where(start_breaks, slopes, 2.0 * slopes - inner[:-1]), inner[1:])
    return leaving, arriving
