r"""Blended lines: straight moves through via points, with corners rounded off so that accelerations are continuous.

A robot passes its via points :math:`q_k` at nominal times :math:`t_k`, standing before the first and after the last.
In between its speed is constant, and it changes from :math:`v_-` to :math:`v_+` round each via point over
:math:`t_k \pm \tau_k`, with :math:`u = (t - t_k) / \tau_k`,

.. math:: \dot q = v_- + (v_+ - v_-) \, S(u), \quad S(u) = \tfrac12 + \tfrac34 u - \tfrac14 u^3

As S rises from 0 to 1 with slopes of zero and a mean of one half, positions, speeds and accelerations are continuous,
the line is met again at :math:`t_k + \tau_k`, and what is rounded stays within the triangle that it cuts off.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.curves.chebyshev import chebyshev
from cellplan.geometry.transforms import Array
from cellplan.model.motion.joint_path import JointPath

DEGREE: Final = 4  # [-] of the polynomials
SAME_TIME: Final = 1e-9  # [s] breaks that differ by less are one


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BlendedLine:
    """Motion of one robot."""

    columns: slice  # its columns in the stacked joint vector
    times: Array  # nominal times of its via points in [s], increasing, shape (K,), K at least 2
    q: Array  # the via points in [rad] or [m], shape (K, n)
    halves: Array  # half of the time over which the speed changes at each, in [s], shape (K,)

    @classmethod
    def through(cls, columns: slice, times: Array, q: Array, *, shares: Array | float = 1.0) -> "BlendedLine":
        """Round the corners by a share of what their neighbours allow, 0 < share <= 1, one number or shape (K,)."""
        steps = np.diff(times)
        nearest = np.minimum(np.append(np.inf, steps), np.append(steps, np.inf))
        return cls(columns=columns, times=times, q=q, halves=0.5 * shares * nearest)

    @property
    def begin(self) -> float:
        """Nominal time in [s] at which it leaves its rest."""
        return float(self.times[0] - self.halves[0])

    @property
    def end(self) -> float:
        """Nominal time in [s] at which it has come to rest."""
        return float(self.times[-1] + self.halves[-1])

    def shifted(self, by: float) -> "BlendedLine":
        """The same motion so many seconds later."""
        return BlendedLine(columns=self.columns, times=self.times + by, q=self.q, halves=self.halves)

    def at(self, times: Array) -> Array:
        """Positions at nominal times in [s], shape (N, n)."""
        positions = np.column_stack([np.interp(times, self.times, column) for column in self.q.T])
        velocities = np.diff(self.q, axis=0) / np.diff(self.times)[:, None]
        rest = np.zeros((1, self.q.shape[1]))
        changes = np.diff(np.concatenate([rest, velocities, rest]), axis=0)
        for middle, half, change in zip(self.times, self.halves, changes, strict=True):
            u = np.clip((times - middle) / half, -1.0, 1.0)
            cut = u * (0.5 + u * (0.375 - 0.0625 * u * u)) + 0.1875 - np.maximum(u, 0.0)
            positions += (half * cut)[:, None] * change
        positions[times <= self.begin], positions[times >= self.end] = self.q[0], self.q[-1]
        return positions


def joint_path(start: Array, lines: Sequence[BlendedLine]) -> JointPath:
    """The stacked path of robots that move along blended lines while all others stand.

    A robot may have several lines, one after the other in time.

    Args:
        start: Stacked joint vector at the beginning, shape (nq,).
        lines: The lines, those of one robot in their order; at least one.
    """
    edges = [edge for line in lines for edge in (*(line.times - line.halves), *(line.times + line.halves))]
    first = min(line.begin for line in lines)
    breaks = np.unique(np.array(edges) - first)
    breaks = breaks[np.append(True, np.diff(breaks) > SAME_TIME)]
    inner = breaks[:-1, None] + np.diff(breaks)[:, None] * chebyshev(DEGREE).nodes
    inner[:, -1] = breaks[1:]
    times = inner.ravel()
    q = np.tile(start, (len(times), 1))
    for line in lines:
        shifted = line.shifted(-first)
        begun = times > shifted.begin
        q[begun, line.columns] = shifted.at(times[begun])
    nodes = q.reshape(*inner.shape, -1)
    nodes[1:, 0] = nodes[:-1, -1]
    return JointPath(start, breaks, list(np.swapaxes(nodes, 1, 2)))
