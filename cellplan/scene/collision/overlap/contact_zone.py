"""The surfaces of bodies outside the zones in which a tool may touch the part, and a holder the part that it grips."""

from functools import lru_cache
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.mesh.tessellation import halved, tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.scene.collision.bodies import fine_segments

SLIVER_AREA: Final = 1e-12  # [m2] twice the area of triangles that are left out: clipping leaves some without any
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


def outside_grip(shape: Solid, X_ST: Array, *, radius: float, layer: float) -> tuple[Mesh | None, bool]:
    """Surface of a solid outside a ball round the tool tip and outside a thin layer round the plane of the tip.

    The layer is what lets a broad pad lie flat on the part; behind it nothing may touch.

    None when there is none; and whether some of it was inside. A round solid is taken a little larger than it is. The
    tip has its pose in the solid's frame, z out of the tool; the radius of the ball and half the thickness of the layer
    are in [m].
    """
    surface, is_in_ball = outside_zone(shape, X_ST[:3, 3], radius)
    if surface is None:
        return None, is_in_ball
    triangles = surface.vertices[surface.faces]
    height = (triangles - X_ST[:3, 3]) @ X_ST[:3, 2]
    is_in_layer = bool(np.any((height.min(axis=1) < layer) & (height.max(axis=1) > -layer)))
    if not is_in_layer:
        return surface, is_in_ball
    outside = np.concatenate([_above(triangles, height - layer), _above(triangles, -layer - height)])
    sides = outside[:, 1:] - outside[:, :1]
    outside = outside[np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) > SLIVER_AREA]
    if not len(outside):
        return None, True
    faces = np.arange(3 * len(outside)).reshape(-1, 3)
    return make_mesh(outside.reshape(-1, 3), faces, source="tool outside the contact zone"), True


def _above(triangles: Array, height: Array) -> Array:
    """The parts of triangles, shape (K, 3, 3), whose height, shape (K, 3), is not negative."""
    positive = height >= 0.0
    count = positive.sum(axis=1)
    whole = triangles[count == 3]
    single, s = _turned(triangles, height, positive, is_odd=count == 1)
    tip = np.stack([single[:, 0], _crossing(single, s, 1), _crossing(single, s, 2)], axis=1)
    double, d = _turned(triangles, height, ~positive, is_odd=count == 2)
    b, c = _crossing(double, d, 1), _crossing(double, d, 2)
    near = np.stack([b, double[:, 1], double[:, 2]], axis=1)
    far = np.stack([b, double[:, 2], c], axis=1)
    return np.concatenate([whole, tip, near, far])


def _turned(triangles: Array, height: Array, flags: Flags, *, is_odd: Flags) -> tuple[Array, Array]:
    """Some triangles and their heights, turned so that the one corner with a flag is the first."""
    first = np.argmax(flags[is_odd], axis=1)
    order = (first[:, None] + np.arange(3)) % 3
    row = np.arange(len(order))[:, None]
    return triangles[is_odd][row, order], height[is_odd][row, order]


def _crossing(triangles: Array, height: Array, corner: int) -> Array:
    """Where the side from the first corner to another one has no height, shape (K, 3)."""
    share = height[:, :1] / (height[:, :1] - height[:, corner : corner + 1])
    return triangles[:, 0] + share * (triangles[:, corner] - triangles[:, 0])
