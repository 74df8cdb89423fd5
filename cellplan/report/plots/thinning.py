"""Curves with as few points as their picture needs."""

import math
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices

# [-] of the tolerance in each round: steps of twice the length leave a bent curve four times as far
ROUND_SHARES: Final = tuple(4.0**k / 341.0 for k in range(5))


def peak_samples(values: Array, points: int) -> Indices:
    """Indices of some samples, among them the first, the last, and the extremes of every interval.

    Args:
        values: Shape (N,).
        points: About how many there may be.
    """
    n = len(values)
    if n <= points:
        return np.arange(n)
    length = math.ceil(2 * n / points)
    whole = n // length * length
    stretches = values[:whole].reshape(-1, length)
    starts = np.arange(0, whole, length)
    rest = np.arange(whole, n)
    ends = rest[[np.argmin(values[rest]), np.argmax(values[rest])]] if len(rest) else rest
    lows, highs = starts + stretches.argmin(axis=1), starts + stretches.argmax(axis=1)
    return np.unique(np.concatenate([[0], lows, highs, ends, [n - 1]]))


def straightened(x: Array, y: Array, tolerance: float) -> Indices:
    """Indices of the points of a curve without those that lie on the straight line between their neighbours.

    Every second point is tested in each round, and removed where it lies no farther above or below that line than
    a share of the tolerance: the curve through the remaining points lies nowhere farther from the given one than
    the tolerance.

    Args:
        x: Increasing, shape (K,).
        y: Shape (K,).
        tolerance: In the unit of ``y``.
    """
    indices = np.arange(len(x))
    for share in ROUND_SHARES:
        if len(indices) < 3:
            break
        middle = np.arange(1, len(indices) - 1, 2)
        before, at, after = indices[middle - 1], indices[middle], indices[middle + 1]
        shares = (x[at] - x[before]) / np.maximum(x[after] - x[before], np.finfo(float).tiny)
        apart = np.abs(y[before] + shares * (y[after] - y[before]) - y[at])
        indices = np.delete(indices, middle[apart <= share * tolerance])
    return indices
