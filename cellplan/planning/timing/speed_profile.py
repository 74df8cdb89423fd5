r"""Fastest speed along a path: the largest that velocities and accelerations of all joints allow.

With the length p of the path, the squared speed :math:`x = \dot p^2` and :math:`u = \ddot p`, a joint has the
acceleration :math:`q' u + q'' x` and the torque :math:`a u + b x + c` (Bobrow, Dubowsky and Gibson 1985); over an
interval in which u is constant, x is linear in p. Backwards from rest: the
largest x from which some u keeps all limits at both ends of the interval and reaches what can be brought to rest
behind it. Forwards from rest: the largest u that stays below. At every x the limits leave u between the highest of many
lower lines and the lowest of many upper ones; the distance of the two is concave in x, so Newton's method from the
right finds the largest x at which it is not negative in a few steps, exactly.
"""

from dataclasses import dataclass
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices

LEAST: Final = 1e-12  # [-] share of the acceleration limit by which the speeding up of the path counts
MOST_STEPS: Final = 60  # [-] of Newton's method: as many lines are crossed at most
ROUNDING: Final = 1e-13  # [-] of a bound on the acceleration


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpeedProfile:
    """Motion along a path, with constant acceleration of the path between neighbouring lengths."""

    lengths: Array  # lengths of path, increasing from 0, shape (N,)
    speeds: Array  # speed of the path there, shape (N,), 0 at both ends
    times: Array  # times in [s] at which they are passed, shape (N,), from 0

    @property
    def duration(self) -> float:
        """Time from rest to rest in [s]."""
        return float(self.times[-1])

    def at(self, times: Array, window: float = 0.0) -> Array:
        """Lengths at times in [s], shape (M,); with a window, means of the speed over that time.

        Args:
            times: From 0 to the duration and the window.
            window: In [s] over which the speed is averaged: the motion takes so much longer, and what jumped before
                changes evenly over the window.
        """
        if window > 0.0:
            return (self._area(times) - self._area(times - window)) / window
        k, elapsed = self._place(times)
        return self.lengths[k] + elapsed * (self.speeds[k] + 0.5 * elapsed * self._accelerations[k])

    @property
    def _accelerations(self) -> Array:
        """Acceleration of the path between its lengths, shape (N - 1,)."""
        return np.diff(self.speeds) / np.diff(self.times)

    def _place(self, times: Array) -> tuple[Indices, Array]:
        """Interval of each time, and the time since its beginning."""
        inside = np.clip(times, 0.0, self.duration)
        k = np.clip(np.searchsorted(self.times, inside, side="right") - 1, 0, len(self.times) - 2)
        return k, inside - self.times[k]

    def _area(self, times: Array) -> Array:
        """Integral of the length over time from the start on; before it the length is 0, after the end the whole."""
        step, u = np.diff(self.times), self._accelerations
        whole = step * (self.lengths[:-1] + step * (0.5 * self.speeds[:-1] + step * u / 6.0))
        begin = np.append(0.0, np.cumsum(whole))
        k, elapsed = self._place(times)
        part = elapsed * (self.lengths[k] + elapsed * (0.5 * self.speeds[k] + elapsed * u[k] / 6.0))
        after: Array = np.maximum(times - self.duration, 0.0) * self.lengths[-1]
        return begin[k] + part + after


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Lines:
    """Bounds on u, by interval: ``-bottom - slope x <= u <= top - slope x``, shape (N - 1, L) each."""

    top: Array
    bottom: Array
    slope: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathLoads:
    """Loads along a path that are limited: ``-bottom <= along u + bent x <= top``, shape (N, m) each."""

    along: Array  # by the acceleration of the path
    bent: Array  # by its squared speed
    top: Array  # positive
    bottom: Array  # likewise

    @classmethod
    def in_shares(cls, along: Array, bent: Array) -> Self:
        """Loads in shares of limits that are alike in both directions."""
        ones = np.ones_like(along)
        return cls(along=along, bent=bent, top=ones, bottom=ones)

    def joined(self, other: Self) -> Self:
        """These and others along the same path."""
        fields = ("along", "bent", "top", "bottom")
        return type(self)(**{it: np.concatenate([getattr(self, it), getattr(other, it)], axis=1) for it in fields})


