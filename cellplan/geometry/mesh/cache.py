"""Meshes that are kept from run to run, as the arrays they are made of."""

import numpy as np
from numpy.typing import NDArray

from cellplan.cache import Key, keep, recall
from cellplan.geometry.shapes import Mesh


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
