"""A mesh with fewer triangles, for pictures, and how far it lies from the mesh that it was made of."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Mesh

FINEST: Final = 512.0  # [-] cells along the longest edge that are tried first
COARSER: Final = 0.8  # [-] of that number from one attempt to the next
COARSEST: Final = 4  # [-] below it a shape could not be recognised


@dataclass(frozen=True, slots=True, eq=False)
class Decimated:
    """A mesh for a picture."""

    points: Array  # corner points in [m], shape (V, 3)
    triangles: np.ndarray[tuple[int, int], np.dtype[np.int64]]  # corner indices, shape (M, 3)
    deviation: float  # largest distance in [m] by which a point of the surface was moved


def decimated(mesh: Mesh, limit: int, *, finest: float = FINEST) -> Decimated:
    """Merge points in cells of a grid, first of ``finest`` cells along the longest edge, down to a number of triangles.

    Every point of the surface moves with the corners of its triangle, so none moves farther than the corner that moves
    most. Triangles that shrink to a line are dropped.

    More are left only where the grid is as coarse as it may be.
    """
    points, triangles = _used(mesh.vertices, np.asarray(mesh.faces))
    if len(triangles) <= limit:
        return Decimated(points, triangles, 0.0)
    low = points.min(axis=0)
    longest = float((points.max(axis=0) - low).max())
    cells = finest
    while True:
        merged = _merged(points, triangles, np.floor((points - low) / (longest / cells)).astype(np.int64))
        if len(merged.triangles) <= limit or cells * COARSER < COARSEST:
            return merged
        cells *= COARSER


def _merged(points: Array, triangles: np.ndarray[tuple[int, int], np.dtype[np.int64]], cells: Array) -> Decimated:
    """One point for all in a cell: the middle of them; ``cells`` of shape (V, 3) are counted along each axis."""
    high = int(cells.max()) + 1
    places = (cells[:, 0] * high + cells[:, 1]) * high + cells[:, 2]  # one number for each: quicker to sort than rows
    _, group, counts = np.unique(places, return_inverse=True, return_counts=True)
    middles = np.stack([np.bincount(group, weights=points[:, i]) for i in range(3)], axis=1) / counts[:, None]
    moved = float(np.linalg.norm(middles[group] - points, axis=1).max())
    corners = group[triangles]
    is_flat = (corners[:, 0] == corners[:, 1]) | (corners[:, 1] == corners[:, 2]) | (corners[:, 2] == corners[:, 0])
    proper = corners[~is_flat]
    _, first = np.unique(np.sort(proper, axis=1), axis=0, return_index=True)  # both sides of a thin wall fall together
    return Decimated(*_used(middles, proper[np.sort(first)]), moved)


def _used(
    points: Array, triangles: np.ndarray[tuple[int, int], np.dtype[np.int64]]
) -> tuple[Array, np.ndarray[tuple[int, int], np.dtype[np.int64]]]:
    """Points that triangles use, and the triangles with their new numbers."""
    used, corners = np.unique(triangles, return_inverse=True)
    return points[used], corners.reshape(-1, 3)
