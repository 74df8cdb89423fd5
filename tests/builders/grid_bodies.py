"""Closed bodies made of the cells of a grid, such as profiles with lips and pockets."""

from collections.abc import Collection, Sequence
from itertools import product

import numpy as np

from cellplan.geometry.shapes import Mesh


def grid_body(edges: Sequence[Sequence[float]], cells: Collection[tuple[int, int, int]]) -> Mesh:
    """The union of some cells of a grid, its faces pointing out.

    Args:
        edges: Coordinates of the planes of the grid along x, y and z, ascending.
        cells: Indices of the cells along x, y and z.
    """
    index: dict[tuple[int, ...], int] = {}
    faces = []
    for cell, axis, side in product(sorted(cells), range(3), (0, 1)):
        other = list(cell)
        other[axis] += 2 * side - 1
        if tuple(other) in cells:
            continue
        u, v = (axis + 1) % 3, (axis + 2) % 3
        corners = []
        for du, dv in ((0, 0), (1, 0), (1, 1), (0, 1)):
            node = list(cell)
            node[axis] += side
            node[u] += du
            node[v] += dv
            corners.append(index.setdefault(tuple(node), len(index)))
        a, b, c, d = corners if side else corners[::-1]
        faces += [(a, b, c), (a, c, d)]
    vertices = np.array([[edges[axis][node[axis]] for axis in range(3)] for node in index])
    return Mesh(vertices=vertices, faces=np.array(faces), source="grid", is_closed=True)


def obj_text(mesh: Mesh) -> str:
    """The mesh as an OBJ file, in the unit of its vertices."""
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in mesh.vertices]
    return "\n".join([*lines, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces)]) + "\n"
