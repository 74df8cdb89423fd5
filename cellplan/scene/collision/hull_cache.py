"""Hulls of meshes: found by a search in the child process, and kept from run to run."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.cache import Key, key_of
from cellplan.errors import InputError
from cellplan.geometry.mesh.load import keep_mesh, recall_mesh
from cellplan.geometry.mesh.topology import count_edges, make_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array
from cellplan.guard import Guard, in_child

FLAT_FRACTION: Final = 1e-6  # [-] of the largest spread: thinner meshes count as flat; coal crashes on those below 1e-8
GRID_FRACTION: Final = 1e-9  # [-] of the extent: nearer vertices are one; coal crashes on heaps of almost equal ones
HULL_FRACTION: Final = 1e-7  # [-] of the extent by which a vertex may stick out of the hull; none without rounding
MAX_CORNERS: Final = 2000  # the work of every distance grows with their number
FEW_CORNER_COUNT: Final = 250  # coal keeps at most 255 neighbours of a corner: so few corners cannot have more
MAX_GROWTH: Final = 1.1  # [-] by which a hull of some of the points may be blown up to hold the others
PAIR_CHUNK: Final = 4_000_000  # [-] products of points and planes worked on at once: about 30 MB
PROOF_CHUNK: Final = 64_000  # [-] likewise where only the largest counts: what a processor keeps at hand
GOLDEN_ANGLE: Final = np.pi * (3.0 - np.sqrt(5.0))  # [rad]


def convex_hull(mesh: Mesh) -> Mesh:
    """Smallest convex mesh that holds all vertices, up to 1e-7 of the extent; closed, facing outward.

    Where that has more than 2000 corners, or a corner with more than 255 neighbours, it is a slightly larger one: the
    hull of the farthest vertices in many directions, blown up until it holds the others too.

    ``InputError`` where the mesh is flat.
    """
    points = mesh.vertices
    if _is_flat(points):
        raise InputError(f"{mesh.source}: expected a body with a volume, got a flat one")
    extent = float(np.ptp(points, axis=0).max())
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    snapped = (
        np.unique(np.round((points - middle) / (GRID_FRACTION * extent)), axis=0) * (GRID_FRACTION * extent) + middle
    )
    for chosen in _choices(snapped):
        hull = None if _is_flat(chosen) else _hull(chosen, mesh.source)
        if hull is None or len(hull.vertices) > MAX_CORNERS:
            continue
        if not _holds(hull, points):
            hull = _blown_up(hull, points)
        if hull is not None and _holds(hull, points):
            return hull
    raise InputError(f"{mesh.source}: expected a mesh with a convex hull, got one that is too ill-conditioned")


def is_hull(hull: Mesh, points: Array) -> bool:
    """Whether a mesh, wherever it comes from, is closed, convex, and holds all points, shape (N, 3), as a hull does."""
    if not hull.is_closed or not count_edges(hull.faces).is_closed:
        return False
    with np.errstate(invalid="ignore", divide="ignore"):  # a triangle without area has no normal: nothing is held
        return _holds(hull, hull.vertices) and _holds(hull, points)


def _holds(hull: Mesh, points: Array) -> bool:
    """Whether all points, shape (N, 3), lie behind every face of a hull, up to 1e-7 of their extent."""
    return _sticking_out(hull, points) <= HULL_FRACTION * float(np.ptp(points, axis=0).max())


def _is_flat(points: Array) -> bool:
    """Whether the points, shape (N, 3), lie so near to a plane that there is no inside."""
    if len(points) < 4:
        return True
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return not spread[2] > FLAT_FRACTION * spread[0]


def _choices(points: Array) -> Iterator[Array]:
    """All points; then fewer and fewer, the farthest ones in directions spread evenly over the sphere."""
    yield points
    for count in (MAX_CORNERS, FEW_CORNER_COUNT):
        height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        angle = GOLDEN_ANGLE * np.arange(count)
        width = np.sqrt(1.0 - height**2)
        directions = np.stack([width * np.cos(angle), width * np.sin(angle), height], axis=1)
        step = max(1, PAIR_CHUNK // len(points))
        farthest = [np.argmax(directions[k : k + step] @ points.T, axis=1) for k in range(0, count, step)]
        yield points[np.unique(np.concatenate(farthest))]


def _hull(points: Array, source: str) -> Mesh | None:
    """Convex hull of points that are not flat; None where coal finds none."""
    import coal

    given = coal.StdVec_Vec3s()
    given.extend(list(points))
    try:
        hull = coal.Convex.convexHull(given, True, "Qt")
    except RuntimeError:
        return None
    polygons = [hull.polygons(k) for k in range(hull.num_polygons)]
    faces = np.array([[polygon[0], polygon[1], polygon[2]] for polygon in polygons], dtype=np.int64)
    return make_mesh(np.array(hull.points()), faces, source=source) if count_edges(faces).is_closed else None


def _blown_up(hull: Mesh, points: Array) -> Mesh | None:
    """The hull of some of the points, moved away from its middle until it holds all; None if that is much larger."""
    middle = hull.vertices.mean(axis=0)
    normals, offsets = _planes(hull)
    depth = offsets - normals @ middle
    if not np.all(depth > 0.0):
        return None
    step, shares = max(1, PROOF_CHUNK // len(normals)), (normals / depth[:, None]).T
    share = max(float(((points[k : k + step] - middle) @ shares).max()) for k in range(0, len(points), step))
    if share > MAX_GROWTH:
        return None
    corners = middle + max(share, 1.0) * (hull.vertices - middle)
    return Mesh(vertices=corners, faces=hull.faces, source=hull.source, is_closed=hull.is_closed)


def _sticking_out(hull: Mesh, points: Array) -> float:
    """How far in [m] the farthest point lies outside of a face: the proof of the hull, however it was found."""
    normals, offsets = _planes(hull)
    planes = np.vstack([normals.T, -offsets])
    step = max(1, PROOF_CHUNK // len(normals))
    heights, farthest = np.empty((min(step, len(points)), len(normals))), -np.inf
    for first in range(0, len(points), step):
        some = points[first : first + step]
        above = np.matmul(np.column_stack([some, np.ones(len(some))]), planes, out=heights[: len(some)])
        farthest = np.maximum(farthest, above.max())  # stays what is not a number
    return float(farthest)


def _planes(hull: Mesh) -> tuple[Array, Array]:
    """Unit outward normals, shape (M, 3), and offsets in [m], shape (M,), of the faces."""
    corner = hull.vertices[hull.faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return normals, np.sum(normals * corner[:, 0], axis=1)


def hull_of(mesh: Mesh) -> Mesh:
    """Smallest convex mesh that holds a mesh, as ``convex_hull`` finds it.

    One that was kept is proved once more to be convex and to hold these very vertices: that is cheap.

    ``InputError`` where the mesh is flat; ``OverrunError`` where the search crashed, or took too much.
    """
    cached = _recalled(mesh)
    if cached is not None:
        return cached
    guard = Guard(file=mesh.source, worker="the search for the hull")
    hull: Mesh = in_child(convex_hull, mesh, guard=guard)
    keep_mesh(_key(mesh), hull)
    return hull


def keep_hulls(meshes: Sequence[Mesh]) -> None:
    """Find the hulls of some meshes and keep them for other processes; only in a process that the search may end."""
    for mesh in meshes:
        keep_mesh(_key(mesh), convex_hull(mesh))


def without_hull(meshes: Iterable[Mesh]) -> list[Mesh]:
    """Those meshes of which no hull is kept."""
    return [mesh for mesh in meshes if recall_mesh(_key(mesh), source=mesh.source) is None]


def _recalled(mesh: Mesh) -> Mesh | None:
    """The hull that was kept of a mesh, proved anew; None where there is none."""
    cached = recall_mesh(_key(mesh), source=mesh.source)
    return cached if cached is not None and is_hull(cached, mesh.vertices) else None


def _key(mesh: Mesh) -> Key | None:
    """Key of the hull of a mesh."""
    return key_of("hull", np.ascontiguousarray(mesh.vertices).tobytes())
