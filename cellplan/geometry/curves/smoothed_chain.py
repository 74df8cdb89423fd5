"""Points and axes along a path, smoothed within a tube that the curve through them stays in as well."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.cache import keep, key_of, recall
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import smooth_through
from cellplan.geometry.curves.smoothing import Differences, Tube, smoothest

PROBES: Final = 17  # places of each span at which a curve is held against the given one
MORES: Final = 1.5 * 1.25 ** np.arange(10.0)  # [-] of what is too much between points, by which rounds narrow the tube
LESS: Final = 1e-3  # [-] of the radius, besides; a depth beyond its limit by less is rounding
FASTEST: Final = 0.95  # [-] of a radius to which one round brings it, where the points do not use it


class SmoothedValues(NamedTuple):
    """Smoothed points or axes with their roughness, in their unit by the square of that of the knots."""

    values: Array  # shape (N, 3)
    given: float  # roughness of the given ones
    smoothed: float  # roughness of these
    bound: float  # nothing within the tube has less


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chain:
    """Places along a path at which points or axes are listed, some of which stay.

    Attributes:
        knots: Increasing parameters, shape (N,), of a closed chain with that of the return to its start.
        kinks: Points at which the direction may change at once, shape (N,), of a closed chain without the return.
        fixed: Points that stay, shape (N,).
        is_closed: Whether the last point is joined to the first.
        is_curved: Whether a smooth curve joins the points; else straight sides do.
    """

    knots: Array
    kinks: Flags
    fixed: Flags
    is_closed: bool
    is_curved: bool

    def with_points(self, points: Array, normals: Array | None, *, radius: float, into: float) -> SmoothedValues:
        """Points within a radius in [m] of given ones, shape (N, 3), and within ``into`` along unit normals."""
        inputs = points, np.zeros(0) if normals is None else normals, np.array([radius, into])
        return self._remembered(inputs, lambda: self._with_points(points, normals, radius, into))

    def with_axes(self, axes: Array, *, angle: float) -> SmoothedValues:
        """Unit axes within an angle in [rad] of given ones, shape (N, 3)."""
        return self._remembered((axes, np.array([angle])), lambda: self._with_axes(axes, angle))

    def _remembered(self, inputs: tuple[Array, ...], make: Callable[[], tuple[Array, float]]) -> SmoothedValues:
        """What is made of some inputs, kept by their content; the inputs begin with the given values."""
        flags = np.array([self.is_closed, self.is_curved])
        contents = (self.knots, self.kinks, self.fixed, flags, *inputs)
        key = key_of("smoothed", *(np.ascontiguousarray(it).tobytes() for it in contents))
        if (known := recall(key)) is None:
            values, least = make()
            known = values, np.array(least)
            keep(key, known)
        values, roughness = np.array(known[0], dtype=float), self._differences.roughness
        smoothed = roughness(values)
        return SmoothedValues(values, roughness(inputs[0]), smoothed, min(float(known[1]), smoothed))

    def _with_points(self, points: Array, normals: Array | None, radius: float, into: float) -> tuple[Array, float]:
        """Points, and the least roughness in the tube."""
        directions = np.zeros_like(points) if normals is None else normals
        within, depth = np.full(len(points), radius), np.full(len(points), into)
        bounds, differences = [], self._differences
        for more in MORES:
            tube = Tube.of_positions(normals, within, into=depth)
            values, bound = smoothest(points, differences, tube, fixed=self.fixed)
            bounds.append(bound)
            off, between = values - points, self._between(values - points)
            far = self._about(np.linalg.norm(between, axis=1))
            deep = self._about(np.sum(between * self._between(directions), axis=1))
            if far.max() <= radius and deep.max() <= into + LESS * radius:
                return values, bounds[0]
            within = _narrower(within, np.linalg.norm(off, axis=1), far, limit=radius, more=more)
            past = np.where(deep > into, more * (deep - into) + LESS * radius, 0.0)
            depth = np.maximum(depth - past, -0.5 * within)
        share = min(1.0, radius / far.max(), (into + LESS * radius) / max(deep.max(), LESS * radius))
        return points + share * off, bounds[0]

    def _with_axes(self, axes: Array, angle: float) -> tuple[Array, float]:
        """Axes, and the least roughness in the tube."""
        within, bounds, differences = np.full(len(axes), angle), [], self._differences
        for more in MORES:
            values, bound = smoothest(axes, differences, Tube.of_axes(axes, within), fixed=self.fixed)
            bounds.append(bound)
            values = np.where(self.fixed[:, None], axes, unit(values))
            turned = self._about(angles_between(unit(self._between(values)), unit(self._between(axes))))
            if turned.max() <= angle:
                break
            within = _narrower(within, angles_between(values, axes), turned, limit=angle, more=more)
        return values, bounds[0]

    @property
    def _differences(self) -> Differences:
        return Differences(self.knots, kinks=self.kinks, is_closed=self.is_closed)

    def _between(self, values: Array) -> Array:
        """Values at the points and, where a smooth curve joins them, between them, shape (M, 3)."""
        if not self.is_curved:
            return values
        values = np.vstack([values, values[:1]]) if self.is_closed else values
        breaks = np.zeros(len(values), dtype=bool)
        breaks[[0, -1]] = not self.is_closed
        share = np.linspace(0.0, 1.0, PROBES)[:-1]
        u = np.append((self.knots[:-1, None] + share * np.diff(self.knots)[:, None]).ravel(), self.knots[-1])
        curve = smooth_through(self.knots, values, breaks=breaks)
        return curve.evaluate(u, (float(self.knots[0]), float(self.knots[-1])))[0]

    def _about(self, between: Array) -> Array:
        """The largest value on the spans that bend with each point, two before and two behind it, shape (N,)."""
        if not self.is_curved:
            return between
        spans = np.maximum(between[:-1].reshape(-1, PROBES - 1).max(axis=1), between[PROBES - 1 :: PROBES - 1])
        spans = spans if self.is_closed else np.append(spans, np.full(3, -np.inf))
        return np.max([np.roll(spans, by) for by in (-1, 0, 1, 2)], axis=0)[: len(self.fixed)]


def _narrower(within: Array, reached: Array, between: Array, *, limit: float, more: float) -> Array:
    """Radii of the tube at the points, less where the curve leaves it between them, shape (N,) each."""
    share = (1.0 - LESS) * (limit / np.maximum(between, limit)) ** more
    return np.where(between > limit, share * np.minimum(within, np.maximum(reached, FASTEST * within)), within)


def unit(vectors: Array) -> Array:
    """Vectors of length one along others, shape (N, 3)."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def angles_between(a: Array, b: Array) -> Array:
    """Angles in [rad] between unit vectors, shape (N,), from their chords."""
    return 2.0 * np.arcsin(np.minimum(1.0, 0.5 * np.linalg.norm(a - b, axis=1)))
