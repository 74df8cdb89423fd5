"""Distance of two bodies at one sample: proved, never above the truth, and within 0.1 mm of it where that is needed."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import Mesh, support_point
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.separation import separation

APART_TOL: Final = 1e-9  # [m] a proved distance above this is not rounding
TIGHT_TOL: Final = 2.5e-5  # [m] a proof this near to the proposed distance counts as the distance


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """Distance reading of two bodies at one sample."""

    touches: bool  # whether they touch
    bound: float  # proved distance in [m], never above the truth; zero when they touch or nothing is proved
    is_exact: bool  # whether the truth is above the bound by no more than ``2 TIGHT_TOL``
    direction: Array | None  # from first to second in the world, shape (3,), that proves it on hulls; None without one


TOUCHING: Final = Reading(True, 0.0, True, None)


def quick_reading(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> Reading:
    """Cheap reading: whether the bodies touch for certain, and a distance that may be loose."""
    first, second = pair
    a, b = engine.bodies[first], engine.bodies[second]
    is_cheap = not (isinstance(a.shape, Mesh) or isinstance(b.shape, Mesh))
    if is_cheap and engine.touch(first, second, poses, sample=sample):
        return TOUCHING
    proposed, n = engine.proposed_direction(first, second, poses, sample=sample)
    bound = separation(
        a.hull,
        b.hull,
        n,
        X_first=(poses.R[first, sample], poses.p[first, sample]),
        X_second=(poses.R[second, sample], poses.p[second, sample]),
    )
    bound -= a.looseness + b.looseness
    if bound > APART_TOL:
        return Reading(False, bound, a.is_convex and b.is_convex and bound >= proposed - TIGHT_TOL, n)
    if not is_cheap and engine.touch(first, second, poses, sample=sample):
        return TOUCHING
    return Reading(False, 0.0, False, None)


def exact_reading(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int, reading: Reading) -> Reading:
    """Exact reading of two bodies of which a cheap one is at hand."""
    if reading.is_exact:
        return reading
    distance = engine.surface_distance(*pair, poses, sample=sample)
    return Reading(False, max(distance, reading.bound), True, reading.direction if reading.bound > 0.0 else None)


def is_nearer(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int, limit: float) -> bool:
    """Whether two bodies touch, lie in each other, or are nearer than a limit in [m], ``APART_TOL`` or more."""
    reading = quick_reading(engine, pair, poses, sample=sample)
    if reading.touches or reading.bound >= limit:
        return reading.touches
    if reading.bound <= APART_TOL and is_inside(engine, pair, poses, sample=sample):
        return True
    return exact_reading(engine, pair, poses, sample=sample, reading=reading).bound < limit


def measure(engine: Engine, pair: tuple[int, int], poses: BodyPoses, *, sample: int) -> Reading:
    """Exact reading of two bodies."""
    return exact_reading(engine, pair, poses, sample=sample, reading=quick_reading(engine, pair, poses, sample=sample))


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

    Everything below the xy plane of the half-space, with its pose ``X_WS``, is solid.
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


def first_touching(engine: Engine, pairs: Indices, poses: BodyPoses, *, sample: int) -> int | None:
    """Place of the first of the pairs, shape (P, 2), that touches at one sample, or None."""
    centres = engine.sphere_centres(poses, sample=sample)
    apart = centres[pairs[:, 0]] - centres[pairs[:, 1]]
    reach = engine.radii[pairs[:, 0]] + engine.radii[pairs[:, 1]]
    for place in np.flatnonzero(np.einsum("ij,ij->i", apart, apart) <= (reach + APART_TOL) ** 2):
        pair = (int(pairs[place, 0]), int(pairs[place, 1]))
        reading = quick_reading(engine, pair, poses, sample=sample)
        if reading.touches or (reading.bound <= APART_TOL and is_inside(engine, pair, poses, sample=sample)):
            return int(place)
    return None
