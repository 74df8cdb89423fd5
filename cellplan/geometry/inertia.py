"""Volume, centre of mass and inertia of solids of uniform density."""

from typing import Final

import numpy as np

from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array

VOLUME_TOL: Final = 1e-15  # [m^3] a smaller volume is none


def centre_and_inertia(solid: Solid) -> tuple[Array, Array]:
    """Centre of mass in [m], shape (3,), and inertia about it per mass in [m^2], shape (3, 3), in the solid's frame.

    A mesh without a volume counts as a point in the middle of its vertices.
    """
    match solid:
        case Box(size):
            xx, yy, zz = (edge * edge / 12.0 for edge in size)
            return np.zeros(3), np.diag([yy + zz, xx + zz, xx + yy])
        case Sphere(radius):
            return np.zeros(3), 0.4 * radius**2 * np.eye(3)
        case Cylinder(radius, length):
            side = radius**2 / 4.0 + length**2 / 12.0
            return np.zeros(3), np.diag([side, side, 0.5 * radius**2])
        case Capsule(radius, length):
            return np.zeros(3), _capsule(radius, length)
        case Mesh():
            return _mesh(solid)
    raise TypeError(f"not a solid: {solid!r}")


def volume(solid: Solid) -> float:
    """Volume in [m^3], of a mesh without its sign."""
    match solid:
        case Box(size):
            return float(np.prod(size))
        case Sphere(radius):
            return float(4.0 / 3.0 * np.pi * radius**3)
        case Cylinder(radius, length):
            return float(np.pi * radius**2 * length)
        case Capsule(radius, length):
            return float(np.pi * radius**2 * (length + 4.0 / 3.0 * radius))
        case Mesh():
            return abs(float(np.linalg.det(solid.vertices[solid.faces]).sum() / 6.0))
    raise TypeError(f"not a solid: {solid!r}")


def _capsule(radius: float, length: float) -> Array:
    """Inertia per mass of a cylinder with two half balls, length measured between their centres."""
    shaft, ball = length, 4.0 / 3.0 * radius  # volumes by the area of the section
    whole = shaft + ball
    along = (0.5 * shaft + 0.4 * ball) * radius**2 / whole
    side_shaft = shaft * (radius**2 / 4.0 + length**2 / 12.0)
    side_ball = ball * (0.4 * radius**2 + length**2 / 4.0 + 3.0 / 8.0 * length * radius)
    side = (side_shaft + side_ball) / whole
    return np.diag([side, side, along])


def _mesh(mesh: Mesh) -> tuple[Array, Array]:
    """Sums over the tetrahedra between the faces and a point, signed by their orientation."""
    middle = mesh.vertices.mean(axis=0)
    corners = (mesh.vertices - middle)[mesh.faces]
    volumes = np.linalg.det(corners) / 6.0
    volume = float(volumes.sum())
    if abs(volume) < VOLUME_TOL:
        return middle, np.zeros((3, 3))
    centre = (volumes[:, None] * corners.sum(axis=1)).sum(axis=0) / (4.0 * volume)
    sums = corners.sum(axis=1)
    products = np.einsum("nki,nkj->nij", corners, corners) + sums[:, :, None] * sums[:, None, :]
    second = (volumes[:, None, None] * products).sum(axis=0) / (20.0 * volume) - np.outer(centre, centre)
    return middle + centre, np.trace(second) * np.eye(3) - second
