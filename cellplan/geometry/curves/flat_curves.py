"""Curves of a drawing: lines, arcs of ellipses and splines in a plane, and the contours that they are chained to."""

from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final, NamedTuple, Self

import numpy as np

from cellplan.geometry.arrays import Array

WIDEST_STEP: Final = np.deg2rad(10.0)  # [rad] between neighbouring points of an arc, so that none is a corner
CHORD_OF_SEARCH: Final = 1e-4  # [m] of the sides among which the nearest point of a curve is looked for
NEAREST_STEPS: Final = 80  # thirds that are left out in this search: to rounding
SAME_PLACE: Final = 1e-9  # [m] by which a point between the ends of a curve is nearer than an end, at least
STEPS_OF_SPAN: Final = 4  # first steps of each span of a spline
SAME_SPOT: Final = 1e-3  # [-] of the distance within which ends meet: curves whose middles are nearer are one twice


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatCurve(ABC):
    """Curve over a span of its parameter, which it is run along from the first to the second value."""

    span: tuple[float, float] = (0.0, 1.0)

    @abstractmethod
    def rates(self, t: Array) -> tuple[Array, Array]:
        """Points in [m] and their rates by the parameter, shape (N,); shape (N, 2) each."""

    @abstractmethod
    def dense(self, chord: float) -> Array:
        """Increasing parameters, of the whole curve, with which sides that follow it within ``chord`` may begin."""

    def at(self, t: Array) -> tuple[Array, Array]:
        """Points in [m] and unit directions of travel at parameters, shape (N,); shape (N, 2) each."""
        points, rates = self.rates(t)
        length = np.linalg.norm(rates, axis=1, keepdims=True)
        sign = 1.0 if self.span[0] < self.span[1] else -1.0
        return points, sign * rates / np.where(length > 0.0, length, 1.0)

    def parameters(self, chord: float) -> Array:
        """Those parameters within its span, in the order of travel."""
        low, high = sorted(self.span)
        dense = self.dense(chord)
        t = np.concatenate([[low], dense[(dense > low) & (dense < high)], [high]])
        return t if self.span[0] < self.span[1] else t[::-1]

    def turned_back(self) -> Self:
        """The same curve from its end."""
        return replace(self, span=self.span[::-1])

    def end(self, place: int) -> Array:
        """Its start (0) or its end (1) in [m], shape (2,)."""
        return self.rates(np.array([self.span[place]]))[0][0]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatLine(FlatCurve):
    """Straight line between two points in [m], shape (2,) each."""

    first: Array
    last: Array

    def rates(self, t: Array) -> tuple[Array, Array]:
        """See `FlatCurve`."""
        step = self.last - self.first
        return self.first + t[:, None] * step, np.broadcast_to(step, (len(t), 2))

    def dense(self, chord: float) -> Array:  # noqa: ARG002 - it is its own chord
        """See `FlatCurve`."""
        return np.array([0.0, 1.0])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatArc(FlatCurve):
    """Arc of an ellipse, c + a cos(t) + b sin(t), with vectors in [m], shape (2,)."""

    centre: Array
    first: Array
    second: Array

    def rates(self, t: Array) -> tuple[Array, Array]:
        """See `FlatCurve`."""
        c, s = np.cos(t)[:, None], np.sin(t)[:, None]
        return self.centre + c * self.first + s * self.second, c * self.second - s * self.first

    def dense(self, chord: float) -> Array:
        """See `FlatCurve`."""
        radius = float(max(np.linalg.norm(self.first), np.linalg.norm(self.second)))
        widest = min(WIDEST_STEP, 2.0 * float(np.arccos(max(0.0, 1.0 - chord / radius))))
        low, high = sorted(self.span)
        return np.linspace(low, high, 1 + max(2, int(np.ceil((high - low) / widest))))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlatSpline(FlatCurve):
    """Rational B-spline.

    Attributes:
        degree: Degree of its polynomials.
        knots: Knots that do not decrease, shape (N + degree + 1,).
        control: Control points in [m] times their weights, and the weights, shape (N, 3).
    """

    degree: int
    knots: Array
    control: Array

    def rates(self, t: Array) -> tuple[Array, Array]:
        """See `FlatCurve`; by the recursion of de Boor."""
        p, knots = self.degree, self.knots
        k = np.clip(np.searchsorted(knots, t, side="right") - 1, p, len(self.control) - 1)
        while np.any(empty := knots[k + 1] <= knots[k]):
            k[empty] -= 1
        d, rate = self.control[k[:, None] + np.arange(-p, 1)], np.zeros((len(t), 3))
        for level in range(1, p + 1):
            i = k[:, None] + np.arange(level - p, 1)
            low, width = knots[i], knots[i + p + 1 - level] - knots[i]
            if level == p:
                rate = p * (d[:, 1] - d[:, 0]) / width
            share = ((t[:, None] - low) / width)[..., None]
            d = (1.0 - share) * d[:, :-1] + share * d[:, 1:]
        weight, points = d[:, 0, 2:], d[:, 0, :2] / d[:, 0, 2:]
        return points, (rate[:, :2] - points * rate[:, 2:]) / weight

    def dense(self, chord: float) -> Array:  # noqa: ARG002 - it is made denser where it is off
        """See `FlatCurve`: some parameters of each of its polynomials."""
        spans = np.unique(self.knots[self.degree : len(self.control) + 1])
        share = np.arange(STEPS_OF_SPAN) / STEPS_OF_SPAN
        return np.append((spans[:-1, None] + share * np.diff(spans)[:, None]).ravel(), spans[-1])


