"""Triangle meshes as surfaces: welding, lost area, open edges, outward orientation, volume and winding numbers."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array

Indices = NDArray[np.int64]
FaceArray = np.ndarray[tuple[int, int], np.dtype[np.int64]]

WELD_SHARE: Final = 1e-7  # [-] of the extent: vertices written in single precision differ by no more than this
AREA_SHARE: Final = 1e-12  # [-] of the longest side squared: thinner triangles have no usable normal
LOST_SHARE: Final = 0.5  # [-] of the triangles that may be without area before the mesh counts as damaged
PAIR_CHUNK: Final = 1_000_000  # point-triangle pairs worked on at once: about 150 MB


@dataclass(frozen=True, slots=True, kw_only=True)
class EdgeCount:
    """How well the triangles of a surface fit together.

    Attributes:
        open: Edges with a triangle on one side only.
        crowded: Edges shared by more than two triangles.
        turned: Edges whose two triangles disagree about which side is outside.
    """

    open: int
    crowded: int
    turned: int

    @property
    def is_closed(self) -> bool:
        """Whether every edge is shared by exactly two triangles that run through it in opposite directions."""
        return self.open == self.crowded == self.turned == 0


def make_mesh(vertices: Array, faces: Indices, *, source: str) -> Mesh:
    """Mesh from loose triangles: equal vertices welded, triangles without area dropped, outside made outside.

    Args:
        vertices: Corner points in [m], finite, shape (V, 3).
        faces: Corner indices, in range, shape (M, 3).
        source: File name for messages.

    Raises:
        InputError: More than half of the triangles have no area.
    """
    welded, corners = _weld(vertices, faces)
    whole = corners[_has_three_corners(corners)]
    is_closed = count_edges(whole).is_closed
    kept = whole[_has_area(welded, whole)]
    _account_for(len(faces) - len(kept), total=len(faces), source=source)
    if is_closed:
        kept = _turn_outward(welded, kept, shells=_shells(whole, len(welded)))
    used, compact = np.unique(kept, return_inverse=True)
    return Mesh(vertices=welded[used], faces=_as_faces(compact), source=source, is_closed=is_closed)


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
    )


def mesh_volume(mesh: Mesh) -> float:
    """Enclosed volume in [m³] by the divergence theorem; positive when the triangles face outward.

    An open mesh encloses nothing: the figure then only tells how its triangles lean.
    """
    return _volume(mesh.vertices, mesh.faces)


def winding_numbers(triangles: Array, points: Array) -> Array:
    r"""How often a surface winds round each point: 1 inside a closed outward surface, 0 outside, shape (N,).

    The solid angles of all triangles are summed by the formula of Van Oosterom and Strackee,

    .. math:: \tan(\Omega/2) = \frac{a \cdot (b \times c)}{abc + (a \cdot b) c + (b \cdot c) a + (c \cdot a) b}

    Args:
        triangles: Corner points in [m], shape (M, 3, 3).
        points: Shape (N, 3), in the frame of the mesh.
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


def _weld(vertices: Array, faces: Indices) -> tuple[Array, Indices]:
    """Merge equal vertices; where that leaves open edges, those that differ by rounding to single precision."""
    points, corners = _merge(vertices + 0.0, faces, key=vertices + 0.0)  # + 0.0 makes -0 and 0 equal
    if count_edges(corners[_has_three_corners(corners)]).is_closed:
        return points, corners
    grid = WELD_SHARE * float(np.ptp(points, axis=0).max())
    near, joined = _merge(points, corners, key=np.round(points / grid))
    return (near, joined) if count_edges(joined[_has_three_corners(joined)]).is_closed else (points, corners)


def _merge(vertices: Array, faces: Indices, *, key: Array) -> tuple[Array, Indices]:
    """One vertex for each distinct key, shape (V, 3)."""
    order = np.lexsort((key[:, 2], key[:, 1], key[:, 0]))
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = np.any(np.diff(key[order], axis=0) != 0.0, axis=1)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.cumsum(is_new) - 1
    return vertices[order[is_new]], place[faces]


def _has_three_corners(faces: Indices) -> NDArray[np.bool_]:
    """Which triangles still have three different corners."""
    distinct: NDArray[np.bool_] = np.all(faces != np.roll(faces, -1, axis=1), axis=1)
    return distinct


def _has_area(vertices: Array, faces: Indices) -> NDArray[np.bool_]:
    """Which triangles have an area, against their longest side."""
    corner = vertices[faces]
    double_area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    longest = np.sum((corner - np.roll(corner, -1, axis=1)) ** 2, axis=2).max(axis=1, initial=0.0)
    large: NDArray[np.bool_] = double_area > AREA_SHARE * longest
    return large


def _account_for(lost: int, *, total: int, source: str) -> None:
    """A few triangles without area are usual; many mean that the file is damaged."""
    if lost > LOST_SHARE * total:
        raise InputError(f"{source}: expected triangles with an area, got {lost} of {total} without: is it damaged?")


def _shells(faces: Indices, count: int) -> Indices:
    """Label of the connected shell each of ``count`` vertices belongs to."""
    return components(count, np.concatenate([faces[:, :2], faces[:, 1:]]))


def _turn_outward(vertices: Array, faces: Indices, *, shells: Indices) -> Indices:
    """Flip the whole if it faces inward, then each shell that does and stands alone: the walls of a cavity stay."""
    if _volume(vertices, faces) < 0.0:
        faces = faces[:, ::-1]
    label = shells[faces[:, 0]]
    turned = faces.copy()
    for name in np.flatnonzero(np.bincount(label, weights=_face_volumes(vertices, faces)) < 0.0):
        others = vertices[faces[label != name]]
        if winding_numbers(others, vertices[[name]])[0] < 0.5:
            turned[label == name] = faces[label == name][:, ::-1]
    return turned


def _volume(vertices: Array, faces: Indices) -> float:
    """Signed volume in [m³]."""
    return float(_face_volumes(vertices, faces).sum())


def _face_volumes(vertices: Array, faces: Indices) -> Array:
    """Signed volume of the tetrahedron of each triangle and the middle of the mesh, shape (M,)."""
    corner = vertices[faces] - 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    volumes: Array = _dot(corner[:, 0], np.cross(corner[:, 1], corner[:, 2])) / 6.0
    return volumes


def _dot(a: Array, b: Array) -> Array:
    """Row-wise scalar product over the last axis."""
    product: Array = np.einsum("...i,...i->...", a, b)
    return product


def _as_faces(indices: NDArray[Any]) -> FaceArray:
    """Index array in the form that meshes keep."""
    return np.ascontiguousarray(indices, dtype=np.int64).reshape(-1, 3)
