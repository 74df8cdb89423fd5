"""Points of many convex hulls that are farthest along given directions, in a few products for all of them."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import FACING_TOL, Box, Capsule, Cylinder, Mesh, Solid, Sphere, support_point
from cellplan.scene.collision.bodies import CollisionBody
from cellplan.scene.collision.separation import supports

COMPONENTS: Final = 5  # half edges along x, y and z, radius about z, radius of a ball that goes round all


class HullSupports:
    """Hulls of bodies, ready to be asked for their farthest points.

    All but meshes are boxes, discs or lines with something round about them: one formula serves them.
    """

    def __init__(self, bodies: Sequence[CollisionBody]) -> None:
        """Take the sizes of the hulls."""
        self._sizes = np.array([_sizes(body.hull) for body in bodies]).reshape(-1, COMPONENTS)
        self._meshes = {index: body.hull for index, body in enumerate(bodies) if isinstance(body.hull, Mesh)}

    def replaced(self, changed: Mapping[int, CollisionBody]) -> "HullSupports":
        """The same with some bodies in place of others."""
        other = HullSupports(())
        other._sizes = self._sizes.copy()
        other._sizes[list(changed)] = [_sizes(body.hull) for body in changed.values()]
        meshes = {index: body.hull for index, body in changed.items() if isinstance(body.hull, Mesh)}
        unchanged = {index: hull for index, hull in self._meshes.items() if index not in changed}
        other._meshes = {**unchanged, **meshes}
        return other

    def reach(self, bodies: Indices, n: Array) -> Array:
        """How far each body reaches along a unit direction from the origin of its own frame in [m], shape (M,).

        Bodies have the shape (M,), directions in their frames (M, 3).
        """
        sizes = self._sizes[bodies]
        extent = np.einsum("mi,mi->m", np.abs(n), sizes[:, :3])
        extent += sizes[:, 3] * np.hypot(n[:, 0], n[:, 1]) + sizes[:, 4]
        for index, hull in self._meshes.items():
            rows = np.flatnonzero(bodies == index)
            if len(rows):
                extent[rows] = supports(hull, n[rows])
        return extent

    def points(self, bodies: Indices, n: Array) -> Array:
        """The farthest points along unit directions, shape (M, 3), in the frames of bodies, shape (M,), in [m]."""
        sizes, toward = self._sizes[bodies], np.where(np.abs(n) > FACING_TOL, np.sign(n), 0.0)
        points = toward * sizes[:, :3] + sizes[:, 4:] * n
        across = np.hypot(n[:, 0], n[:, 1])
        round_about = np.where(across > FACING_TOL, sizes[:, 3] / np.where(across > FACING_TOL, across, 1.0), 0.0)
        points[:, :2] += round_about[:, None] * n[:, :2]
        for index, hull in self._meshes.items():
            for place in np.flatnonzero(bodies == index).tolist():
                points[place] = support_point(hull, n[place])
        return points


def _sizes(hull: Solid) -> tuple[float, ...]:
    """Half edges, radius about z and radius of the ball of a hull; zero for a mesh."""
    match hull:
        case Box(size):
            return (*(0.5 * float(edge) for edge in size), 0.0, 0.0)
        case Cylinder(radius, length):
            return (0.0, 0.0, 0.5 * length, radius, 0.0)
        case Capsule(radius, length):
            return (0.0, 0.0, 0.5 * length, 0.0, radius)
        case Sphere(radius):
            return (0.0, 0.0, 0.0, 0.0, radius)
        case Mesh():
            return (0.0,) * COMPONENTS
