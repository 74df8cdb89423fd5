"""Signed distances of convex hulls by coal, a few microseconds each: quick and unproved, for searches only.

What they find is judged afterwards by the certificate, whose engine is another one.
"""

from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere, support_point
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.separation import separation

TOLERANCE: Final = 1e-9  # [m] of the iteration: far below what any clearance is stated to
OVERLAP_TOLERANCE: Final = 1e-6  # [m] likewise of overlaps: below, coal finds none of many round bodies
MOST_STEPS: Final = 500  # of one iteration
CACHE_SIZE: Final = 8  # [-] objects kept for each body
FARTHEST: Final = 1e3  # [m] a deeper overlap is none: where its search fails coal returns the largest number there is


class SignedDistances:
    """Signed distances of pairs of bodies; coal's objects are built when they are first needed."""

    def __init__(self) -> None:
        """Start without any object."""
        self._shapes: dict[int, tuple[CollisionBody, Any]] = {}  # by identity of the body, which is kept alive
        self._pairs: dict[tuple[int, int], Any] = {}
        self._placed: list[Any] = []

    def below(
        self, bodies: tuple[CollisionBody, ...], ends: Indices, poses: BodyPoses, samples: Indices, *, within: float
    ) -> tuple[Indices, Array, Array]:
        """Places of queries, shape (F,), nearer than ``within`` in [m], their distances, and the points of both bodies.

        A query is a pair of bodies, ``ends`` of shape (M, 2), at a sample, shape (M,). Distances, shape (F,), are
        negative where hulls overlap by so much; the points that are so far from each other are in the world in [m],
        shape (F, 2, 3).
        """
        import coal  # a search needs it, a verification does not

        if len(self._shapes) > CACHE_SIZE * len(bodies):  # of a search that gives bodies other shapes again and again
            self._shapes.clear()
            self._pairs.clear()
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        request.gjk_tolerance, request.epa_tolerance = TOLERANCE, OVERLAP_TOLERANCE
        request.gjk_max_iterations = MOST_STEPS
        count = poses.p.shape[1]
        kinds, kind = np.unique(ends[:, 0] * len(bodies) + ends[:, 1], return_inverse=True)
        queries = [self._query(bodies[key // len(bodies)], bodies[key % len(bodies)]) for key in kinds.tolist()]
        spots, spot = np.unique(ends * count + samples[:, None], return_inverse=True)
        body, at = np.divmod(spots, count)
        placed = self._poses(poses.R[body, at], poses.p[body, at])
        places, distances, points = list[int](), list[float](), np.empty((len(ends), 2, 3))
        sought = zip(kind.tolist(), spot.reshape(-1, 2).tolist(), strict=True)
        for place, (query, (a, b)) in enumerate(sought):
            result.clear()
            distance = queries[query](placed[a], placed[b], request, result)
            if distance < within:
                pair = points[len(places)]
                if distance > -FARTHEST:
                    pair[0], pair[1] = result.getNearestPoint1(), result.getNearestPoint2()
                else:
                    one, other = ends[place].tolist()
                    where = (one, other, int(samples[place]))
                    distance, pair[0], pair[1] = _along_centres(bodies[one], bodies[other], poses, where)
                places.append(place)
                distances.append(distance)
        return np.array(places, dtype=np.intp), np.array(distances), points[: len(places)]

    def _poses(self, R: Array, p: Array) -> list[Any]:
        """Coal's poses, shape (N, 3, 3) and (N, 3); the objects are used again, as making them takes twice as long."""
        import coal

        self._placed += [coal.Transform3s() for _ in range(len(p) - len(self._placed))]
        for pose, rotation, position in zip(self._placed, R, p, strict=False):
            pose.setRotation(rotation)
            pose.setTranslation(position)
        return self._placed

    def _query(self, first: CollisionBody, second: CollisionBody) -> Any:
        """Coal's query for two bodies."""
        import coal

        key = (id(first), id(second))
        if key not in self._pairs:
            self._pairs[key] = coal.ComputeDistance(self._shape(first), self._shape(second))
        return self._pairs[key]

    def _shape(self, body: CollisionBody) -> Any:
        """Coal's object for the hull of a body."""
        if id(body) not in self._shapes:
            self._shapes[id(body)] = body, _geometry(body.hull)
        return self._shapes[id(body)][1]


def _along_centres(
    first: CollisionBody, second: CollisionBody, poses: BodyPoses, where: tuple[int, int, int]
) -> tuple[float, Array, Array]:
    """Overlap of two hulls along the line of their centres, no less than along any other, and its two points."""
    a, b, sample = where
    (R_a, p_a), (R_b, p_b) = ((poses.R[body, sample], poses.p[body, sample]) for body in (a, b))
    apart = R_b @ second.centre + p_b - R_a @ first.centre - p_a
    n = apart / np.linalg.norm(apart) if np.any(apart) else np.array([0.0, 0.0, 1.0])
    distance = separation(first.hull, second.hull, n, X_first=(R_a, p_a), X_second=(R_b, p_b))
    point = R_a @ support_point(first.hull, n @ R_a) + p_a
    return distance, point, point + distance * n


def _geometry(hull: Solid) -> Any:
    """Coal's geometry of a convex solid."""
    import coal

    match hull:
        case Box(size):
            return coal.Box(*size)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Mesh(vertices):
            points = coal.StdVec_Vec3s()
            points.extend(list(vertices))
            return coal.Convex.convexHull(points, True, "Qt")
