"""Convex hull of a mesh by the quickhull method: the point farthest outside joins, the faces it sees give way."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.mesh_topology import count_edges, make_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array

FLAT: Final = 1e-9  # [-] of the extent: thinner meshes have no hull with an inside
OUTSIDE_STEPS: Final = (
    1e-11,
    1e-13,
    1e-12,
    1e-10,
)  # [-] of the extent: nearer points count as on a face; tried in turn
HULL_ROOM: Final = 1e-7  # [-] of the extent by which a vertex may stick out of the finished hull
MAX_CORNERS: Final = 2000  # the work grows with the square of their number
ROWS: Final = 1000  # points tested against all faces at once

Indices = NDArray[np.int64]


def convex_hull(mesh: Mesh) -> Mesh:
    """Smallest convex mesh that holds all vertices, up to 1e-7 of the extent; closed, facing outward.

    Very fine round meshes get a slightly larger one: a hull over some 2000 of their vertices, blown up until it holds
    the others too.

    Raises:
        InputError: The mesh is flat.
    """
    points = np.unique(mesh.vertices, axis=0)
    extent = float(np.ptp(points, axis=0).max())
    first = _first_tetrahedron(points, FLAT * extent)
    if first is None:
        raise InputError(f"{mesh.source}: expected a body with a volume, got a flat one")
    for step in OUTSIDE_STEPS:
        faces = _grow(points, first, room=step * extent)
        hull_points = _blown_up(points, faces)
        if count_edges(faces).is_closed and _holds(hull_points, faces, points, room=HULL_ROOM * extent):
            return make_mesh(hull_points, faces, source=mesh.source)
    raise InputError(f"{mesh.source}: expected a mesh with a convex hull, got one too ill-shaped for it")


def _first_tetrahedron(points: Array, room: float) -> Indices | None:
    """Four outward faces over four points far from each other, or None when all points lie in a plane."""
    axis = int(np.argmax(np.ptp(points, axis=0)))
    a, b = int(np.argmin(points[:, axis])), int(np.argmax(points[:, axis]))
    off_line = np.linalg.norm(np.cross(points - points[a], points[b] - points[a]), axis=1)
    c = int(np.argmax(off_line))
    length = float(np.linalg.norm(points[b] - points[a]))
    if length == 0.0 or off_line[c] <= room * length:
        return None
    normal = np.cross(points[b] - points[a], points[c] - points[a])
    height = (points - points[a]) @ (normal / np.linalg.norm(normal))
    d = int(np.argmax(np.abs(height)))
    if abs(height[d]) <= room:
        return None
    if height[d] > 0.0:
        b, c = c, b
    return np.array([[a, b, c], [a, d, b], [b, d, c], [c, d, a]])


def _grow(points: Array, faces: Indices, *, room: float) -> Indices:
    """Take in the farthest outside point until none lies more than ``room`` outside, or the hull is fine enough."""
    normals, offsets = _planes(points, faces)
    owner, height = _assign(points, np.arange(len(points)), normals, offsets)
    corners = 4
    while height.max() > room and corners < MAX_CORNERS:
        corners += 1
        apex = int(np.argmax(height))
        seen_ones, horizon = _horizon(
            faces, np.flatnonzero(normals @ points[apex] - offsets > room), start=int(owner[apex])
        )
        seen = np.zeros(len(faces), dtype=bool)
        seen[seen_ones] = True
        fresh = np.column_stack([horizon, np.full(len(horizon), apex)])
        fresh_normals, fresh_offsets = _planes(points, fresh)
        loose = np.flatnonzero(seen[owner] & (height > -np.inf))
        place = np.cumsum(~seen) - 1
        owner = np.where(seen[owner], 0, place[owner])
        height[loose] = -np.inf
        faces = np.concatenate([faces[~seen], fresh])
        normals, offsets = (
            np.concatenate([normals[~seen], fresh_normals]),
            np.concatenate([offsets[~seen], fresh_offsets]),
        )
        loose = loose[loose != apex]
        owner[loose], height[loose] = _assign(points, loose, fresh_normals, fresh_offsets)
        owner[loose] += len(faces) - len(fresh)
        height[loose[height[loose] <= room]] = -np.inf  # inside for good: the hull only grows
    return faces


def _blown_up(points: Array, faces: Indices) -> Array:
    """Vertices moved away from the middle of an unfinished hull until its faces hold all points."""
    corners = np.unique(faces)
    if len(corners) < MAX_CORNERS:
        return points
    middle = points[corners].mean(axis=0)
    normals, offsets = _planes(points, faces)
    depth = offsets - normals @ middle
    share = max(
        float(((points[first : first + ROWS] - middle) @ normals.T / depth).max())
        for first in range(0, len(points), ROWS)
    )
    grown: Array = middle + max(share, 1.0) * (points - middle)
    return grown


def _holds(hull: Array, faces: Indices, points: Array, *, room: float) -> bool:
    """Whether no point sticks out of any face by more than the room: proof of the result, however it was found."""
    normals, offsets = _planes(hull, faces)
    return all(
        bool(np.all(points[first : first + ROWS] @ normals.T - offsets <= room))
        for first in range(0, len(points), ROWS)
    )


def _planes(points: Array, faces: Indices) -> tuple[Array, Array]:
    """Unit normals and offsets of faces; a face without area gets a normal of zero and sees nothing."""
    origin = points[faces[:, 0]]
    u, v = points[faces[:, 1]] - origin, points[faces[:, 2]] - origin
    normals = u[:, [1, 2, 0]] * v[:, [2, 0, 1]] - u[:, [2, 0, 1]] * v[:, [1, 2, 0]]
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    return normals, np.sum(normals * origin, axis=1)


def _assign(points: Array, chosen: Indices, normals: Array, offsets: Array) -> tuple[Indices, Array]:
    """For each chosen point the face it lies farthest outside of, and how far."""
    height = points[chosen] @ normals.T - offsets
    owner = np.argmax(height, axis=1) if len(normals) else np.zeros(len(chosen), dtype=np.int64)
    return owner, height[np.arange(len(chosen)), owner]


def _horizon(faces: Indices, seen: Indices, *, start: int) -> tuple[list[int], Indices]:
    """The seen faces that hang together with one of them, and the directed edges round them, shape (H, 2)."""
    corners = {start: faces[start].tolist()} | dict(zip(seen.tolist(), faces[seen].tolist(), strict=True))
    face_at = {edge: face for face, (a, b, c) in corners.items() for edge in ((a, b), (b, c), (c, a))}
    reached, waiting = {start}, [start]
    rim: list[tuple[int, int]] = []
    while waiting:
        a, b, c = corners[waiting.pop()]
        for p, q in ((a, b), (b, c), (c, a)):
            beyond = face_at.get((q, p))
            if beyond is None:
                rim.append((p, q))
            elif beyond not in reached:
                reached.add(beyond)
                waiting.append(beyond)
    return sorted(reached), np.array(sorted(rim))
