"""Welds: how tools and welds lie to gravity along a path, by the angles of ISO 6947; paths that warm one another.

The slope is the angle of the weld axis, along the direction of travel, above the horizontal. The rotation is the angle
by which the weld face is turned about that axis from where it looks up: 0 for a flat weld, 90 deg for one on a wall.
The face looks against the tool, but for push or drag.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross

PASS: Final = 0.010  # [m] within which all of a path lies beside another one of the same seam
POINTS: Final = 100  # of a path that are compared
UPRIGHT: Final = np.radians(45.0)  # slope from which on a weld runs up or down
NAMED: Final = ((22.5, "PA"), (67.5, "PB"), (112.5, "PC"), (157.5, "PD"), (180.0, "PE"))  # by rotation in [deg], up to


def torch_angles(X_WT: Array) -> Array:
    """Angles in [rad] between the axes of tools and gravity, for poses of shape (N, 4, 4) in shape (N,)."""
    return np.arccos(np.clip(-X_WT[:, 2, 2], -1.0, 1.0))


def weld_angles(X_WT: Array, travel: Array) -> tuple[Array, Array]:
    """Slopes and rotations of a weld.

    Args:
        X_WT: Tool poses in the world, shape (N, 4, 4).
        travel: Unit directions of travel in the world, shape (N, 3).

    Returns:
        Slopes and rotations in [rad], shape (N,) each; a rotation is positive about the direction of travel.
    """
    up = np.array([0.0, 0.0, 1.0]) - travel[:, 2:] * travel
    side = cross(travel, up)
    face = -X_WT[:, :3, 2]
    slope = np.arcsin(np.clip(travel[:, 2], -1.0, 1.0))
    return slope, np.arctan2((face * side).sum(axis=1), (face * up).sum(axis=1))


def position_name(slope: float, rotation: float) -> str:
    """The position of ISO 6947 that is nearest to a slope and a rotation in [rad], PA to PG."""
    if abs(slope) > UPRIGHT:
        return "PF" if slope > 0.0 else "PG"
    return next(name for most, name in NAMED if np.degrees(abs(rotation)) <= most + 1e-9)


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
