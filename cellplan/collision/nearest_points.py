"""Nearest points of two bodies at one sample, and of a body and a half-space."""

from dataclasses import dataclass

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.distance import TIGHT_TOL
from cellplan.collision.engine import Engine
from cellplan.collision.overlap.containment import is_inside
from cellplan.collision.separation import separation
from cellplan.geometry.shapes import support_point
from cellplan.geometry.transforms import Array


@dataclass(frozen=True, slots=True, eq=False)
class NearestPoints:
    """Where two bodies are nearest."""

    distance: float  # in [m]; zero when they touch
    first: Array  # point of the first body in the world, shape (3,)
    second: Array  # point of the second body in the world, shape (3,)
    normal: Array  # unit direction from the first to the second, shape (3,)


def nearest_points(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> NearestPoints:
    """Nearest points of two solids, within 0.1 mm of the true distance.

    Those of convex bodies come from their solids, once the direction between them is proved to be the right one; all
    others come from the surfaces. Bodies that touch have no nearest points: there the middles of their bounding spheres
    say which way is out.
    """
    first, second = pair
    a, b = engine.bodies[first], engine.bodies[second]
    X_a, X_b = ((poses.R[body, sample], poses.p[body, sample]) for body in pair)
    points: tuple[Array, Array] | None = None
    if a.is_convex and b.is_convex:
        points = engine.proposed_points(first, second, poses, sample=sample)
        apart = float(np.linalg.norm(points[1] - points[0]))
        proved = separation(a.hull, b.hull, points[1] - points[0], X_first=X_a, X_second=X_b)
        if not (proved > TIGHT_TOL and proved >= apart - TIGHT_TOL):
            points = None
    if points is None and not _touch(engine, pair, poses, sample=sample):
        points = engine.surface_points(first, second, poses, sample=sample)
    if points is None:
        middles = (X_a[0] @ a.centre + X_a[1], X_b[0] @ b.centre + X_b[1])
        return NearestPoints(0.0, *middles, _unit(middles[1] - middles[0]))
    apart = float(np.linalg.norm(points[1] - points[0]))
    return NearestPoints(apart, *points, _unit(points[1] - points[0]))


def point_above(engine: Engine, solid: int, poses: BodyPoses, *, X_WS: Array, sample: int) -> NearestPoints:
    """Lowest point of a solid above a half-space, and the point of its plane right below.

    Args:
        solid: Index of the solid.
        X_WS: Pose of the half-space; everything below its xy plane is solid.
    """
    up = X_WS[:3, 2]
    R, p = poses.R[solid, sample], poses.p[solid, sample]
    lowest = R @ support_point(engine.bodies[solid].hull, -(up @ R)) + p
    height = float(up @ (lowest - X_WS[:3, 3]))
    return NearestPoints(max(height, 0.0), lowest, lowest - height * up, -up)


def _touch(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> bool:
    """Whether two bodies touch, or one lies inside the other."""
    return engine.touch(*pair, poses, sample=sample) or is_inside(engine, pair, poses, sample=sample)


def _unit(direction: Array) -> Array:
    """The direction at unit length; upward where there is none."""
    length = float(np.linalg.norm(direction))
    return direction / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
