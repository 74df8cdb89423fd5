"""Solid shapes of robot links, tools, parts and fixtures: their support functions and bounding spheres.

Every shape lives in its own frame, centred on the origin; cylinders and capsules stand along z. A half-space is the
region z <= 0. Lengths are in [m].
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array

FACING_TOL: Final = 1e-9  # [-] a direction this near to the normal of a face is the normal: rounding


@dataclass(frozen=True, slots=True)
class Box:
    """Cuboid with edge lengths ``size`` along x, y, z."""

    size: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Circular cylinder along z."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within ``radius`` of a segment of ``length`` along z; the whole is ``length + 2 radius`` long."""

    radius: float
    length: float


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball round the origin."""

    radius: float


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangle mesh; the vertices need not be centred."""

    vertices: Array  # corner points in [m], shape (V, 3)
    # corner indices of each triangle, counter-clockwise from outside, shape (M, 3)
    faces: np.ndarray[tuple[int, int], np.dtype[np.int64]]
    source: str  # file name for messages
    is_closed: bool  # whether the surface encloses a volume: it is that of a solid, or of several that share edges
    # whether it stands for a solid although it is not closed, as meshes of links often do: what its triangles wind
    # round by more than one half, either way, counts as inside
    is_leaky: bool = False


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """All points with z <= 0: the floor."""


Solid = Box | Cylinder | Capsule | Sphere | Mesh
Shape = Solid | HalfSpace


def support(shape: Solid, directions: Array) -> Array:
    """Largest ``x . n`` over all points x of the shape, for directions of shape (..., 3) in the shape's frame."""
    n = directions
    reach: Array
    match shape:
        case Box(size):
            reach = np.abs(n) @ (0.5 * np.asarray(size))
        case Cylinder(radius, length):
            across = np.sqrt(n[..., 0] * n[..., 0] + n[..., 1] * n[..., 1])  # unit directions: nothing overflows
            reach = radius * across + 0.5 * length * np.abs(n[..., 2])
        case Capsule(radius, length):
            reach = radius * np.sqrt(np.einsum("...i,...i->...", n, n)) + 0.5 * length * np.abs(n[..., 2])
        case Sphere(radius):
            reach = radius * np.sqrt(np.einsum("...i,...i->...", n, n))
        case Mesh():
            reach = np.max(n @ shape.vertices.T, axis=-1)
    return reach


def support_point(shape: Solid, n: Array) -> Array:
    """Point of the shape farthest along a unit direction, shape (3,); the middle where it is a face or an edge."""
    toward = np.where(np.abs(n) > FACING_TOL, np.sign(n), 0.0)
    point: Array
    match shape:
        case Box(size):
            point = toward * (0.5 * np.asarray(size))
        case Cylinder(radius, length):
            across = float(np.hypot(n[0], n[1]))
            point = np.array([0.0, 0.0, 0.5 * length * toward[2]])
            point[:2] = radius * n[:2] / across if across > FACING_TOL else 0.0
        case Capsule(radius, length):
            point = radius * n + np.array([0.0, 0.0, 0.5 * length * toward[2]])
        case Sphere(radius):
            point = radius * n
        case Mesh():
            reach = shape.vertices @ n
            highest = reach >= reach.max() - FACING_TOL * float(np.ptp(reach))
            point = 0.5 * (shape.vertices[highest].min(axis=0) + shape.vertices[highest].max(axis=0))
    return point


def bounding_box(shape: Solid) -> tuple[Array, Array]:
    """Middle and half edges of the box along the shape's axes that holds it, shape (3,) each."""
    highest, lowest = support(shape, np.eye(3)), -support(shape, -np.eye(3))
    return 0.5 * (highest + lowest), 0.5 * (highest - lowest)


def bounding_sphere(shape: Solid) -> tuple[Array, float]:
    """Centre in the shape's frame and radius of a sphere that holds the whole shape."""
    match shape:
        case Box(size):
            return np.zeros(3), 0.5 * float(np.linalg.norm(size))
        case Cylinder(radius, length):
            return np.zeros(3), float(np.hypot(radius, 0.5 * length))
        case Capsule(radius, length):
            return np.zeros(3), radius + 0.5 * length
        case Sphere(radius):
            return np.zeros(3), radius
        case Mesh():
            centre = 0.5 * (shape.vertices.min(axis=0) + shape.vertices.max(axis=0))
            return centre, float(np.linalg.norm(shape.vertices - centre, axis=1).max())


def bounding_capsule(shape: Solid) -> tuple[Array, float]:
    """Both ends of a line in the shape's frame, shape (2, 3), and a radius round it that hold the whole shape.

    The line lies along the longest extent: for slender shapes this bounds much better than a sphere.
    """
    match shape:
        case Box(size):
            along = int(np.argmax(size))
            across = np.delete(size, along)
            return _line(np.zeros(3), along, 0.5 * size[along]), 0.5 * float(np.linalg.norm(across))
        case Cylinder(radius, length) | Capsule(radius, length):
            return _line(np.zeros(3), 2, 0.5 * length), radius
        case Sphere(radius):
            return np.zeros((2, 3)), radius
        case Mesh():
            low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
            along, centre = int(np.argmax(high - low)), 0.5 * (low + high)
            off = np.delete(shape.vertices - centre, along, axis=1)
            radius = float(np.sqrt(np.einsum("ij,ij->i", off, off).max()))
            return _line(centre, along, 0.5 * float(high[along] - low[along])), radius


def _line(centre: Array, along: int, half: float) -> Array:
    """Both ends of a line along an axis, shape (2, 3)."""
    ends = np.stack([centre, centre])
    ends[:, along] += (-half, half)
    return ends
