"""Arc length of a curve: how far the tool has gone at a parameter, and which parameter lies a given way along."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.polynomial import chebyshev, legendre

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import Curve, Interval

NODE_COUNT: Final = 12  # Gauss-Legendre nodes of a panel
PANEL_CHUNK: Final = 4096  # panels worked on at once: about 10 MB
RESOLVED_FRACTION: Final = 1e-12  # [-] a speed whose last Legendre coefficients are smaller than this share is resolved
NEGLIGIBLE_FRACTION: Final = 1e-14  # [-] of the whole length: less is rounding, whatever share of a panel it is
MAX_SPLITS: Final = 24  # halvings of a panel; only a cusp needs more
MAX_NEWTON_STEPS: Final = 60  # far more than Newton needs; a step that leaves its bracket halves it instead
MAX_QUICK_STEPS: Final = 8  # Newton steps without a bracket; speeds that are resolved on a panel hardly need five
PARAMETER_TOL: Final = 1e-13  # [-] of a panel from -1 to 1: a Newton step as small as this lands on the last digit


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ArcLength:
    """Length along a curve as one polynomial per panel."""

    edges: Array  # parameters between the panels, shape (K + 1,); every knot of the curve is one
    behind: Array  # length in [m] behind each edge, shape (K + 1,)
    series: Array  # Legendre coefficients of the length from a panel's start, over -1..1, shape (K, NODE_COUNT + 1)

    @property
    def total(self) -> float:
        """Length of the whole curve in [m]."""
        return float(self.behind[-1])

    def behind_knots(self, knots: Array) -> Array:
        """Length in [m] behind knots of the curve, shape (N,)."""
        return self.behind[np.searchsorted(self.edges, knots)]

    def lengths(self, u: Array) -> Array:
        """Length in [m] behind parameters of the curve, shape (N,)."""
        panel = np.clip(np.searchsorted(self.edges, u, side="right") - 1, 0, len(self.series) - 1)
        low, high = self.edges[panel], self.edges[panel + 1]
        x = np.clip(2.0 * (u - low) / (high - low) - 1.0, -1.0, 1.0)
        return self.behind[panel] + legendre.legval(x, self.series[panel].T, tensor=False)

    def parameters(self, length: Array, interval: Interval) -> Array:
        """Parameters at lengths in [m] from the start of the curve, kept within an interval between two knots.

        Newton's rule on a bracket: the length grows with the parameter, so the root of each panel is single.
        """
        first = np.searchsorted(self.edges, interval[0], side="left")
        last = np.searchsorted(self.edges, interval[1], side="left") - 1
        panel = np.clip(np.searchsorted(self.behind, length, side="right") - 1, first, last)
        desired = np.clip(length - self.behind[panel], 0.0, self.behind[panel + 1] - self.behind[panel])
        x = _invert(self.series[panel], desired)
        low, high = self.edges[panel], self.edges[panel + 1]
        return np.clip(low + 0.5 * (x + 1.0) * (high - low), interval[0], interval[1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class QuickParameters:
    """The inverse of a length for a few points at a time: a tenth of the calls that `ArcLength.parameters` makes.

    With ``x = cos(a)`` all Chebyshev polynomials are one array, ``cos(k a)``, from which length and speed follow.
    """

    arc: ArcLength  # the length
    # Chebyshev coefficients of the length from a panel's start and of its derivative, over -1..1, shape (K, NODE_COUNT
    # + 1, 2)
    series: Array

    def parameters(self, length: Array, interval: Interval) -> Array:
        """Parameters at lengths in [m], as `ArcLength.parameters` finds them but for rounding."""
        arc, degrees = self.arc, np.arange(NODE_COUNT + 1.0)
        first = np.searchsorted(arc.edges, interval[0], side="left")
        last = np.searchsorted(arc.edges, interval[1], side="left") - 1
        panel = np.clip(np.searchsorted(arc.behind, length, side="right") - 1, first, last)
        start, whole = arc.behind[panel], arc.behind[panel + 1] - arc.behind[panel]
        desired, series = np.clip(length - start, 0.0, whole), self.series[panel]
        x = np.clip(2.0 * desired / np.where(whole > 0.0, whole, 1.0) - 1.0, -1.0, 1.0)
        for _ in range(MAX_QUICK_STEPS):
            reached = (np.cos(np.arccos(x)[:, None] * degrees)[:, None, :] @ series)[:, 0]
            rate = reached[:, 1]
            step = (desired - reached[:, 0]) / np.where(rate > 0.0, rate, np.inf)
            following = np.clip(x + step, -1.0, 1.0)
            if np.all((np.abs(following - x) <= PARAMETER_TOL) & (rate > 0.0)):
                low, high = arc.edges[panel], arc.edges[panel + 1]
                return np.clip(low + 0.5 * (following + 1.0) * (high - low), interval[0], interval[1])
            x = following
        return arc.parameters(length, interval)


def quickly(arc: ArcLength) -> QuickParameters:
    """Prepare a length for being inverted often."""
    nodes = chebyshev.chebpts1(NODE_COUNT + 1)
    change = np.linalg.solve(chebyshev.chebvander(nodes, NODE_COUNT), legendre.legvander(nodes, NODE_COUNT))
    lengths = arc.series @ change.T
    rates = np.pad(chebyshev.chebder(lengths, axis=1), ((0, 0), (0, 1)))
    return QuickParameters(arc=arc, series=np.stack([lengths, rates], axis=2))


def measure(curve: Curve) -> ArcLength:
    """Measure a curve to about twelve digits: panels are halved until the speed is resolved on each."""
    edges = np.asarray(curve.knots, dtype=float)
    speed = _speed_series(curve, edges[:-1], edges[1:])
    for _ in range(MAX_SPLITS):
        rest, width = np.abs(speed[:, -2:]).max(axis=1), np.diff(edges)
        is_open = (rest > RESOLVED_FRACTION * speed[:, 0]) & (
            rest * width > NEGLIGIBLE_FRACTION * float(speed[:, 0] @ width)
        )
        if not np.any(is_open):
            break
        edges = _halve(edges, is_open)
        refined = np.repeat(speed, np.where(is_open, 2, 1), axis=0)
        is_new = np.repeat(is_open, np.where(is_open, 2, 1))
        refined[is_new] = _speed_series(curve, edges[:-1][is_new], edges[1:][is_new])
        speed = refined
    half_width = 0.5 * np.diff(edges)
    series = np.transpose(legendre.legint(speed.T, lbnd=-1.0)) * half_width[:, None]
    behind = np.concatenate([[0.0], np.cumsum(2.0 * half_width * speed[:, 0])])
    return ArcLength(edges=edges, behind=behind, series=series)


def _halve(edges: Array, chosen: Flags) -> Array:
    """Edges with the chosen panels cut in two; the old edges are kept to the last bit."""
    middle = 0.5 * (edges[:-1] + edges[1:])
    return np.insert(edges, np.flatnonzero(chosen) + 1, middle[chosen])


def _speed_series(curve: Curve, low: Array, high: Array) -> Array:
    """Legendre coefficients of the speed |dp/du| on each panel, shape (K, NODE_COUNT)."""
    nodes, weights = legendre.leggauss(NODE_COUNT)
    analysis = legendre.legvander(nodes, NODE_COUNT - 1) * weights[:, None] * (np.arange(NODE_COUNT) + 0.5)
    whole = (float(curve.knots[0]), float(curve.knots[-1]))
    coefficients = np.empty((len(low), NODE_COUNT))
    for first in range(0, len(low), PANEL_CHUNK):
        chosen = slice(first, first + PANEL_CHUNK)
        u = low[chosen, None] + 0.5 * (nodes + 1.0) * (high - low)[chosen, None]
        _, rate = curve.evaluate(u.ravel(), whole)
        coefficients[chosen] = np.linalg.norm(rate, axis=1).reshape(u.shape) @ analysis
    return coefficients


def _invert(series: Array, desired: Array) -> Array:
    """Root x in -1..1 of each Legendre series, shape (N, d), minus its desired value."""
    coefficients = np.ascontiguousarray(series.T)
    slope = legendre.legder(coefficients)
    low, high = -np.ones_like(desired), np.ones_like(desired)
    whole = np.sum(coefficients, axis=0)
    x = np.clip(2.0 * desired / np.where(whole > 0.0, whole, 1.0) - 1.0, -1.0, 1.0)
    for _ in range(MAX_NEWTON_STEPS):
        excess = legendre.legval(x, coefficients, tensor=False) - desired
        low, high = np.where(excess <= 0.0, x, low), np.where(excess >= 0.0, x, high)
        rate = legendre.legval(x, slope, tensor=False)
        step = x - excess / np.where(rate > 0.0, rate, 1.0)
        is_inside = (step >= low) & (step <= high) & (rate > 0.0)
        following = np.where(is_inside, step, 0.5 * (low + high))
        if np.all(np.abs(following - x) <= PARAMETER_TOL):
            return following
        x = following
    return x