def bulged(start: Array, end: Array, bulge: float) -> FlatCurve:
    """A line, or the arc that turns by four times the arc tangent of ``bulge``, to the left of travel if positive.

    Points are in [m], shape (2,), and differ.
    """
    if bulge == 0.0:
        return FlatLine(first=start, last=end)
    across = np.array([start[1] - end[1], end[0] - start[0]])
    centre = 0.5 * (start + end) + 0.25 * (1.0 / bulge - bulge) * across
    first = start - centre
    return FlatArc(
        centre=centre, first=first, second=np.array([-first[1], first[0]]), span=(0.0, 4.0 * float(np.arctan(bulge)))
    )


class Contour(NamedTuple):
    """Curves that follow one another."""

    curves: tuple[FlatCurve, ...]
    is_closed: bool

    @property
    def ends(self) -> Array:
        """Its start and its end in [m], shape (2, 2)."""
        return np.stack([self.curves[0].end(0), self.curves[-1].end(1)])

    def turned_back(self) -> "Contour":
        """The same contour from its end."""
        return Contour(tuple(curve.turned_back() for curve in reversed(self.curves)), self.is_closed)


class Branch(NamedTuple):
    """Places in their list of runs of curves that cannot be chained in one way only, and where in [m], shape (2,)."""

    runs: tuple[int, ...]
    point: Array


