"""What can be counted and summed over triangles: edges, connected pieces, volumes and winding numbers."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices

PAIR_CHUNK: Final = 1_000_000  # point-triangle pairs worked on at once: about 150 MB


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeCount:
    """How well the triangles of a surface fit together."""

    open: int  # edges with a triangle on one side only
    crowded: int  # edges shared by more than two triangles
    turned: int  # edges whose two triangles disagree about which side is outside
    unbalanced: int  # edges through which the triangles run more often one way than the other, of all these

    @property
    def is_closed(self) -> bool:
        """Whether every edge is shared by exactly two triangles that run through it in opposite directions."""
        return self.open == self.crowded == self.turned == 0


def count_edges(faces: Indices) -> EdgeCount:
    """Count the edges that do not join exactly two triangles in opposite directions; faces of shape (M, 3)."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    keys, group = np.unique(low * (high.max(initial=0) + 1) + high, return_inverse=True)
    triangles = np.bincount(group, minlength=len(keys))
    balance = np.bincount(group, weights=np.where(a < b, 1.0, -1.0), minlength=len(keys))
    return EdgeCount(
        open=int(np.sum(triangles == 1)),
        crowded=int(np.sum(triangles > 2)),
        turned=int(np.sum((triangles == 2) & (balance != 0.0))),
        unbalanced=int(np.sum(balance != 0.0)),
    )


def open_edge_ends(faces: Indices) -> Indices:
    """Both vertices of each edge that has a triangle on one side only, shape (K, 2)."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    _, first, triangles = np.unique(low * (high.max(initial=0) + 1) + high, return_index=True, return_counts=True)
    return np.stack([low, high], axis=1)[first[triangles == 1]]


def winding_numbers(triangles: Array, points: Array) -> Array:
    r"""How often a surface winds round each point: 1 inside a closed outward surface, 0 outside, shape (N,).

    The solid angles of all triangles are summed by the formula of Van Oosterom and Strackee,

    .. math:: \tan(\Omega/2) = \frac{a \cdot (b \times c)}{abc + (a \cdot b) c + (b \cdot c) a + (c \cdot a) b}

    Corners are in [m], shape (M, 3, 3), points in the frame of the mesh, shape (N, 3).
    """
    winding = np.zeros(len(points))
    step = max(1, PAIR_CHUNK // max(1, len(triangles)))
    for first in range(0, len(points), step):
        chosen = slice(first, first + step)
        corner = triangles[None] - points[chosen, None, None, :]
        a, b, c = corner[:, :, 0], corner[:, :, 1], corner[:, :, 2]
        la, lb, lc = (np.sqrt(_dot(side, side)) for side in (a, b, c))
        below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
        winding[chosen] = np.arctan2(_dot(a, np.cross(b, c)), below).sum(axis=1) / (2.0 * np.pi)
    return winding


def ray_winding(triangles: Array, points: Array) -> Indices:
    """How often a closed surface winds round points that are not on it, by its crossings of rays along x, shape (N,).

    The side of each edge is evaluated from its lower end only, so that a ray through an edge or a vertex crosses the
    surface there as often as it does beside it.

    Corners are in [m], shape (M, 3, 3), points in the frame of the mesh, shape (N, 3).
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    low, high = np.minimum(np.minimum(a, b), c).T.copy(), np.maximum(np.maximum(a, b), c).T.copy()
    near = (
        np.flatnonzero((low[2] <= z) & (high[2] > z) & (low[1] <= y) & (high[1] >= y) & (high[0] > x))
        for x, y, z in points
    )
    return np.array(
        [_crossings(triangles[candidates] - point) for candidates, point in zip(near, points, strict=True)], dtype=int
    )


def _crossings(corner: Array) -> int:
    """How often the ray from the origin along x leaves through triangles, less how often it enters through one."""
    flat, is_low = corner[:, :, 1:], corner[:, :, 2] <= 0.0
    rises = is_low.astype(np.int64) - np.roll(is_low, -1, axis=1)  # 1 where an edge goes up past the ray, -1 down
    ahead, goes_up = np.roll(flat, -1, axis=1), (rises > 0)[..., None]
    low, high = np.where(goes_up, flat, ahead), np.where(goes_up, ahead, flat)
    is_left = low[..., 0] * (high[..., 1] - low[..., 1]) > low[..., 1] * (high[..., 0] - low[..., 0])
    turns = np.sum(rises * is_left, axis=1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return int(np.sum(turns[_dot(normal, corner[:, 0]) * normal[:, 0] > 0.0]))


def components(count: int, pairs: Indices) -> Indices:
    """Smallest member of the connected group of each of ``count`` things, joined by pairs of shape (K, 2)."""
    label = np.arange(count)
    a, b = pairs[:, 0], pairs[:, 1]
    while True:
        root_a, root_b = label[a], label[b]
        apart = root_a != root_b
        if not np.any(apart):
            return label
        a, b = a[apart], b[apart]
        np.minimum.at(label, np.maximum(root_a, root_b)[apart], np.minimum(root_a, root_b)[apart])
        while not np.array_equal(jumped := label[label], label):
            label = jumped


def shells(faces: Indices, count: int) -> Indices:
    """Label of the connected shell each of ``count`` vertices belongs to."""
    return components(count, np.concatenate([faces[:, :2], faces[:, 1:]]))


def face_volumes(vertices: Array, faces: Indices) -> Array:
    """Signed volume of the tetrahedron of each triangle and the middle of the mesh, shape (M,)."""
    corner = vertices[faces] - 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    return _dot(corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6.0


def _dot(a: Array, b: Array) -> Array:
    """Row-wise scalar product over the last axis."""
    return np.einsum("...i,...i->...", a, b)
