"""The surface of a tool outside the zone round its tip in which it may touch the part."""

from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.mesh.tessellation import halved, tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.bodies import fine_segments

FINEST_FRACTION: Final = 1.0 / 16.0  # [-] of the zone's radius: triangles across its border are cut down to this
ROUND_SIDE_COUNT: Final = 96  # [-] sides of a sphere or the caps of a capsule: 0.1 % of the radius


def outside_zone(shape: Solid, centre: Array, radius: float) -> tuple[Mesh | None, bool]:
    """Surface of a solid outside a ball, None when there is none, and whether the ball holds any of it.

    Triangles across the border are cut down to 1/16 of the radius and kept unless they lie wholly inside, so the
    surface reaches into the zone by no more than that: the strict side.

    A round solid is taken a little larger than it is. The ball has its centre in the solid's frame in [m], shape (3,),
    and a radius in [m].
    """
    return _outside_zone(shape, (float(centre[0]), float(centre[1]), float(centre[2])), radius)


@lru_cache(maxsize=64)
def _outside_zone(shape: Solid, centre: tuple[float, float, float], radius: float) -> tuple[Mesh | None, bool]:
    """What ``outside_zone`` returns; a cell is made computable more than once, with the same tools."""
    mesh, middle = _surface(shape), np.array(centre)
    open_ = mesh.vertices[mesh.faces]
    outside, is_cut = [], False
    while len(open_):
        inside = np.linalg.norm(open_ - middle, axis=2).max(axis=1) <= radius
        is_cut |= bool(np.any(inside))
        open_ = open_[~inside]
        longest = np.linalg.norm(open_ - np.roll(open_, -1, axis=1), axis=2).max(axis=1, initial=0.0)
        across = (_distance_bound(open_, middle, longest) < radius) & (longest > FINEST_FRACTION * radius)
        outside.append(open_[~across])
        open_ = halved(open_[across])
    triangles = np.concatenate(outside) if outside else np.empty((0, 3, 3))
    if not len(triangles):
        return None, is_cut
    faces = np.arange(3 * len(triangles)).reshape(-1, 3)
    return make_mesh(triangles.reshape(-1, 3), faces, source="tool outside the contact zone"), is_cut


def _surface(shape: Solid) -> Mesh:
    """Surface of a solid as triangles, on or outside the true one."""
    match shape:
        case Cylinder(radius):
            return tessellate(shape, fine_segments(radius))
        case Capsule() | Sphere():
            return tessellate(shape, ROUND_SIDE_COUNT)
        case _:
            return tessellate(shape)


def _distance_bound(triangles: Array, centre: Array, longest: Array) -> Array:
    """Lower bound of the distance from a point to triangles, shape (M, 3, 3): by their planes and their corners."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normal, axis=1)
    to_plane = np.abs(np.einsum("ij,ij->i", normal, centre - triangles[:, 0])) / np.where(area > 0.0, area, np.inf)
    to_corner = np.linalg.norm(triangles - centre, axis=2).min(axis=1)
    return np.maximum(to_plane, to_corner - longest)