def fastest_profile(
    lengths: Array,
    directions: Array,
    *,
    velocity: Array,
    acceleration: Array,
    highest: Array,
    further: PathLoads | None = None,
) -> SpeedProfile:
    """The fastest motion along a path from rest to rest.

    Args:
        lengths: Lengths of path, increasing from 0, shape (N,).
        directions: Derivatives of the joints by the length, shape (N, nq).
        velocity: Largest speeds of the joints, positive, shape (nq,).
        acceleration: Largest accelerations of the joints, positive; infinite for a joint without limit, shape (nq,).
        highest: Largest speeds of the path itself, shape (N,); infinite where there is no such limit.
        further: Limited loads beside the accelerations, such as torques; None without any.
    """
    with np.errstate(divide="ignore"):
        allowed = np.minimum(highest, (velocity / np.abs(directions)).min(axis=1)) ** 2
    limited = np.isfinite(acceleration)
    step = np.diff(lengths)
    if limited.any() or further is not None:
        along = directions[:, limited] / acceleration[limited]
        loads = PathLoads.in_shares(along, np.gradient(along, lengths, axis=0))
        squared = largest_squares(step, loads if further is None else loads.joined(further), allowed)
    else:
        squared = allowed.copy()
        squared[[0, -1]] = 0.0
    speeds = np.sqrt(squared)
    times = np.append(0.0, np.cumsum(2.0 * step / (speeds[:-1] + speeds[1:])))
    return SpeedProfile(lengths=lengths, speeds=speeds, times=times)


def largest_squares(step: Array, loads: PathLoads, allowed: Array) -> Array:
    """Largest squared speeds along a path from rest to rest, shape (N,).

    Args:
        step: Lengths between neighbouring points of the path, positive, shape (N - 1,).
        loads: Limited loads, those of a joint's acceleration in shares of its limit.
        allowed: Largest squared speeds for other reasons, shape (N,).
    """
    lines = _lines(loads, step)
    return _forward(lines, step, _backward(lines, step, allowed))


def _lines(loads: PathLoads, step: Array) -> _Lines:
    """Limits at both ends of every interval of some width; at the later end the squared speed is ``x + 2 step u``."""
    along, bent = loads.along, loads.bent
    factor_u = np.concatenate([along[:-1], along[1:] + 2.0 * step[:, None] * bent[1:]], axis=1)
    factor_x = np.concatenate([bent[:-1], bent[1:]], axis=1)
    top, bottom = (np.concatenate([it[:-1], it[1:]], axis=1) for it in (loads.top, loads.bottom))
    size, is_back = np.maximum(np.abs(factor_u), LEAST), factor_u < 0.0
    return _Lines(
        top=np.where(is_back, bottom, top) / size,
        bottom=np.where(is_back, top, bottom) / size,
        slope=np.where(is_back, -factor_x, factor_x) / size,
    )


def _backward(lines: _Lines, step: Array, allowed: Array) -> Array:
    """Largest squared speeds from which the path can be brought to rest at its end, shape (N,)."""
    reach = np.empty_like(allowed)
    reach[-1] = 0.0
    for i in range(len(step) - 1, -1, -1):
        top, bottom, slope, per_u = lines.top[i], lines.bottom[i], lines.slope[i], 0.5 / step[i]
        target = reach[i + 1]
        x = min(allowed[i], target)  # a first step from the left never ends left of the largest
        for number in range(MOST_STEPS):
            bend = slope * x
            up, low = int((top - bend).argmin()), int((bottom + bend).argmin())
            ceiling, ceiling_slope = top[up] - bend[up], -slope[up]
            floor, floor_slope = -bottom[low] - bend[low], -slope[low]
            if (target - x) * per_u < ceiling:
                ceiling, ceiling_slope = (target - x) * per_u, -per_u
            if -x * per_u > floor:
                floor, floor_slope = -x * per_u, -per_u
            gap, fall = ceiling - floor, ceiling_slope - floor_slope
            is_feasible = gap >= -ROUNDING * (abs(ceiling) + abs(floor))
            if is_feasible and (number > 0 or x >= allowed[i]):
                break
            x = max(0.0, min(allowed[i], x - gap / fall)) if fall < 0.0 else allowed[i]
        reach[i] = x
    reach[0] = 0.0
    return reach


def _forward(lines: _Lines, step: Array, reach: Array) -> Array:
    """Largest squared speeds that are reached from rest and stay within those that can be brought to rest."""
    squared = np.zeros_like(reach)
    for i in range(len(step)):
        x = squared[i]
        u = min(float((lines.top[i] - lines.slope[i] * x).min()), float((reach[i + 1] - x) / (2.0 * step[i])))
        squared[i + 1] = max(0.0, x + 2.0 * step[i] * u)
    squared[-1] = 0.0
    return squared
