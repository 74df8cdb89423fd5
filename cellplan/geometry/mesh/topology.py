"""Triangle meshes as surfaces: made of loose triangles by welding, with lost area accounted for and outside outside."""

from itertools import product
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.mesh.counts import (
    EdgeCount,
    components,
    count_edges,
    face_volumes,
    open_edge_ends,
    winding_numbers,
)
from cellplan.geometry.mesh.healing import encloses, oriented_alike, turn_outward, without_repeats
from cellplan.geometry.shapes import Mesh

__all__ = [
    "EdgeCount",
    "components",
    "count_edges",
    "make_mesh",
    "mesh_volume",
    "open_edge_ends",
    "weld_tolerance",
    "winding_numbers",
]


WELD_FRACTION: Final = 1e-6  # [-] of the largest coordinate: the last of the seven digits that single precision has
AREA_FRACTION: Final = 1e-12  # [-] of the longest side squared: thinner triangles have no usable normal
LOST_FRACTION: Final = 0.5  # [-] of the triangles that may be without area before the mesh counts as damaged


def make_mesh(vertices: Array, faces: Indices, *, source: str) -> Mesh:
    """Mesh from loose triangles: equal vertices welded, triangles without area dropped, outside made outside.

    Triangles that are there twice are taken once, and those that face the other way than their neighbours turned over.
    A crack no wider than a millionth of the largest coordinate is closed if that closes the surface; nothing else is
    moved or filled in. Closed bodies that touch stay several solids.

    Corner points are in [m], finite, shape (V, 3), corner indices in range, shape (M, 3). ``InputError`` where more
    than half of the triangles have no area, or a closed surface is in thousands of pieces.
    """
    welded, corners, edges = _weld(vertices, faces)
    whole = corners[_has_three_corners(corners)]
    if edges.crowded:
        whole = without_repeats(whole)
    if not edges.is_closed:
        whole = oriented_alike(whole)
    is_closed = len(whole) > 0 if edges.is_closed else encloses(whole)
    with_area = whole[_has_area(welded, whole)]
    flat = len(faces) - int(np.sum(_has_three_corners(corners))) + len(whole) - len(with_area)
    if flat > LOST_FRACTION * len(faces):  # a few are usual
        what = f"expected triangles of non-zero area, got {flat} of {len(faces)} degenerate"
        raise InputError(f"{source}: {what}: is the file damaged?")
    if is_closed:
        with_area = turn_outward(welded, with_area, source=source)
    used, compact = np.unique(with_area, return_inverse=True)
    corners = np.ascontiguousarray(compact, dtype=np.int64).reshape(-1, 3)
    return Mesh(vertices=welded[used], faces=corners, source=source, is_closed=is_closed)


def mesh_volume(mesh: Mesh) -> float:
    """Enclosed volume in [m³] by the divergence theorem; positive when the triangles face outward.

    An open mesh encloses nothing: the figure then only shows how its triangles lean.
    """
    return float(face_volumes(mesh.vertices, mesh.faces).sum())


def _weld(vertices: Array, faces: Indices) -> tuple[Array, Indices, EdgeCount]:
    """Merge equal vertices; where that leaves open edges, those of their ends that differ by rounding only.

    The vertices come with the corners of all triangles, and the edges of those that still have three.
    """
    points, corners = _merge(vertices + 0.0, faces, key=vertices + 0.0)  # + 0.0 makes -0 and 0 equal
    edges = count_edges(corners[_has_three_corners(corners)])
    if not edges.open:
        return points, corners, edges
    border = np.unique(open_edge_ends(corners[_has_three_corners(corners)]))
    place = np.arange(len(points))
    place[border] = border[_groups(points[border], weld_tolerance(points))]
    joined = place[corners]
    closed = count_edges(joined[_has_three_corners(joined)])
    return (points, joined, closed) if not closed.open else (points, corners, edges)


def weld_tolerance(points: Array) -> float:
    """Distance in [m] within which two points count as one, from points of shape (V, 3)."""
    return WELD_FRACTION * float(np.abs(points).max())


def _groups(points: Array, tolerance: float) -> Indices:
    """First member of the group of each point, shape (N,): neighbours are no farther apart than the tolerance.

    Two such points lie in one cell of a grid of twice the tolerance, or of one of those shifted by half a cell.
    """
    pairs = []
    for shift in product((0.0, 0.5), repeat=3):
        cells = np.floor(points / (2.0 * tolerance) + shift)
        order = np.lexsort(cells.T)
        is_shared = np.all(cells[order[1:]] == cells[order[:-1]], axis=1)
        pairs.append(np.stack([order[:-1][is_shared], order[1:][is_shared]], axis=1))
    near = np.concatenate(pairs)
    apart = np.linalg.norm(points[near[:, 0]] - points[near[:, 1]], axis=1)
    return components(len(points), near[apart <= tolerance])


def _merge(vertices: Array, faces: Indices, *, key: Array) -> tuple[Array, Indices]:
    """One vertex for each distinct key, shape (V, 3)."""
    order = np.lexsort((key[:, 2], key[:, 1], key[:, 0]))
    is_new = np.ones(len(order), dtype=bool)
    is_new[1:] = np.any(np.diff(key[order], axis=0) != 0.0, axis=1)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.cumsum(is_new) - 1
    return vertices[order[is_new]], place[faces]


def _has_three_corners(faces: Indices) -> Flags:
    """Which triangles still have three different corners."""
    return np.all(faces != np.roll(faces, -1, axis=1), axis=1)


def _has_area(vertices: Array, faces: Indices) -> Flags:
    """Which triangles have an area, against their longest side."""
    corner = vertices[faces]
    double_area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    longest = np.sum((corner - np.roll(corner, -1, axis=1)) ** 2, axis=2).max(axis=1, initial=0.0)
    return double_area > AREA_FRACTION * longest
