"""Meshes: read from files, checked to be sound, and queried by rays and for what lies inside."""

import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cellplan.cache import Key, keep, key_of, recall
from cellplan.errors import InputError
from cellplan.geometry.arrays import Indices
from cellplan.geometry.mesh.formats.collada_file import parse_collada
from cellplan.geometry.mesh.formats.polygons import Triangles
from cellplan.geometry.mesh.formats.stl_obj import parse_mesh, require_likely_count, unknown_format
from cellplan.geometry.mesh.healing import require_few_pieces
from cellplan.geometry.mesh.rays import RayHits, ray_hits
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import (
    components,
    count_edges,
    make_mesh,
    mesh_volume,
    open_edge_ends,
    winding_numbers,
)
from cellplan.geometry.mesh.touching import outer_surface
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import Array

__all__ = [
    "FORMATS",
    "MESH_UNITS",
    "RayHits",
    "contains",
    "corner_normals",
    "is_flat",
    "make_mesh",
    "mesh_volume",
    "open_edges",
    "ray_hits",
    "read_drawing",
    "read_mesh",
    "require_enclosing",
    "require_likely_size",
    "require_solid",
    "tessellate",
    "unknown_format",
]
MESH_UNITS: Final[Mapping[str, float]] = {"mm": 1e-3, "m": 1.0, "inch": 0.0254}  # [m]
FORMATS: Final = frozenset({".stl", ".obj", ".ply", ".dae"})
MAX_BYTES: Final = 100_000_000
MIN_EXTENT: Final = 1e-3  # [m] smaller things in a robot cell are errors of the unit
MAX_EXTENT: Final = 20.0  # [m] larger ones as well
FLAT_FRACTION: Final = 1e-6  # [-] of the extent: thinner than this is a sheet without inside
CORNER_LAGS: Final = (1, 2, 3)  # places between two of the four triangles at an edge that two solids share
CREASE: Final = np.radians(30.0)  # [rad] sharper edges stay edges when normals are smoothed


def recall_mesh(key: Key | None, *, source: str) -> Mesh | None:
    """The mesh that was kept under a key; None when there is none, or one that cannot be a mesh."""
    arrays = recall(key)
    if arrays is None or len(arrays) != 3 or not _is_mesh(*arrays):
        return None
    vertices, faces, is_closed = arrays
    return Mesh(
        vertices=vertices.astype(np.float64), faces=faces.astype(np.int64), source=source, is_closed=bool(is_closed)
    )


def keep_mesh(key: Key | None, mesh: Mesh) -> None:
    """Keep a mesh, but not where it came from: files with other names may hold the same."""
    keep(key, (mesh.vertices, mesh.faces, np.array(mesh.is_closed)))


def _is_mesh(vertices: NDArray[np.generic], faces: NDArray[np.generic], is_closed: NDArray[np.generic]) -> bool:
    """Whether the arrays have the types and shapes of a mesh, and every triangle has its corners."""
    types = [array.dtype.name for array in (vertices, faces, is_closed)]
    if types != ["float64", "int64", "bool"] or is_closed.shape != ():
        return False
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3 or not faces.size:
        return False
    is_in_range = bool(np.all((faces.astype(np.int64) >= 0) & (faces.astype(np.int64) < len(vertices))))
    return is_in_range and bool(np.all(np.isfinite(vertices.astype(np.float64))))


def read_mesh(path: Path, *, scale: float | ArrayLike = 1.0) -> Mesh:
    """Read an STL, OBJ, PLY or COLLADA file and check that nothing of it got lost.

    What was read once is found again by the bytes of the file, as long as they and the reading code are the same. The
    unit of a COLLADA file is honoured, its up axis is not, as in the programs that URDFs are made for.

    The mesh is in [m]: equal vertices welded, triangles without area dropped, outward facing when it is closed.
    ``InputError`` where the file cannot be read, is damaged, too large, not finite or of an unlikely size.

    Args:
        scale: Metres per unit of the file, for COLLADA a factor after its own unit; one number or one for each axis;
            negative ones mirror.
    """
    return _cached_mesh(path, np.asarray(scale, dtype=float), unit=None, is_upright=False)


def read_drawing(path: Path, *, unit: str | None) -> Mesh:
    """Read a mesh file that stands alone, with z up: as `read_mesh`, but a COLLADA file's up axis is turned to z.

    The unit is a key of `MESH_UNITS`. A COLLADA file states its own: it may be None there, and must not differ.
    """
    factor = 1.0 if _is_collada(path.name) else MESH_UNITS[unit or ""]
    return _cached_mesh(path, np.asarray(factor), unit=unit, is_upright=True)


