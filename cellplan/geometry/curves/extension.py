"""Extension: a curve that goes on beyond its ends, and an orientation that comes to rest there."""

from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.curves.orientation import Orientation
from cellplan.geometry.transforms import rotation_exp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tail:
    r"""Continuation of a curve beyond one of its ends: a quarter circle, then a tangent, both lifted smoothly.

    At a distance :math:`d` from the end, with the angle :math:`\varphi = \min(d / r, \pi / 2)` and what is left of the
    way behind the arc, :math:`e = d - r \varphi`:

    .. math:: p = p_0 \pm (r \sin\varphi \, t + e \cos\varphi \, t) + (r (1 - \cos\varphi) + e \sin\varphi) \, b
              + l \, h(d / L) \, n, \quad h(x) = 10 x^3 - 15 x^4 + 6 x^5

    Attributes:
        p: The end of the curve in [m], shape (3,).
        dp: Derivative of the curve by its parameter there, shape (3,); along it t.
        side: Unit direction b across it, to which the circle turns, shape (3,).
        normal: Unit direction n to which it is lifted, shape (3,).
        straight: Length of the tangent in [m].
        arc: Radius r of the circle in [m]; 0 for none.
        lift: Height l at the end of the tangent in [m].
        sign: 1.0 behind the last end of the curve, -1.0 before its first.
    """

    p: Array
    dp: Array
    side: Array
    normal: Array
    straight: float
    arc: float
    lift: float
    sign: float

    @property
    def speed(self) -> float:
        """Length of the derivative by the parameter, but for the lift."""
        return float(np.linalg.norm(self.dp))

    @property
    def length(self) -> float:
        """Its length L in [m], but for the lift."""
        return self.straight + 0.5 * np.pi * self.arc

    @property
    def knots(self) -> list[float]:
        """Parameters from the end of the curve at which it is joined, of which the last is its own end."""
        return [self.sign * d / self.speed for d in (0.5 * np.pi * self.arc, self.length)]

    def evaluate(self, u: Array) -> tuple[Array, Array]:
        """Points and derivatives at parameters from the end of the curve, shape (N,)."""
        d = (self.sign * self.speed * u)[:, None]
        angle = np.minimum(d / self.arc, 0.5 * np.pi) if self.arc else np.zeros_like(d)
        rest, sine, cosine = d - self.arc * angle, np.sin(angle), np.cos(angle)
        ahead = self.sign * self.dp / self.speed
        x = d / self.length
        height, slope = self.lift * x**3 * (10.0 - x * (15.0 - 6.0 * x)), 30.0 * self.lift * (x * (1.0 - x)) ** 2
        p = self.p + (self.arc * sine + rest * cosine) * ahead + height * self.normal
        p += (self.arc * (1.0 - cosine) + rest * sine) * self.side
        along = cosine * ahead + sine * self.side + slope / self.length * self.normal
        return p, self.sign * self.speed * along


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extension:
    """Parameters of a curve, and those of its tails before and behind it, which go on with the same speed."""

    knots: Array  # parameters at which the curve is joined, its ends included, shape (K,)
    tails: tuple[Tail, Tail]  # before the first of them and behind the last

    @property
    def before(self) -> float:
        """Length of the parameter before the curve."""
        return -self.tails[0].knots[-1]

    @property
    def behind(self) -> float:
        """Length of the parameter behind it."""
        return self.tails[1].knots[-1]

    @property
    def joints(self) -> Array:
        """Parameters at which the tails are joined, their ends included, increasing."""
        before, behind = (np.array(tail.knots) for tail in self.tails)
        return np.unique(np.concatenate([self.knots[0] + before, self.knots[-1] + behind]))

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
    """A curve with its tails; see `cellplan.geometry.curves.curve.Curve`."""

    curve: Curve
    extension: Extension

    @property
    def knots(self) -> Array:
        """Those of the curve and of the tails."""
        return np.union1d(self.extension.joints, self.curve.knots)

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives."""
        inside, within = self.extension.at(u, interval)
        p, dp = self.curve.evaluate(inside, within)
        for tail in self.extension.tails:
            off = tail.sign * (u - inside) > 0.0
            if np.any(off):
                p[off], dp[off] = tail.evaluate((u - inside)[off])
        return p, dp


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ExtendedFrame:
    r"""An orientation that turns on beyond its ends, more and more slowly; see `Orientation`.

    With its rate :math:`w` at an end, a tail of length :math:`L` and a distance :math:`d` along it, it is turned by
    :math:`w \, d \, (1 - |d| / 2 L)`: the rate is continuous, and zero at the end of the tail.
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
        ends = self.curve.evaluate(inside, within)
        at, rate = (np.where(distance != 0.0, end, here) for end, here in zip(ends, (p, dp), strict=True))
        R, w = self.frame.frames(inside, within, p=at, dp=rate)
        whole = np.where(distance < 0.0, extension.before, extension.behind)
        share = np.abs(distance) / np.where(whole > 0.0, whole, 1.0)
        return rotation_exp(w * distance * (1.0 - 0.5 * share)) @ R, w * (1.0 - share)
