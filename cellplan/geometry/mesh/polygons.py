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


def fan(vertices: Array, polygons: Polygons, name: str) -> Triangles:
    """Cut polygons into fans of triangles round their first corner.

    Raises:
        InputError: A corner is not among the vertices, or a polygon would fold over itself.
    """
    pieces: list[NDArray[np.int64]] = [np.empty((0, 3), dtype=np.int64)]
    for corners in sorted({len(polygon) for polygon in polygons}):
        indices = np.array([polygon for polygon in polygons if len(polygon) == corners], dtype=np.int64)
        outside = indices[(indices < 0) | (indices >= len(vertices))]
        if outside.size:
            raise InputError(f"{name}: expected corners among {len(vertices)} vertices, got vertex {outside[0] + 1}")
        pieces.append(_cut(vertices, indices, name))
    return vertices, np.concatenate(pieces)


def _cut(vertices: Array, indices: NDArray[np.int64], name: str) -> NDArray[np.int64]:
    """Fans of polygons with the same number of corners, shape (K, n), to triangles of shape (K (n - 2), 3)."""
    corners = indices.shape[1]
    triangles = np.stack([indices[:, [0, i, i + 1]] for i in range(1, corners - 1)], axis=1)
    if corners > 3:
        with np.errstate(over="ignore", invalid="ignore"):
            p = vertices[triangles]
            areas = np.cross(p[:, :, 1] - p[:, :, 0], p[:, :, 2] - p[:, :, 0])
            whole = areas.sum(axis=1, keepdims=True)
            leaning = np.sum(areas * whole, axis=2)
            folded = np.any(leaning < -FOLD_FRACTION * np.sum(whole * whole, axis=2), axis=1)
        if np.any(folded):
            count = int(folded.sum())
            raise InputError(
                f"{name}: expected convex faces, got {count} that are not convex: triangulate the mesh before export"
            )
    return triangles.reshape(-1, 3)