def _cached_mesh(path: Path, scale: Array, *, unit: str | None, is_upright: bool) -> Mesh:
    """Mesh in [m], recalled or read."""
    data = _read_bytes(path)
    options = f"{path.suffix.lower()} {unit} {is_upright}" if _is_collada(path.name) else path.suffix.lower()
    key = key_of("mesh", data, options.encode(), scale.tobytes())
    cached = recall_mesh(key, source=path.name)
    if cached is not None:
        return cached
    if _is_collada(path.name):
        loose, meter = parse_collada(data, path.name, is_upright=is_upright)
        if unit is not None and not np.isclose(meter, MESH_UNITS[unit], rtol=1e-6, atol=0.0):
            raise InputError(f"{path.name}: states a unit of {meter:g} m, got unit: {unit}: leave out the unit")
    else:
        loose = parse_mesh(data, path.name)
    mesh = _checked_mesh(loose, path.name, scale=scale)
    keep_mesh(key, mesh)
    return mesh


def _checked_mesh(loose: Triangles, name: str, *, scale: Array) -> Mesh:
    """Mesh in [m] from loose triangles."""
    vertices, faces = loose
    require_likely_count(len(faces), name)
    if not np.all(np.isfinite(vertices)):
        raise InputError(f"{name}: expected finite coordinates, got {int(np.sum(~np.isfinite(vertices)))} others")
    factors = np.broadcast_to(scale, (3,))
    if not np.all(np.isfinite(factors)) or np.any(factors == 0.0):
        raise InputError(f"{name}: expected scale factors that are finite and not zero, got {factors.tolist()}")
    with np.errstate(over="ignore"):
        vertices = vertices * factors
    is_used = np.zeros(len(vertices), dtype=bool)
    is_used[faces] = True
    require_likely_size(vertices[is_used], name)
    outward = faces if np.prod(np.sign(factors)) > 0.0 else faces[:, ::-1]
    mesh = make_mesh(vertices, outward, source=name)
    require_few_pieces(mesh.faces, source=name)
    return mesh


def _is_collada(name: str) -> bool:
    return name.lower().endswith(".dae")


def require_solid(mesh: Mesh) -> None:
    """Refuse a mesh that does not enclose a volume; several closed bodies that touch do."""
    if not mesh.is_closed:
        raise InputError(f"{_not_closed(mesh)}: repair the mesh")
    if is_flat(mesh) or mesh_volume(mesh) <= 0.0:
        raise InputError(f"{mesh.source}: expected a solid, got a surface that encloses no volume")


def require_enclosing(mesh: Mesh) -> None:
    """Refuse a mesh without a defined inside: an open surface."""
    if not mesh.is_closed:
        raise InputError(
            f"{_not_closed(mesh)}: repair the mesh, or set open: true, with which no point counts as inside it"
        )


def open_edges(mesh: Mesh) -> int:
    """Edges at which a surface does not go on as that of a solid does."""
    edges = count_edges(mesh.faces)
    return edges.open + edges.crowded + edges.turned


def is_flat(mesh: Mesh) -> bool:
    """Whether all vertices lie in one plane, up to a millionth of the extent."""
    centred = mesh.vertices - mesh.vertices.mean(axis=0)
    spread = np.linalg.eigvalsh(centred.T @ centred)
    return bool(spread[0] <= FLAT_FRACTION**2 * spread[2])


def corner_normals(mesh: Mesh, crease: float = CREASE) -> Array:
    """Unit outward normal at each corner of each triangle, shape (M, 3, 3).

    Neighbours that meet at less than ``crease`` in [rad] share their normals at the common vertices, weighted by the
    angle of each triangle there; sharper edges stay sharp.
    """
    corner = mesh.vertices[mesh.faces]
    ahead = np.roll(corner, -1, axis=1) - corner
    behind = np.roll(corner, 1, axis=1) - corner
    normals = np.cross(ahead[:, 0], behind[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    angles = np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), np.sum(ahead * behind, axis=2))
    group = components(mesh.faces.size, _smooth_corners(mesh.faces, normals, crease=crease))
    summed = np.zeros((mesh.faces.size, 3))
    np.add.at(summed, group, (angles[..., None] * normals[:, None, :]).reshape(-1, 3))
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    flat = np.repeat(normals, 3, axis=0)
    shared = length[group] > FLAT_FRACTION  # the normals round a spike can cancel: there the triangle's own one stands
    smooth: Array = np.where(shared, summed[group] / np.where(shared, length[group], 1.0), flat)
    return smooth.reshape(-1, 3, 3)


