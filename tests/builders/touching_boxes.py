"""Parts of several closed boxes that touch, and the same parts as one solid."""

from itertools import product

import numpy as np

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Mesh
from cellplan.geometry.transforms import Array

Span = tuple[tuple[float, float, float], tuple[float, float, float]]

PLATE: Span = ((-0.1, -0.08, 0.0), (0.1, 0.08, 0.02))
RIB: Span = ((-0.06, -0.01, 0.02), (0.07, 0.015, 0.1))  # stands on the plate
CHEEK: Span = (
    (0.07, -0.08, 0.02),
    (0.1, 0.015, 0.1),
)  # stands on the plate too, beside the rib; shares an edge with it
FRAME: tuple[Span, ...] = (PLATE, RIB, CHEEK)


def box_of(span: Span) -> Mesh:
    """A box between two corners."""
    low, high = np.array(span)
    x, y, z = (high - low).tolist()
    box = tessellate(Box((x, y, z)))
    return Mesh(vertices=box.vertices + 0.5 * (low + high), faces=box.faces, source="box", is_closed=True)


def assembly(spans: tuple[Span, ...] = FRAME, *, inward: tuple[int, ...] = (), R: Array | None = None) -> Mesh:
    """Boxes as a CAD system writes them: each closed, with loose triangles in single precision."""
    corners = []
    for place, span in enumerate(spans):
        box = box_of(span)
        faces = box.faces[:, ::-1] if place in inward else box.faces
        corners.append(box.vertices[faces].reshape(-1, 3) @ (np.eye(3) if R is None else R).T)
    loose = np.concatenate(corners).astype(np.float32).astype(float)
    return make_mesh(loose, np.arange(len(loose)).reshape(-1, 3), source="assembly.stl")


def as_one(spans: tuple[Span, ...] = FRAME) -> Mesh:
    """The same as one solid: the cells of the grid of all planes, and the faces between what is in and what is out."""
    planes = [np.unique(np.array(spans)[:, :, axis]) for axis in range(3)]
    middles = [0.5 * (p[1:] + p[:-1]) for p in planes]

    def is_in(cell: tuple[int, ...]) -> bool:
        if any(not 0 <= k < len(middles[axis]) for axis, k in enumerate(cell)):
            return False
        at = np.array([middles[axis][k] for axis, k in enumerate(cell)])
        return any(bool(np.all((at > span[0]) & (at < span[1]))) for span in spans)

    triangles = []
    for cell in product(*(range(len(m)) for m in middles)):
        if not is_in(cell):
            continue
        low = np.array([planes[axis][k] for axis, k in enumerate(cell)])
        high = np.array([planes[axis][k + 1] for axis, k in enumerate(cell)])
        for axis, step in product(range(3), (-1, 1)):
            if is_in(tuple(k + step * (i == axis) for i, k in enumerate(cell))):
                continue
            u, v = (axis + 1) % 3, (axis + 2) % 3
            quad = np.tile(low if step < 0 else high, (4, 1))
            quad[:, u], quad[:, v] = [low[u], high[u], high[u], low[u]], [low[v], low[v], high[v], high[v]]
            quad = quad[::step]
            triangles += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    corners = np.concatenate(triangles)
    return make_mesh(corners, np.arange(len(corners)).reshape(-1, 3), source="one.stl")
