"""Extension: a curve that goes on straight beyond its ends, and an orientation that comes to rest there."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.curves.orientation import Orientation
from cellplan.geometry.transforms import rotation_exp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extension:
    """Parameters of a curve, and those of its tangents before and behind it, which go on with the same speed."""

    knots: Array  # parameters at which the curve is joined, its ends included, shape (K,)
    before: float  # length of the parameter before the first of them
    behind: float  # length of the parameter behind the last

    @property
    def ends(self) -> Array:
        """First and last parameter, shape (2,)."""
        return np.array([self.knots[0] - self.before, self.knots[-1] + self.behind])

    def at(self, u: Array, interval: Interval) -> tuple[Array, Interval]:
        """Parameters kept within the curve, and intervals within it that end there, for parameters of shape (N,)."""
        low, high = (np.clip(np.broadcast_to(side, u.shape), self.knots[0], self.knots[-1]) for side in interval)
        return np.clip(u, low, high), (np.minimum(low, self.knots[-2]), np.maximum(high, self.knots[1]))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtendedCurve:
    """A curve with its tangents; see `cellplan.geometry.curves.curve.Curve`."""

    curve: Curve
    extension: Extension

    @property
    def knots(self) -> Array:
        """Those of the curve, and the ends of the tangents."""
        return np.union1d(self.extension.ends, self.curve.knots)

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives."""
        inside, within = self.extension.at(u, interval)
        p, dp = self.curve.evaluate(inside, within)
        return p + (u - inside)[:, None] * dp, dp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtendedFrame:
    r"""An orientation that turns on beyond its ends, more and more slowly; see `Orientation`.

    With its rate :math:`w` at an end, a tangent of length :math:`L` and a distance :math:`d` along it, it is turned by
    :math:`w \, d \, (1 - |d| / 2 L)`: the rate is continuous, and zero at the end of the tangent.
    """

    frame: Orientation
    curve: Curve  # the curve that is extended
    extension: Extension

    @property
    def knots(self) -> Array:
        """Those of the orientation."""
        return self.frame.knots

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:
        """Tool frames and their turning rate."""
        inside, within = self.extension.at(u, interval)
        distance, extension = (u - inside)[:, None], self.extension
        at = np.where(distance != 0.0, self.curve.evaluate(inside, within)[0], p)
        R, w = self.frame.frames(inside, within, p=at, dp=dp)
        whole = np.where(distance < 0.0, extension.before, extension.behind)
        share = np.abs(distance) / np.where(whole > 0.0, whole, 1.0)
        return rotation_exp(w * distance * (1.0 - 0.5 * share)) @ R, w * (1.0 - share)
