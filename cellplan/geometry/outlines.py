"""Outlines of solids: from above, and how far they reach in some directions."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere

CORNERS: Final = 24  # [-] of an outline
ANGLES: Final = 2.0 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS
AROUND: Final = np.stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(CORNERS)], axis=1)  # horizontal directions
ALL_ROUND: Final = np.concatenate(
    [np.cos(tilt) * AROUND[::2] + np.sin(tilt) * np.array([0.0, 0.0, 1.0]) for tilt in np.radians((-60, -20, 20, 60))]
)  # directions all round a body, of which the corners of a mesh are sought once
FEW_SAMPLES: Final = 8  # [-] poses for which a mesh is taken with all its corners
MOST_DIRECTIONS: Final = 1000  # along which the corners of a mesh are compared at once
FACING: Final = 1e-9  # [-] a direction this near to the normal of a face is the normal: rounding


def outlines(shape: Solid, R: Array, p: Array) -> Array:
    """Corners in [m], shape (N, 24, 2), of the outline of a solid from above at some poses, counter-clockwise.

    The outline is that of the convex hull, its corners points of the solid: one for each of 24 directions.

    Rotations in the world have the shape (N, 3, 3), positions in [m] (N, 3).
    """
    if isinstance(shape, Mesh):
        return _of_points(_corners(shape, few=len(R) <= FEW_SAMPLES), R, p)
    n = AROUND @ R  # the directions in the frame of the shape, shape (N, 24, 3)
    points = _farthest(shape, n)
    return (points @ np.swapaxes(R, -1, -2) + p[:, None])[..., :2]


def swept_outlines(shape: Solid, R: Array, p: Array) -> Array:
    """Outlines that hold a solid at two successive poses each, shape (N - 1, 24, 2); see ``outlines``."""
    at = outlines(shape, R, p)
    if len(at) < 2:
        return at
    reach = np.einsum("kci,ci->kc", at, AROUND[:, :2])
    is_later = reach[1:] > reach[:-1]
    return np.where(is_later[..., None], at[1:], at[:-1])


def reaches(shape: Solid, n: Array) -> Array:
    """How far a solid reaches from its origin along unit directions in its frame, shape (N, 3), in [m], shape (N,)."""
    if not isinstance(shape, Mesh):
        return np.asarray(np.sum(_farthest(shape, n) * n, axis=1))
    parts = np.array_split(n, -(-len(n) // MOST_DIRECTIONS))
    return np.concatenate([(part @ shape.vertices.T).max(axis=1) for part in parts])


def _farthest(shape: Box | Cylinder | Capsule | Sphere, n: Array) -> Array:
    """Points of a solid that are farthest along unit directions, in its frame, shape (..., 3)."""
    toward = np.where(np.abs(n) > FACING, np.sign(n), 0.0)
    match shape:
        case Box(size):
            return toward * (0.5 * np.asarray(size))
        case Sphere(radius):
            return radius * n
        case Capsule(radius, length):
            return radius * n + toward * (0.0, 0.0, 0.5 * length)
        case Cylinder(radius, length):
            across = np.hypot(n[..., 0], n[..., 1])
            share = np.where(across > FACING, radius / np.maximum(across, FACING), 0.0)
            flat = n * share[..., None] * (1.0, 1.0, 0.0)
            return flat + toward * (0.0, 0.0, 0.5 * length)


def _corners(mesh: Mesh, *, few: bool) -> Array:
    """Corners of a mesh; those farthest in some directions where it is seen at many poses."""
    if few or len(mesh.vertices) <= len(ALL_ROUND):
        return mesh.vertices
    return mesh.vertices[np.unique((mesh.vertices @ ALL_ROUND.T).argmax(axis=0))]


def _of_points(points: Array, R: Array, p: Array) -> Array:
    """Outlines of some points, shape (V, 3)."""
    placed = (points @ np.swapaxes(R, -1, -2) + p[:, None])[..., :2]
    extreme = (placed @ AROUND[:, :2].T).argmax(axis=1)
    return np.take_along_axis(placed, extreme[..., None], axis=1)