def normals_at(mesh: Mesh, points: Array, faces: Indices) -> Array:
    """Outward normals at points on triangles, shape (N, 3): the corners' normals, by barycentric coordinates.

    Points are in the frame of the mesh, shape (N, 3), ``faces`` are their triangles, shape (N,).
    """
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces[faces]], 1, 0)
    across = np.cross(b - a, c - a)
    square = np.sum(across * across, axis=1)
    weight_b = np.sum(np.cross(points - a, c - a) * across, axis=1) / square
    weight_c = np.sum(np.cross(b - a, points - a) * across, axis=1) / square
    weights = np.stack([1.0 - weight_b - weight_c, weight_b, weight_c], axis=1)
    blended = np.einsum("ni,nij->nj", weights, corner_normals(mesh)[faces])
    return blended / np.linalg.norm(blended, axis=1, keepdims=True)


def contains(mesh: Mesh, points: Array) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Say which points, shape (N, 3), lie inside the mesh: those its surface winds round, shape (N,).

    A few open edges do no harm. Points on the surface itself may count either way.
    """
    surface = outer_surface(mesh)
    return np.asarray(winding_numbers(surface.vertices[surface.faces], points) > 0.5, dtype=np.bool_)


def _not_closed(mesh: Mesh) -> str:
    """What is wrong with a surface that is not that of one solid."""
    edges, ends = count_edges(mesh.faces), open_edge_ends(mesh.faces)
    place = ""
    if len(ends):
        longest = int(np.argmax(np.linalg.norm(np.diff(mesh.vertices[ends], axis=1)[:, 0], axis=1)))
        a, b = (", ".join(f"{1e3 * x + 0.0:.6g}" for x in mesh.vertices[end]) for end in ends[longest])
        place = f", the longest open one from ({a}) to ({b}) mm"
    return (
        f"{mesh.source}: expected a closed surface, got {edges.open} open edges, {edges.crowded} edges of more "
        f"than two triangles and {edges.turned} edges whose triangles face opposite directions{place}"
    )


def _read_bytes(path: Path) -> bytes:
    """Bytes of a regular file of acceptable size."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(f"{path.name}: expected a regular file")
        if status.st_size > MAX_BYTES:
            raise InputError(
                f"{path.name}: expected at most {MAX_BYTES // 10**6} MB, got {status.st_size / 1e6:.0f} MB"
            )
        return path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path.name}: the mesh file cannot be read: {reason.lower()}") from None


def require_likely_size(vertices: Array, name: str) -> None:
    """Refuse meshes that are too small or too large for a robot cell, with a hint at the unit."""
    extent = float(np.ptp(vertices, axis=0).max())
    if not extent <= MAX_EXTENT:
        raise InputError(f"{name}: expected an extent of at most {MAX_EXTENT:g} m, got {extent:.6g} m: is the unit mm?")
    if extent < MIN_EXTENT:
        raise InputError(f"{name}: expected an extent of at least 1 mm, got {extent:.6g} m: is the unit m or inch?")
    if not float(np.abs(vertices).max()) <= MAX_EXTENT:
        far = float(np.abs(vertices).max())
        raise InputError(f"{name}: expected a mesh within {MAX_EXTENT:g} m of its origin, got a vertex at {far:.6g} m")


def _smooth_corners(faces: np.ndarray, normals: Array, *, crease: float) -> np.ndarray:
    """Pairs of corners, numbered ``3 face + place``, that meet at a vertex across an edge that is no crease."""
    a, b = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(a, b), np.maximum(a, b)
    corner = np.arange(faces.size)
    after = 3 * (corner // 3) + (corner + 1) % 3
    low_corner, high_corner = np.where(a < b, corner, after), np.where(a < b, after, corner)
    order = np.lexsort((high, low))
    first = np.concatenate([order[:-lag] for lag in CORNER_LAGS])
    second = np.concatenate([order[lag:] for lag in CORNER_LAGS])
    joined = (low[first] == low[second]) & (high[first] == high[second])
    cosine = np.sum(normals[first // 3] * normals[second // 3], axis=1)
    smooth = joined & (cosine > np.cos(crease))
    first, second = first[smooth], second[smooth]
    return np.concatenate(
        [
            np.stack([low_corner[first], low_corner[second]], axis=1),
            np.stack([high_corner[first], high_corner[second]], axis=1),
        ]
    )
