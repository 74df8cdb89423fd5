"""Facets of solids for a picture: flat quadrilaterals, counter-clockwise from outside; triangles repeat a corner."""

from functools import lru_cache
from itertools import pairwise
from math import ceil, pi, sqrt
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.mesh.decimate import decimated
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, bounding_sphere, support_point

LONGEST: Final = 0.25  # [m] of an edge along a box or a cylinder: facets are painted whole, in order of depth
MOST_PARTS: Final = 12  # [-] of one edge
SILHOUETTE: Final = np.pi / 4.0 * (np.arange(8) + 0.5)  # [rad] directions of the corners of a silhouette
FEWEST_SIDES, MOST_SIDES = 6, 48  # [-] of a round solid
MESH_CELLS: Final = 2.5  # [-] along the longest edge of a mesh for each of the sides of a round solid
FEWEST_TRIANGLES: Final = 60  # [-] of a mesh


def facets(shape: Solid, segments: int) -> Array:
    """Facets in the frame of the shape in [m], shape (K, 4, 3).

    Args:
        segments: Sides round the circumference of a round one, even; a mesh has about their square of triangles.
    """
    match shape:
        case Box(size):
            return _box(tuple(_parts(edge) for edge in size)) * np.asarray(size)
        case Cylinder(radius, length):
            return _grown(_cylinder(segments, _parts(length), _parts(2.0 * radius)), radius, length)
        case Capsule(radius, length):
            return _grown(_capsule(segments, _parts(length)), radius, length)
        case Sphere(radius):
            return _grown(_capsule(segments, 0), radius, 0.0)
        case Mesh():
            return _of_mesh(shape, segments)


def silhouette(shape: Solid, X_WS: Array, axes: Array) -> Array:
    """A flat octagon as large as a solid looks, in the world in [m], shape (3, 4, 3).

    Args:
        X_WS: Its pose in the world, shape (4, 4).
        axes: Axes of the camera, shape (3, 3).
    """
    R, p = X_WS[:3, :3], X_WS[:3, 3]
    around = np.stack([np.cos(SILHOUETTE), np.sin(SILHOUETTE)], axis=1) @ axes[:2]
    seen = np.array([axes[:2] @ (R @ support_point(shape, R.T @ n) + p) for n in around])
    ring = seen @ axes[:2] + axes[2] * float(axes[2] @ p)
    k = np.arange(3)
    return np.stack([ring[k], ring[k + 1], ring[-k - 2], ring[-k - 1]], axis=1)


def sides(shape: Solid, deviation: float) -> int:
    """Sides round the circumference with which facets differ from a solid by about a length in [m], even."""
    radius = shape.radius if isinstance(shape, Cylinder | Capsule | Sphere) else bounding_sphere(shape)[1]
    needed = pi / sqrt(2.0 * deviation / max(radius, 1e-9))  # the sagitta of a side: r (1 - cos(pi / n))
    return min(MOST_SIDES, max(FEWEST_SIDES, 2 * ceil(0.5 * needed - 1e-9)))


def _parts(length: float) -> int:
    """Pieces that an edge is cut into."""
    return min(MOST_PARTS, max(1, ceil(length / LONGEST - 1e-9)))


def _grown(unit: Array, radius: float, length: float) -> Array:
    """A round solid from points given as radial part (3) and share of the length, shape (K, 4, 4)."""
    grown = radius * unit[..., :3]
    grown[..., 2] += length * unit[..., 3]
    return grown


@lru_cache(maxsize=256)
def _of_mesh(mesh: Mesh, segments: int) -> Array:
    """Triangles of a mesh or of a coarser one, the last corner twice."""
    coarse = decimated(mesh, max(FEWEST_TRIANGLES, segments * segments), finest=MESH_CELLS * segments)
    corners = coarse.points[coarse.triangles]
    return np.concatenate([corners, corners[:, 2:]], axis=1)


@lru_cache(maxsize=64)
def _box(parts: tuple[int, int, int]) -> Array:
    """The unit cube about the origin, its faces cut into a grid."""
    pieces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        low = np.stack(np.meshgrid(np.arange(parts[u]), np.arange(parts[v]), indexing="ij"), axis=-1).reshape(-1, 1, 2)
        corners = (low + np.array([[0, 0], [1, 0], [1, 1], [0, 1]])) / (parts[u], parts[v]) - 0.5
        for side in (-0.5, 0.5):
            face = np.full((len(corners), 4, 3), side)
            face[..., [u, v]] = corners if side > 0.0 else corners[:, ::-1]
            pieces.append(face)
    return np.concatenate(pieces)


@lru_cache(maxsize=64)
def _cylinder(segments: int, parts: int, across: int) -> Array:
    """Side and both ends of a cylinder of unit radius and length, in parts along it and across its ends."""
    ends = _strips(segments, across)
    return np.concatenate([_side(segments, parts), _raised(ends, 0.5), _raised(ends[:, ::-1], -0.5)])


@lru_cache(maxsize=64)
def _capsule(segments: int, parts: int) -> Array:
    """Side and both half balls of a capsule of unit radius and length; no side without parts."""
    bands = max(1, segments // 6)
    latitude = 0.5 * np.pi * np.arange(bands + 1) / bands
    pieces = [_side(segments, parts)] if parts else []
    for low, high in pairwise(latitude):
        lower, upper = (_ring(segments, np.cos(at), np.sin(at)) for at in (low, high))
        band = np.stack([lower, np.roll(lower, -1, 0), np.roll(upper, -1, 0), upper], axis=1)
        mirrored = band[:, ::-1] * (1.0, 1.0, -1.0)
        pieces += [_raised(band, 0.5), _raised(mirrored, -0.5)]
    return np.concatenate(pieces)


def _ring(segments: int, radius: float, height: float) -> Array:
    """Corners round the axis, shape (segments, 3)."""
    angle = 2.0 * np.pi * (np.arange(segments) + 0.5) / segments
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(segments, height)], axis=1)


def _side(segments: int, parts: int) -> Array:
    """The side of a cylinder of unit radius and length."""
    ring = _ring(segments, 1.0, 0.0)
    quads = np.stack([ring, np.roll(ring, -1, 0), np.roll(ring, -1, 0), ring], axis=1)
    heights = np.arange(parts + 1) / parts - 0.5
    pieces = []
    for low, high in pairwise(heights):
        share = np.broadcast_to(np.array([low, low, high, high])[:, None], (segments, 4, 1))
        pieces.append(np.concatenate([quads, share], axis=-1))
    return np.concatenate(pieces)


def _strips(segments: int, parts: int) -> Array:
    """A disc of unit radius across the axis, in strips of four corners, each cut into parts."""
    ring = _ring(segments, 1.0, 0.0)
    k = np.arange(segments // 2 - 1)
    right, left = (np.stack([ring[first], ring[second]]) for first, second in ((k, -k - 1), (k + 1, -k - 2)))
    shares = np.arange(parts + 1)[:, None, None] / parts
    near, far = (side[0] + shares * (side[1] - side[0]) for side in (right, left))  # shape (parts + 1, K, 3)
    return np.stack([near[:-1], far[:-1], far[1:], near[1:]], axis=2).reshape(-1, 4, 3)


def _raised(quads: Array, share: float) -> Array:
    """Corners with the share of the length that they are raised by."""
    return np.concatenate([quads, np.full((*quads.shape[:2], 1), share)], axis=-1)
