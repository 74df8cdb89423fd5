"""Paths that warm one another: passes of one seam, and seams that come near each other."""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array

PASS: Final = 0.010  # [m] within which all of a path lies beside another one of the same seam
POINTS: Final = 100  # of a path that are compared


def resting_pairs(paths: Mapping[str, Array], apart: float) -> Iterator[tuple[str, str]]:
    """Pairs of tasks between which the part must cool: passes of one seam, and paths that come near each other.

    Args:
        paths: Points of each path on the part in [m], shape (N, 3), in their order.
        apart: Distance in [m] from which paths do not warm one another; 0 where only passes do.
    """
    some = {
        name: points[np.unique(np.linspace(0, len(points) - 1, min(POINTS, len(points))).round().astype(np.intp))]
        for name, points in paths.items()
    }
    for first, second in combinations(some, 2):
        gaps = distances(some[first], some[second]), distances(some[second], some[first])
        if min(it.max() for it in gaps) <= PASS or min(it.min() for it in gaps) < apart:
            yield first, second


def distances(points: Array, path: Array) -> Array:
    """Distance of points, shape (N, 3), from the straight sides between those of a path, shape (M, 3); shape (N,)."""
    sides = np.diff(path, axis=0)
    lengths = np.maximum((sides**2).sum(axis=1), np.finfo(float).tiny)
    from_begin = points[:, None] - path[None, :-1]
    shares = np.clip((from_begin * sides).sum(axis=2) / lengths, 0.0, 1.0)
    return np.linalg.norm(from_begin - shares[..., None] * sides, axis=2).min(axis=1)
