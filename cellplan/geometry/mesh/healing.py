"""Repairs of a surface that move no vertex: triangles that face opposite ways, shells turned inside out."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.mesh.counts import components, count_edges, face_volumes, ray_winding, shells

MAX_PIECES: Final = 5000  # [-] an assembly with its screws has some hundreds
PROBE_COUNT: Final = 64  # [-] triangles of a shell that are tested for lying inside the others
BEHIND: Final = 1e-6  # [-] of the extent: by so much the points lie behind their triangle, inside its shell


def require_few_pieces(faces: Indices, *, source: str) -> None:
    """Refuse a heap of loose triangles: each of more than 5000 pieces would have to be tested against all others."""
    label = shells(faces, count := int(faces.max(initial=-1)) + 1)
    pieces = int(np.count_nonzero(np.bincount(label[faces[:, 0]], minlength=count)))
    if pieces > MAX_PIECES:
        raise InputError(
            f"{source}: expected a surface of at most {MAX_PIECES} connected components, got {pieces}: "
            "join its triangles at common vertices"
        )


def encloses(faces: Indices) -> bool:
    """Whether a surface has an inside: it is closed, or it is made of closed surfaces that share edges.

    Through each edge the triangles must run as often one way as the other: then the winding number of every point is
    a whole number. Triangles that are there twice, once in each direction, enclose nothing.
    """
    edges = count_edges(faces)
    if edges.is_closed:
        return len(faces) > 0
    return edges.unbalanced == 0 and not count_edges(rest := _without_twins(faces)).open and len(rest) > 0


def without_repeats(faces: Indices) -> Indices:
    """The triangles in their order, each once: one that is there twice, facing the same way, adds nothing."""
    keys = np.column_stack([np.sort(faces, axis=1), _parity(faces)])
    _, first = np.unique(keys, axis=0, return_index=True)
    return faces[np.sort(first)]


def oriented_alike(faces: Indices) -> Indices:
    """The triangles, some of them turned over, so that neighbours face the same way as far as that is possible.

    Every triangle stands for two nodes of a graph, as it is and turned over. Nodes are joined across each edge of
    exactly two triangles where they face the same way. A patch on which a triangle is joined to itself turned over
    has one side only and is left as it is.
    """
    if count_edges(faces).turned == 0:
        return faces
    count = len(faces)
    first, second, is_turned = _neighbours(faces)
    same, other = np.where(is_turned, second + count, second), np.where(is_turned, second, second + count)
    label = components(2 * count, np.concatenate([np.stack([first, same], 1), np.stack([first + count, other], 1)]))
    is_flipped = label[:count] > label[count:]
    return np.where(is_flipped[:, None], faces[:, ::-1], faces)


def turn_outward(vertices: Array, faces: Indices, *, source: str) -> Indices:
    """Flip the whole if it faces inward, then each shell that does and stands alone: the walls of a cavity stay.

    ``InputError`` where there are more shells than can be tested.
    """
    require_few_pieces(faces, source=source)
    if face_volumes(vertices, faces).sum() < 0.0:
        faces = faces[:, ::-1]
    names, label = np.unique(_solids(faces, len(vertices)), return_inverse=True)
    inward = np.flatnonzero(np.bincount(label, weights=face_volumes(vertices, faces)) < 0.0)
    if not inward.size:
        return faces
    low, high = _boxes(vertices, faces, label, count=len(names))
    turned = faces.copy()
    for shell in inward:
        is_in_shell = label == shell
        holders = np.all(low <= low[shell], axis=1) & np.all(high >= high[shell], axis=1)
        holders[shell] = False
        around = vertices[faces[holders[label]]]
        if not len(around) or not _all_within(around, _points_behind(vertices[faces[is_in_shell][:, ::-1]])):
            turned[is_in_shell] = faces[is_in_shell][:, ::-1]
    return turned


def _solids(faces: Indices, count: int) -> Indices:
    """Label of the closed surface that each triangle is of: solids that touch at an edge or a corner are several.

    Where it is not clear which triangles of a common edge are of which solid, these solids are one.
    """
    first, second, _ = _neighbours(faces)
    label = components(len(faces), np.stack([first, second], axis=1))
    edge = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    keys = np.column_stack([np.sort(edge, axis=1), np.repeat(label, 3)])
    _, uses = np.unique(keys, axis=0, return_counts=True)
    return label if np.all(uses == 2) else shells(faces, count)[faces[:, 0]]


def _points_behind(corner: Array) -> Array:
    """Points a little behind triangles of shape (M, 3, 3), shape (M, 3)."""
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    size = np.ptp(corner.reshape(-1, 3), axis=0).max()
    return corner.mean(axis=1) - BEHIND * size * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _all_within(around: Array, points: Array) -> bool:
    """Whether a surface, triangles of shape (M, 3, 3), winds round all of some points, tested at a few of them."""
    step = max(1, len(points) // PROBE_COUNT)
    return bool(np.all(ray_winding(around, points[::step]) >= 1))


def _boxes(vertices: Array, faces: Indices, label: Indices, *, count: int) -> tuple[Array, Array]:
    """Lowest and highest coordinates of each shell, shape (count, 3)."""
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, label, vertices[faces].min(axis=1))
    np.maximum.at(high, label, vertices[faces].max(axis=1))
    return low, high


def _neighbours(faces: Indices) -> tuple[Indices, Indices, Flags]:
    """Both triangles of each edge that has exactly two, and whether they run through it in the same direction."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(a, b) * (int(faces.max(initial=0)) + 1) + np.maximum(a, b)
    order = np.argsort(keys, kind="stable")
    _, start, size = np.unique(keys[order], return_index=True, return_counts=True)
    left = order[start[size == 2]]
    right = order[start[size == 2] + 1]
    return left // 3, right // 3, (a < b)[left] == (a < b)[right]


def _without_twins(faces: Indices) -> Indices:
    """The triangles without those pairs that have the same corners and face opposite ways."""
    keys, group = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True)
    balance = np.bincount(group.ravel(), weights=_parity(faces), minlength=len(keys))
    unpaired = np.repeat(keys, np.abs(balance).astype(np.int64), axis=0)
    sign = np.repeat(balance > 0.0, np.abs(balance).astype(np.int64))
    return np.where(sign[:, None], unpaired, unpaired[:, ::-1])


def _parity(faces: Indices) -> Indices:
    """1 for triangles whose corners stand in an even order, -1 for an odd one: which way they face, shape (M,)."""
    a, b, c = faces.T
    return np.sign(b - a) * np.sign(c - b) * np.sign(c - a)
