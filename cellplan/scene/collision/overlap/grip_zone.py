"""The surfaces of a holder's flange and tool outside the zone in which they may touch the part that they grip."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Mesh, Solid
from cellplan.scene.collision.overlap.contact_zone import outside_zone

SLIVER_AREA: Final = 1e-12  # [m2] twice the area of triangles that are left out: clipping leaves some without any


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
