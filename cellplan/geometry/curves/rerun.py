"""Rerun: stretches of a curve, one after the other, forwards or backwards, with the orientation along them."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.curves.curve import Curve, Interval, spans_at
from cellplan.geometry.curves.orientation import Orientation
from cellplan.geometry.curves.seam_line import SeamLine, SeamPlaces


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rerun:
    """Parameters of a curve at which stretches begin and end, shape (K,) each; the new parameter begins at zero."""

    starts: Array
    ends: Array

    @property
    def edges(self) -> Array:
        """New parameters between the stretches, and at both ends, shape (K + 1,)."""
        return np.append(0.0, np.cumsum(np.abs(self.ends - self.starts)))

    @property
    def signs(self) -> Array:
        """1 for a stretch that runs forwards, -1 for one that runs backwards, shape (K,)."""
        return np.sign(self.ends - self.starts)

    def knots(self, old: Array) -> Array:
        """New parameters of knots, shape (M,), of all stretches that they lie in, shape (N,)."""
        edges = self.edges
        new = [
            edge + np.abs(old[(old > min(start, end)) & (old < max(start, end))] - start)
            for edge, start, end in zip(edges[:-1], self.starts.tolist(), self.ends.tolist(), strict=True)
        ]
        return np.unique(np.concatenate(new)) if new else np.zeros(0)

    def at(self, v: Array, interval: Interval) -> tuple[Array, Interval, Array]:
        """Old parameters of new ones, shape (N,), old intervals, and the signs of the stretches, shape (N, 1)."""
        edges = self.edges
        k = spans_at(edges, v, interval)
        ends = [self._old(np.clip(side, edges[k], edges[k + 1]), k) for side in interval]
        return self._old(v, k), (np.minimum(*ends), np.maximum(*ends)), self.signs[k, None]

    def _old(self, v: Array, k: Indices) -> Array:
        """Old parameters of new ones within stretches."""
        return self.starts[k] + self.signs[k] * (v - self.edges[k])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RerunCurve:
    """Stretches of a curve; see `cellplan.geometry.curves.curve.Curve`."""

    curve: Curve
    rerun: Rerun

    @property
    def knots(self) -> Array:
        """Those of the curve in its stretches, and the edges between these."""
        return np.union1d(self.rerun.edges, self.rerun.knots(self.curve.knots))

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives."""
        old, within, sign = self.rerun.at(u, interval)
        p, dp = self.curve.evaluate(old, within)
        return p, sign * dp


class OtherParameter(Protocol):
    """A way from new parameters of a curve to its own."""

    def at(self, v: Array, interval: Interval) -> tuple[Array, Interval, Array]:
        """Old parameters of new ones, shape (N,), old intervals, and the rates of the old ones, shape (N, 1)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RerunSeam:
    """A seam along stretches of its curve, with its own direction; see `SeamPlaces`."""

    seam: SeamPlaces
    rerun: OtherParameter

    def line(self, u: Array, interval: Interval) -> SeamLine:
        """The seam at new parameters."""
        old, within, _ = self.rerun.at(u, interval)
        return self.seam.line(old, within)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RerunFrame:
    """Another orientation along stretches of its curve; see `cellplan.geometry.curves.orientation.Orientation`."""

    frame: Orientation
    rerun: Rerun

    @property
    def knots(self) -> Array:
        """Those of the other one in its stretches."""
        return self.rerun.knots(self.frame.knots)

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:
        """Tool frames and their turning rate."""
        old, within, sign = self.rerun.at(u, interval)
        R, w = self.frame.frames(old, within, p=p, dp=sign * dp)
        return R, sign * w
