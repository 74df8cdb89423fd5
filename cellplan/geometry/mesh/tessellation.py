"""Primitive shapes turned into meshes that hold the shape: never smaller than the truth."""

from functools import lru_cache

import numpy as np

from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array


def tessellate(shape: Solid, segments: int = 48) -> Mesh:
    """Closed mesh round a solid; every point of the solid lies inside or on it. A mesh is returned unchanged.

    Distances measured to the mesh are therefore never above the true ones; they are below by at most
    ``radius (1/cos(pi/segments)^2 - 1)``, about.

    Args:
        segments: Sides round the circumference of a round body, at least 4.
    """
    if segments < 4:
        raise ValueError(f"a round body needs at least 4 segments, got {segments}")
    return shape if isinstance(shape, Mesh) else _tessellated(shape, segments)


@lru_cache(maxsize=512)
def _tessellated(shape: Box | Cylinder | Capsule | Sphere, segments: int) -> Mesh:
    """The mesh round a primitive shape; a cell has many equal ones, and is made computable more than once."""
    match shape:
        case Box(size):
            vertices, faces = _box(np.asarray(size))
        case Cylinder(radius, length):
            outer, end = radius / float(np.cos(np.pi / segments)), 0.5 * length
            vertices, faces = _turned([(outer, -end), (outer, end)], (-end, end), segments=segments)
        case Capsule(radius, length):
            vertices, faces = _rounded(radius, length, segments=segments)
        case Sphere(radius):
            vertices, faces = _rounded(radius, 0.0, segments=segments)
    mesh = make_mesh(vertices, faces, source=type(shape).__name__.lower())
    mesh.vertices.setflags(write=False)
    mesh.faces.setflags(write=False)
    return mesh


def halved(triangles: Array) -> Array:
    """Triangles, shape (M, 3, 3), each cut in two through the middle of its longest side, shape (2 M, 3, 3)."""
    sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
    first = np.argmax(sides, axis=1)
    row = np.arange(len(triangles))
    a, b, c = (triangles[row, (first + k) % 3] for k in range(3))
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def _box(size: Array) -> tuple[Array, np.ndarray]:
    """Eight corners and twelve triangles."""
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return signs * size, np.array([corner for a, b, c, d in sides for corner in ((a, b, c), (a, c, d))])


def _rounded(radius: float, length: float, *, segments: int) -> tuple[Array, np.ndarray]:
    """Sphere cut open at its equator and drawn apart by ``length``."""
    bands = max(2, segments // 4)  # from the equator to a pole
    latitude = 0.5 * np.pi * np.arange(bands) / bands
    vertices, faces = _turned([(np.cos(a), np.sin(a)) for a in latitude], (0.0, 1.0), segments=segments)
    corner = vertices[faces]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    is_cap = corner[:, :, 2].max(axis=1) > 0.0  # all but the disc at the equator
    depth = np.sum(normals * corner[:, 0], axis=1)[is_cap] / np.linalg.norm(normals[is_cap], axis=1)
    grown = radius / float(depth.min())
    half = [(grown * np.cos(a), grown * np.sin(a) + 0.5 * length) for a in latitude]
    upper = half if length > 0.0 else half[1:]
    rings = [(r, -z) for r, z in half[::-1]] + upper
    pole = grown + 0.5 * length
    return _turned(rings, (-pole, pole), segments=segments)


def _turned(rings: list[tuple[float, float]], poles: tuple[float, float], *, segments: int) -> tuple[Array, np.ndarray]:
    """Surface of revolution about z: rings of (radius, height) from below, closed by a pole at each end."""
    angle = 2.0 * np.pi * np.arange(segments) / segments
    circles = [np.stack([r * np.cos(angle), r * np.sin(angle), np.full(segments, z)], axis=1) for r, z in rings]
    vertices = np.concatenate([*circles, [[0.0, 0.0, poles[0]], [0.0, 0.0, poles[1]]]])
    here = np.arange(segments)
    ahead = (here + 1) % segments
    faces = []
    for k in range(len(rings) - 1):
        low, high = k * segments, (k + 1) * segments
        faces.append(np.stack([low + here, low + ahead, high + ahead], axis=1))
        faces.append(np.stack([low + here, high + ahead, high + here], axis=1))
    bottom, top = np.full(segments, len(vertices) - 2), np.full(segments, len(vertices) - 1)
    last = (len(rings) - 1) * segments
    faces.append(np.stack([ahead, here, bottom], axis=1))
    faces.append(np.stack([last + here, last + ahead, top], axis=1))
    return vertices, np.concatenate(faces)
