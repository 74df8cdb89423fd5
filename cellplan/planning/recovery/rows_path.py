"""Rows path: a smooth path through rows, taken from rest to rest as fast as the limits of all joints allow."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.timing.retime import Retimer
from cellplan.planning.transfer.straight_time import box_widths, shares

NEAR: Final = 1.02  # [-] factor of time up to which the law is slowed as a whole; above, its top speed is lowered
TRIES: Final = 60  # [-] until every limit holds in the rows
MOST_RAMP: Final = 1.5  # [-] factor above which the ramps of a law are made longer too, by so much at most
RAMP: Final = 0.1  # [s] least time in which the speed of a path that is known with its times is reached


@dataclass(frozen=True, slots=True, eq=False)
class RowsPath:
    """Cubic pieces through rows, with slopes by central differences."""

    sigma: Array  # increasing path parameter of each row, shape (N,), N at least 2
    q: Array  # joint positions in [rad] or [m], shape (N, nq)

    def at(self, sigma: Array) -> Array:
        """Joint positions at path parameters, shape (M, nq)."""
        if len(self.sigma) == 2:
            share = (sigma - self.sigma[0]) / (self.sigma[1] - self.sigma[0])
            return self.q[0] + share[:, None] * (self.q[1] - self.q[0])
        slopes = np.gradient(self.q, self.sigma, axis=0)
        k = np.clip(np.searchsorted(self.sigma, sigma, side="right") - 1, 0, len(self.sigma) - 2)
        step = (self.sigma[k + 1] - self.sigma[k])[:, None]
        u = (sigma - self.sigma[k])[:, None] / step
        rise = u * u * (3.0 - 2.0 * u)
        bend = u * (1.0 - u)
        change = (self.q[k + 1] - self.q[k]) * rise
        return self.q[k] + change + step * bend * ((1.0 - u) * slopes[k] - u * slopes[k + 1])


def rows_along(path: RowsPath, retimer: Retimer, *, widths: tuple[float, float, float]) -> Array:
    """Rows of a motion from rest to rest along a path, shape (K, nq); its ends are exact.

    Args:
        widths: Times in [s] of the law to begin with: see ``planning.transfer.straight_time``.
    """
    count = max(2, int(np.ceil(sum(widths) / retimer.step)))
    q = path.q[[0, -1]]
    for _ in range(TRIES):
        share = shares(np.arange(count + 1) / count, widths)
        sigma = path.sigma[0] + share * (path.sigma[-1] - path.sigma[0])
        q = path.at(sigma)
        q[0], q[-1] = path.q[0], path.q[-1]
        factor = retimer.slower(sigma, q)
        if factor <= 1.0:
            break
        if factor > NEAR:
            ramp = min(factor, MOST_RAMP)
            second, third = (width * ramp if factor > MOST_RAMP else width for width in widths[1:])
            widths = max(widths[0] * factor, second + third), second, third
            factor = sum(widths) / (count * retimer.step)
        count = max(count + 1, int(np.ceil(count * factor)))
    return q


def retract_rows(path: RowsPath, retimer: Retimer) -> Array:
    """Rows along a short path whose parameter is a length, shape (K, nq)."""
    farthest = np.abs(np.gradient(path.q, path.sigma, axis=0)).max(axis=0) * (path.sigma[-1] - path.sigma[0])
    first, second, third = box_widths(farthest, retimer.bounds, least=retimer.step).tolist()
    return rows_along(path, retimer, widths=(first, second, third))


def timed_rows(path: RowsPath, retimer: Retimer) -> Array:
    """Rows along a path that was already travelled, whose parameter is the time in [s], shape (K, nq)."""
    seconds = float(path.sigma[-1] - path.sigma[0])
    ramp = max(retimer.step, min(RAMP, 0.25 * seconds))
    return rows_along(path, retimer, widths=(max(seconds, 2.0 * ramp), ramp, ramp))
