"""Hulls of meshes: found by a search in the child process, and kept from run to run."""

import numpy as np

from cellplan.cache import key_of
from cellplan.collision.hulls import convex_hull, is_hull
from cellplan.geometry.mesh.cache import keep_mesh, recall_mesh
from cellplan.geometry.shapes import Mesh
from cellplan.guard import Guard, in_child


def hull_of(mesh: Mesh) -> Mesh:
    """Smallest convex mesh that holds a mesh, as ``convex_hull`` finds it.

    One that was kept is proved once more to be convex and to hold these very vertices: that is cheap.

    Raises:
        InputError: The mesh is flat.
        OverrunError: The search crashed, or took too long or too much memory.
    """
    key = key_of("hull", np.ascontiguousarray(mesh.vertices).tobytes())
    kept = recall_mesh(key, source=mesh.source)
    if kept is not None and is_hull(kept, mesh.vertices):
        return kept
    guard = Guard(file=mesh.source, worker="the search for the hull")
    found: Mesh = in_child(convex_hull, mesh, guard=guard)
    keep_mesh(key, found)
    return found
