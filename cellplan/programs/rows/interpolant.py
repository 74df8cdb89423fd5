r"""The interpolant of exported rows: cubic Hermite through the rows, with central differences as their velocities.

Between two rows, :math:`h` apart, with :math:`u` from 0 to 1,

.. math:: q(u) = q_0 + u (q_1 - q_0) + h\, u (1 - u) \bigl[ (1 - u)(v_0 - s) - u (v_1 - s) \bigr],
          \quad s = (q_1 - q_0) / h .

The second term is the deviation from the chord. The second derivative is linear between two rows, so the largest one is
at a row.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices

MONOTONE: Final = 3.0  # [-] a cubic between two rows whose speeds are at most this times that of the chord is monotone
ROUNDS: Final = 50  # [-] passes over rows whose curve leaves a limit; each speed is lowered in few of them


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HermiteRows:
    """Rows with speeds, and the curve through them; it rests before the first and after the last row."""

    times: Array  # times of the rows in [s], increasing, shape (N,), N at least 2
    q: Array  # positions in [rad] or [m], shape (N, n)
    qd: Array  # speeds in [rad/s] or [m/s], shape (N, n)

    def at(self, times: Array) -> Array:
        """Positions at times in [s], shape (M,), shape (M, n)."""
        k, u = self._places(times)
        h, chord = self._steps[k], np.diff(self.q, axis=0)[k]
        first, last = h * self.qd[k] - chord, h * self.qd[k + 1] - chord
        return self.q[k] + u * chord + u * (1.0 - u) * ((1.0 - u) * first - u * last)

    def largest_accelerations(self) -> Array:
        """Largest second derivative between two rows in [rad/s^2] or [m/s^2], without its sign, shape (N - 1, n)."""
        s = np.diff(self.q, axis=0) / self._steps
        begin = np.abs(6.0 * s - 4.0 * self.qd[:-1] - 2.0 * self.qd[1:])
        end = np.abs(6.0 * s - 2.0 * self.qd[:-1] - 4.0 * self.qd[1:])
        return np.maximum(begin, end) / self._steps

    def extremes(self) -> tuple[Array, Array]:
        """Smallest and largest position between two rows, both included, shape (N - 1, n) each."""
        chord = np.diff(self.q, axis=0)
        a, b = self._steps * self.qd[:-1], self._steps * self.qd[1:]
        cubic, square = a + b - 2.0 * chord, 3.0 * chord - 2.0 * a - b  # q = q0 + a u + square u^2 + cubic u^3
        low, high = np.minimum(self.q[:-1], self.q[1:]), np.maximum(self.q[:-1], self.q[1:])
        root = np.sqrt(np.maximum(square**2 - 3.0 * cubic * a, 0.0))
        for sign in (-1.0, 1.0):
            below = square + sign * root  # the form of the quadratic formula that bears a cubic term near zero
            u = np.clip(np.where(below != 0.0, -a / np.where(below != 0.0, below, 1.0), 0.0), 0.0, 1.0)
            value = self.q[:-1] + u * (a + u * (square + u * cubic))
            low, high = np.minimum(low, value), np.maximum(high, value)
        return low, high

    @property
    def _steps(self) -> Array:
        """Times between rows, shape (N - 1, 1)."""
        return np.diff(self.times)[:, None]

    def _places(self, times: Array) -> tuple[Indices, Array]:
        """The row before each time, and the share of the step, shape (M, 1)."""
        k = np.clip(np.searchsorted(self.times, times, side="right") - 1, 0, len(self.times) - 2)
        u = np.clip((times - self.times[k]) / np.diff(self.times)[k], 0.0, 1.0)
        return k, u[:, None]


def resting(q: Array) -> Flags:
    """Rows at which a robot rests: the ends, and both rows of every step in which no joint moves, shape (N,)."""
    still = np.all(np.diff(q, axis=0) == 0.0, axis=1)
    rests = np.zeros(len(q), dtype=bool)
    rests[[0, -1]] = True
    rests[:-1] |= still
    rests[1:] |= still
    return rests


def row_velocities(times: Array, q: Array, *, rests: Flags, lower: Array, upper: Array) -> Array:
    """Velocities of rows: central differences, zero at rests, and such that no curve between rows leaves the limits.

    The central difference of uneven rows is the derivative of the parabola through three of them. Where the curve
    would pass a limit between two rows that keep it, the speeds at both are lowered until it is monotone there.

    Times are in [s], shape (N,), N at least 2; positions in [rad] or [m], shape (N, n); limits have the shape (n,).
    """
    h = np.diff(times)[:, None]
    s = np.diff(q, axis=0) / h
    qd = np.zeros_like(q)
    qd[1:-1] = (h[:-1] * s[1:] + h[1:] * s[:-1]) / (h[:-1] + h[1:])
    qd[rests] = 0.0
    for _ in range(ROUNDS):
        low, high = HermiteRows(times=times, q=q, qd=qd).extremes()
        ends = np.minimum(q[:-1], q[1:]), np.maximum(q[:-1], q[1:])
        beyond = (low < np.minimum(lower, ends[0])) | (high > np.maximum(upper, ends[1]))
        steep = beyond & ~(_is_monotone(qd[:-1], s) & _is_monotone(qd[1:], s))
        if not np.any(steep):
            break
        for rows in (slice(None, -1), slice(1, None)):
            limited = np.sign(s) * np.clip(np.sign(s) * qd[rows], 0.0, MONOTONE * np.abs(s))
            qd[rows] = np.where(steep, limited, qd[rows])
    return qd


def _is_monotone(qd: Array, s: Array) -> Flags:
    """Whether speeds lie between zero and three times those of chords."""
    return (qd * s >= 0.0) & (np.abs(qd) <= MONOTONE * np.abs(s))
