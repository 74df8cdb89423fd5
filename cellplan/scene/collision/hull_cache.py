"""Hulls of meshes: found by a search in the child process, and kept from run to run."""

from collections.abc import Iterable, Sequence

import numpy as np

from cellplan.cache import Key, key_of
from cellplan.geometry.mesh.cache import keep_mesh, recall_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.guard import Guard, in_child
from cellplan.scene.collision.hulls import convex_hull, is_hull


def hull_of(mesh: Mesh) -> Mesh:
    """Smallest convex mesh that holds a mesh, as ``convex_hull`` finds it.

    One that was kept is proved once more to be convex and to hold these very vertices: that is cheap.

    Raises:
        InputError: The mesh is flat.
        OverrunError: The search crashed, or took too long or too much memory.
    """
    cached = _recalled(mesh)
    if cached is not None:
        return cached
    guard = Guard(file=mesh.source, worker="the search for the hull")
    hull: Mesh = in_child(convex_hull, mesh, guard=guard)
    keep_mesh(_key(mesh), hull)
    return hull


def keep_hulls(meshes: Sequence[Mesh]) -> None:
    """Find the hulls of some meshes and keep them for other processes; only in a process that the search may end.

    Raises:
        InputError: A mesh is flat.
    """
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
