"""Polygons of a mesh file cut into triangles."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array

Triangles = tuple[Array, NDArray[np.int64]]
Polygons = list[Sequence[int]]

FOLD_FRACTION: Final = 1e-9  # [-] of the polygon's area: rounding of corners that lie on one line
THIN_FRACTION: Final = 1e-12  # [-] of the extent squared: polygons of less area are lines
MAX_CORNERS: Final = 3000  # of a polygon that is not convex: the time to cut it grows with the square


def polygons_as_triangles(vertices: Array, polygons: Polygons, name: str) -> Triangles:
    """Vertices and triangles of polygons that are lists of corners; see `cut_polygons`."""
    sizes = np.array([len(polygon) for polygon in polygons], dtype=np.int64)
    flat = np.fromiter((corner for polygon in polygons for corner in polygon), dtype=np.int64, count=int(sizes.sum()))
    return vertices, cut_polygons(vertices, flat, sizes, name)


def cut_polygons(vertices: Array, flat: NDArray[np.int64], sizes: NDArray[np.int64], name: str) -> NDArray[np.int64]:
    """Cut polygons into triangles, shape (M, 3).

    Each is cut in the plane of its mean normal. Triangles that all face the way of the polygon and have its border
    cover it once, whatever its shape: a fan round one corner where that succeeds, ears cut off one by one elsewhere.
    Polygons of one or two corners cover nothing.

    Vertices have the shape (V, 3); ``flat`` lists the corners of all polygons, one after the other, ``sizes`` their
    numbers. ``InputError`` where a corner is none of the vertices, or a polygon crosses itself.
    """
    outside = flat[(flat < 0) | (flat >= len(vertices))]
    if outside.size:
        raise InputError(f"{name}: expected corners among {len(vertices)} vertices, got vertex {outside[0] + 1}")
    starts = np.cumsum(sizes) - sizes
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused by name later
        pieces = [
            _cut(vertices, flat[starts[sizes == corners, None] + np.arange(corners)], name)
            for corners in np.unique(sizes[sizes >= 3])
        ]
    return np.concatenate([np.empty((0, 3), dtype=np.int64), *pieces])


def _cut(vertices: Array, indices: NDArray[np.int64], name: str) -> NDArray[np.int64]:
    """Triangles of polygons with the same number of corners, shape (K, n), to triangles of shape (K (n - 2), 3)."""
    corners = indices.shape[1]
    if corners == 3:
        return indices
    fans = np.stack([np.zeros(corners - 2, np.int64), np.arange(1, corners - 1), np.arange(2, corners)], axis=1)
    triangles = indices[:, fans]
    for polygon in np.flatnonzero(_is_folded(vertices[triangles])):
        points = vertices[indices[polygon]]
        ears = _ears(points - points.mean(axis=0)) if corners <= MAX_CORNERS else None
        if ears is None:
            shown = ", ".join(str(corner + 1) for corner in indices[polygon][:4])
            raise InputError(
                f"{name}: expected faces that do not cross themselves, of at most {MAX_CORNERS} corners where not "
                f"convex, got one of {corners} corners, vertices {shown}, …: triangulate the mesh before export"
            )
        triangles[polygon] = indices[polygon][ears]
    return triangles.reshape(-1, 3)


def _is_folded(corner: Array) -> NDArray[np.bool_]:
    """Which fans, shape (K, n - 2, 3, 3), have triangles that face against the whole."""
    areas = np.cross(corner[:, :, 1] - corner[:, :, 0], corner[:, :, 2] - corner[:, :, 0])
    whole = areas.sum(axis=1, keepdims=True)
    square = np.sum(whole * whole, axis=2)
    total = np.linalg.norm(areas, axis=2).sum(axis=1)
    extent = np.ptp(corner.reshape(len(corner), -1, 3), axis=1).max(axis=1)
    is_folded = np.any(np.sum(areas * whole, axis=2) < -FOLD_FRACTION * square, axis=1)
    is_folded |= np.sqrt(square[:, 0]) < FOLD_FRACTION * total  # as much of it faces one way as the other
    return np.asarray(is_folded & (total > THIN_FRACTION * extent**2))


def _ears(points: Array) -> NDArray[np.int64] | None:
    """Triangles of one polygon, shape (n, 3), to corner numbers of shape (n - 2, 3); None when it crosses itself."""
    flat = _in_its_plane(points)
    if flat is None:
        return None
    least = FOLD_FRACTION * _double_area(flat)
    left, cut = np.arange(len(points)), []
    while len(left) > 3:
        behind, ahead = np.roll(left, 1), np.roll(left, -1)
        areas = _turn(flat[behind], flat[left], flat[ahead])
        ears = np.flatnonzero(np.abs(areas) <= least)  # a corner on the line of its neighbours
        if not ears.size:
            blocking = flat[left[areas < 0.0]]
            convex = np.flatnonzero(areas > 0.0)
            ears = next(
                (np.array([k]) for k in convex if not _holds(flat[[behind[k], left[k], ahead[k]]], blocking)),
                np.empty(0, dtype=np.int64),
            )
        if not ears.size:
            return None
        ear = int(ears[0])
        cut.append((behind[ear], left[ear], ahead[ear]))
        left = np.delete(left, ear)
    return None if _turn(*flat[left]) < -least else np.array([*cut, left], dtype=np.int64)


def _in_its_plane(points: Array) -> Array | None:
    """Coordinates of a polygon in the plane of its mean normal, counter-clockwise, shape (n, 2); None without one."""
    normal = np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if not THIN_FRACTION * float(np.ptp(points, axis=0).max()) ** 2 < length < np.inf:
        return None
    normal /= length
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    return points @ np.stack([first, np.cross(normal, first)], axis=1)


def _double_area(flat: Array) -> float:
    """Twice the area of a polygon in a plane."""
    ahead = np.roll(flat, -1, axis=0)
    return float(np.sum(flat[:, 0] * ahead[:, 1] - flat[:, 1] * ahead[:, 0]))


def _turn(a: Array, b: Array, c: Array) -> Array:
    """Twice the area of triangles in a plane, positive when counter-clockwise."""
    return (b[..., 0] - a[..., 0]) * (c[..., 1] - a[..., 1]) - (b[..., 1] - a[..., 1]) * (c[..., 0] - a[..., 0])


def _holds(triangle: Array, points: Array) -> bool:
    """Whether a triangle in a plane holds one of some points, other than its own corners."""
    others = points[~np.any(np.all(points[:, None] == triangle[None], axis=2), axis=1)]
    a, b, c = triangle
    return bool(np.any((_turn(a, b, others) >= 0.0) & (_turn(b, c, others) >= 0.0) & (_turn(c, a, others) >= 0.0)))
