"""Bodies that are not convex, as closed meshes."""

import numpy as np

from cellplan.geometry.shapes import Mesh


def tube(inner: float, outer: float, length: float, *, sides: int = 48) -> Mesh:
    """A straight tube along z, open at both ends."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    places = [(inner, -0.5), (inner, 0.5), (outer, -0.5), (outer, 0.5)]
    vertices = np.concatenate([np.column_stack([r * ring, np.full(sides, z * length)]) for r, z in places])
    k, after = np.arange(sides), (np.arange(sides) + 1) % sides
    low_in, high_in, low_out, high_out = (first * sides for first in range(4))
    quads = [
        (low_out + k, low_out + after, high_out + after, high_out + k),
        (low_in + after, low_in + k, high_in + k, high_in + after),
        (low_in + k, low_in + after, low_out + after, low_out + k),
        (high_in + after, high_in + k, high_out + k, high_out + after),
    ]
    faces = [np.column_stack([quad[a] for a in corners]) for quad in quads for corners in ((0, 1, 2), (0, 2, 3))]
    return Mesh(vertices=vertices, faces=np.concatenate(faces), source="tube", is_closed=True)
