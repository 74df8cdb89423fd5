"""The outer surface of solids that touch: without the parts of their faces that lie on each other.

Of an assembly from a CAD system each body is closed, and where two touch, faces of both lie in one plane and face each
other. Nothing of them is on the outside: a point there is as deep as the assembly is thick round it. They are cut out
of both bodies, whatever their triangles are.
"""

from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.mesh.counts import count_edges, shells
from cellplan.geometry.mesh.topology import weld_tolerance
from cellplan.geometry.shapes import Mesh

CACHE_SIZE: Final = 32  # meshes
OPPOSITE: Final = 1.0 - 1e-6  # [-] cosine from which on two normals are opposite; the distance of corners decides
NEAR_PLANES: Final = 1e-4  # [-] difference of two planes' keys up to which they may be one
KEY: Final = np.array([0.437, 0.619, 0.283])  # [-] no usual planes have equal keys
PAIR_CHUNK: Final = 2_000_000  # pairs of triangles compared at once: 200 MB

Polygon = list[tuple[float, float]]


@lru_cache(maxsize=CACHE_SIZE)
def outer_surface(mesh: Mesh) -> Mesh:
    """The surface of a closed mesh without what its solids have in common, as triangles with corners of their own.

    Faces count as touching up to a millionth of the largest coordinate. A mesh of one solid is returned as it is.
    """
    if not mesh.is_closed or not has_several_solids(mesh):
        return mesh
    corner = mesh.vertices[mesh.faces]
    tolerance = weld_tolerance(mesh.vertices)
    first, second = _facing_pairs(corner, tolerance)
    if not len(first):
        return mesh
    face, other = np.concatenate([first, second]), np.concatenate([second, first])
    order = np.argsort(face, kind="stable")
    covered, starts = np.unique(face[order], return_index=True)
    groups = np.split(other[order], starts[1:])
    rests = [_rest(corner[k], corner[others], tolerance) for k, others in zip(covered, groups, strict=True)]
    triangles = np.concatenate([np.delete(corner, covered, axis=0), *rests])
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    return Mesh(vertices=triangles.reshape(-1, 3), faces=faces, source=mesh.source, is_closed=True)


@lru_cache(maxsize=CACHE_SIZE)
def has_several_solids(mesh: Mesh) -> bool:
    """Whether a closed mesh is in several pieces, or has edges of more than two triangles."""
    label = shells(mesh.faces, len(mesh.vertices))[mesh.faces[:, 0]]
    return bool(np.any(label != label[0])) or count_edges(mesh.faces).crowded > 0


def _facing_pairs(corner: Array, tolerance: float) -> tuple[Indices, Indices]:
    """Pairs of triangles that lie in one plane, face each other and have boxes that meet."""
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal /= area[:, None]
    size = float(np.abs(corner).max())
    key = normal @ KEY + np.einsum("ij,ij->i", normal, corner[:, 0]) / size  # of the same plane seen from behind: -key
    order = np.argsort(key, kind="stable")
    low = np.searchsorted(key[order], -key - NEAR_PLANES)
    counts = np.searchsorted(key[order], -key + NEAR_PLANES) - low
    marks = np.searchsorted(np.cumsum(counts), np.arange(PAIR_CHUNK, counts.sum(), PAIR_CHUNK))
    edges = np.unique(np.concatenate([[0], marks, [len(corner)]]))
    box_low, box_high = corner.min(axis=1) - tolerance, corner.max(axis=1)
    firsts, seconds = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for start, stop in pairwise(edges.tolist()):
        number = counts[start:stop]
        a = np.repeat(np.arange(start, start + len(number)), number)
        b = order[
            np.arange(number.sum()) - np.repeat(np.cumsum(number) - number, number) + np.repeat(low[start:stop], number)
        ]
        meets = (a < b) & np.all((box_low[a] <= box_high[b]) & (box_low[b] <= box_high[a]), axis=1)
        a, b = a[meets], b[meets]
        a, b = np.where(area[a] >= area[b], a, b), np.where(area[a] >= area[b], b, a)  # the larger has the plane
        away = np.abs(np.einsum("kci,ki->kc", corner[b] - corner[a, :1], normal[a])).max(axis=1, initial=0.0)
        is_facing: Flags = (np.sum(normal[a] * normal[b], axis=1) <= -OPPOSITE) & (away <= tolerance)
        firsts.append(a[is_facing])
        seconds.append(b[is_facing])
    return np.concatenate(firsts), np.concatenate(seconds)


def _rest(triangle: Array, others: Array, tolerance: float) -> Array:
    """What is left of a triangle, shape (3, 3), outside others in its plane, shape (K, 3, 3), as triangles."""
    origin, first = triangle[0], triangle[1] - triangle[0]
    first = first / np.linalg.norm(first)
    normal = np.cross(first, triangle[2] - origin)
    axes = np.stack([first, np.cross(normal / np.linalg.norm(normal), first)])
    pieces: list[Polygon] = [[(u, v) for u, v in (triangle - origin) @ axes.T]]
    for other in (others[:, ::-1] - origin) @ axes.T:  # turned over, they run the same way round
        pieces = [part for piece in pieces for part in _outside(piece, [(u, v) for u, v in other], tolerance)]
    fans = [(piece[0], b, c) for piece in pieces for b, c in pairwise(piece[1:])]
    rest = origin + np.array(fans, dtype=float).reshape(-1, 3, 2) @ axes
    sides = rest[:, 1:] - rest[:, :1]
    return rest[np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > tolerance**2]


def _outside(piece: Polygon, hole: Polygon, tolerance: float) -> list[Polygon]:
    """The parts of a convex polygon outside another, both counter-clockwise; the whole where they do not overlap."""
    parts, inside = [], piece
    for start, end in zip(hole, [*hole[1:], hole[0]], strict=True):
        inside, outside = _cut(inside, start, end)
        if _is_wider(outside, tolerance):
            parts.append(outside)
        if not _is_wider(inside, tolerance):
            return [piece]
    return parts


def _cut(polygon: Polygon, start: tuple[float, float], end: tuple[float, float]) -> tuple[Polygon, Polygon]:
    """The parts of a convex polygon to the left and to the right of a line."""
    du, dv = end[0] - start[0], end[1] - start[1]
    heights = [du * (v - start[1]) - dv * (u - start[0]) for u, v in polygon]
    left, right = [], []
    for k, (point, height) in enumerate(zip(polygon, heights, strict=True)):
        before, level = polygon[k - 1], heights[k - 1]
        if (height > 0.0) != (level > 0.0) and height != level:
            share = level / (level - height)
            crossing = (before[0] + share * (point[0] - before[0]), before[1] + share * (point[1] - before[1]))
            left.append(crossing)
            right.append(crossing)
        (left if height > 0.0 else right).append(point)
    return left, right


def _is_wider(polygon: Polygon, tolerance: float) -> bool:
    if len(polygon) < 3:
        return False
    ahead = [*polygon[1:], polygon[0]]
    double_area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(polygon, ahead, strict=True))
    around = sum(abs(a[0] - b[0]) + abs(a[1] - b[1]) for a, b in zip(polygon, ahead, strict=True))
    return double_area > tolerance * around
