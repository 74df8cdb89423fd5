"""Weld positions: how tools and welds lie to gravity along a path, by the angles of ISO 6947.

The slope is the angle of the weld axis, along the direction of travel, above the horizontal. The rotation is the angle
by which the weld face is turned about that axis from where it looks up: 0 for a flat weld, 90 deg for one on a wall.
The face looks against the tool, but for push or drag.
"""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross

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