def chained(runs: Sequence[Sequence[FlatCurve]], join: float) -> list[Contour] | Branch:
    """Runs of curves joined where two ends are within a distance in [m], in the order of the first run of each contour.

    A contour goes the way of its first run.
    """
    contours = [Contour(tuple(run), is_closed=False) for run in runs]
    ends = np.stack([contour.ends for contour in contours])
    is_closed = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) <= join
    partners = _partners(ends, is_closed, join)
    if isinstance(partners, Branch):
        return partners
    chains, used = [], set()
    for first, contour in enumerate(contours):
        if first in used:
            continue
        after = list(_followed(2 * first + 1, partners))
        is_loop = bool(is_closed[first]) or (bool(after) and after[-1] == 2 * first)
        before = [] if is_loop else list(_followed(2 * first, partners))
        pieces = [contours[end // 2] if end % 2 == 0 else contours[end // 2].turned_back() for end in after]
        heads = [contours[end // 2] if end % 2 == 1 else contours[end // 2].turned_back() for end in reversed(before)]
        pieces = pieces[:-1] if after and is_loop else pieces
        used |= {first, *(end // 2 for end in (*after, *before))}
        chains.append(Contour(tuple(it for piece in (*heads, contour, *pieces) for it in piece.curves), is_loop))
    return chains


def begun_near(contour: Contour, point: Array) -> Contour:
    """A closed contour that begins where it is nearest to a point in [m], shape (2,)."""
    best = (np.inf, 0, 0.0)
    for place, curve in enumerate(contour.curves):
        t = curve.parameters(CHORD_OF_SEARCH)
        away = np.linalg.norm(curve.rates(t)[0] - point, axis=1)
        k = int(np.argmin(away))
        low, high = float(t[max(k - 1, 0)]), float(t[min(k + 1, len(t) - 1)])
        for _ in range(NEAREST_STEPS):
            thirds = np.array([low + (high - low) / 3.0, high - (high - low) / 3.0])
            near = np.linalg.norm(curve.rates(thirds)[0] - point, axis=1)
            low, high = (low, float(thirds[1])) if near[0] < near[1] else (float(thirds[0]), high)
        nearest = np.array([0.5 * (low + high), *curve.span])  # an end itself, where it is one
        distance = np.linalg.norm(curve.rates(nearest)[0] - point, axis=1) - np.array([0.0, SAME_PLACE, SAME_PLACE])
        best = min(best, (float(distance.min()), place, float(nearest[int(np.argmin(distance))])))
    _, k, t_start = best
    first, last = contour.curves[k].span
    head, tail = (replace(contour.curves[k], span=span) for span in ((t_start, last), (first, t_start)))
    halves = (*([head] if t_start != last else []), *contour.curves[k + 1 :], *contour.curves[:k])
    return contour._replace(curves=(*halves, *([tail] if t_start != first else [])))


def repeated(runs: Sequence[Sequence[FlatCurve]], join: float) -> tuple[int, int] | None:
    """Places of the first run of curves that lies on another one, and of that one; None where all differ."""
    seen: dict[tuple[int, ...], int] = {}
    size = SAME_SPOT * join
    for place, run in enumerate(runs):
        middle = run[len(run) // 2].rates(np.array([np.mean(run[len(run) // 2].span)]))[0][0]
        ends = sorted(tuple(np.rint(run[-k].end(k) / size).astype(int)) for k in (0, 1))
        key = (*ends[0], *ends[1], *np.rint(middle / size).astype(int), len(run))
        if key in seen:
            return place, seen[key]
        seen[key] = place
    return None


def _partners(ends: Array, is_closed: Array, join: float) -> dict[int, int] | Branch:
    """The end that each end of an open run meets: twice the place of its run, and one more at its end."""
    points, cells = ends.reshape(-1, 2), defaultdict[tuple[int, int], list[int]](list)
    open_ends = [end for end in range(len(points)) if not is_closed[end // 2]]
    grid = np.floor(points / join).astype(np.int64).tolist()
    for end in open_ends:
        cells[grid[end][0], grid[end][1]].append(end)
    partners: dict[int, int] = {}
    for end in open_ends:
        u, v = grid[end]
        near = [other for du, dv in product((-1, 0, 1), repeat=2) for other in cells.get((u + du, v + dv), ())]
        meets = [other for other in near if np.linalg.norm(points[other] - points[end]) <= join and other != end]
        if len(meets) > 1:
            return Branch(tuple(sorted({it // 2 for it in (end, *meets)})), points[end])
        if meets:
            partners[end] = meets[0]
    return partners


def _followed(end: int, partners: dict[int, int]) -> Iterator[int]:
    """Ends at which the runs behind an end are come to, one after the other, until a run leads nowhere or back."""
    first = end // 2
    while (end := partners.get(end, -1)) >= 0:
        yield end
        if end // 2 == first:
            return
        end ^= 1
