"""Queries to FCL: which of two solids touch, and how far apart their convex hulls or surfaces are.

FCL's yes and no are trusted; of its distances only those between two surfaces of triangles. Every other distance is a
proposal that ``separation`` has to prove. Poses are checked before (``bodies.checked_poses``), requests
and results are new for each question because FCL leaves old values in them.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import fcl
import numpy as np

from cellplan.errors import CellplanError
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.signed_distance import SignedDistances

NO_ANSWER: Final = "collision: the engine returned no valid distance between '{}' and '{}'"


@dataclass(slots=True)
class QueryCounts:
    """Number of contact queries and of distance queries."""

    contacts: int = 0
    distances: int = 0


class Engine:
    """Collision queries on pairs of a set of bodies; built once, safe to send to another process.

    Attributes:
        bodies: The bodies.
        centres: Centres of their bounding spheres, each in the body's own frame in [m], shape (B, 3).
        radii: Radii of these spheres in [m], shape (B,).
        queries: Number of queries so far, those of pieces of the bodies included.
        signed: Quick distances of their hulls, for searches.
    """

    def __init__(self, bodies: Sequence[CollisionBody]) -> None:
        """Store the bodies; FCL's objects are built when they are first needed."""
        self.bodies = tuple(bodies)
        self.centres = np.array([body.centre for body in self.bodies]).reshape(-1, 3)
        self.radii = np.array([body.radius for body in self.bodies])
        self.queries = QueryCounts()
        self.signed = SignedDistances()
        self._objects: dict[tuple[str, int], Any] = {}  # by kind and identity of the body
        self._pieces: dict[int, tuple[CollisionBody, ...]] = {}  # by identity of the whole
        self._parts: dict[tuple[int, int], Engine] = {}

    def __reduce__(self) -> tuple[type["Engine"], tuple[tuple[CollisionBody, ...]]]:
        """State without FCL's own objects, which another process builds anew."""
        return Engine, (self.bodies,)

    def part(self, other: int, whole: int, pieces: Callable[[CollisionBody], Sequence[CollisionBody]]) -> "Engine":
        """An engine for one body and the pieces of another, counted here; pieces are made once for each body."""
        key = id(self.bodies[whole])
        if key not in self._pieces:
            self._pieces[key] = tuple(pieces(self.bodies[whole]))
        known = self._parts.get((other, whole))
        if known is None:
            known = self._parts[other, whole] = Engine((self.bodies[other], *self._pieces[key]))
            known.queries, known._objects, known._pieces = self.queries, self._objects, self._pieces
        return known

    def with_bodies(self, changed: Mapping[int, CollisionBody]) -> "Engine":
        """The engine with some bodies in place of others; what FCL has built of all the rest is shared."""
        other = Engine([changed.get(index, body) for index, body in enumerate(self.bodies)])
        unchanged = {id(body) for body in other.bodies if body not in changed.values()}
        other.signed = self.signed
        other._objects = {key: value for key, value in self._objects.items() if key[1] in unchanged}
        other._pieces = {key: value for key, value in self._pieces.items() if key in unchanged}
        return other

    def sphere_centres(self, poses: BodyPoses, *, sample: int) -> Array:
        """Centres of the bounding spheres in the world at a sample in [m], shape (B, 3)."""
        return (poses.R[:, sample] @ self.centres[..., None])[..., 0] + poses.p[:, sample]

    def touch(self, first: int, second: int, poses: BodyPoses, *, sample: int) -> bool:
        """Whether two bodies touch at a sample. A mesh is its surface; see ``overlap.containment`` for its inside."""
        self.queries.contacts += 1
        a, b = self._placed("solid", first, poses, sample), self._placed("solid", second, poses, sample)
        return bool(fcl.collide(a, b, fcl.CollisionRequest(), fcl.CollisionResult()) > 0)

    def proposed_direction(self, first: int, second: int, poses: BodyPoses, *, sample: int) -> tuple[float, Array]:
        """FCL's distance in [m] between the hulls of two bodies and the direction from first to second: unproven."""
        distance, result = _nearest(self, "hull", (first, second), poses, sample)
        p, q = result.nearest_points
        return distance, np.subtract(q, p)

    def proposed_points(self, first: int, second: int, poses: BodyPoses, *, sample: int) -> tuple[Array, Array]:
        """FCL's nearest points of the hulls of two bodies in the world, shape (3,) each: unproven."""
        p, q = _nearest(self, "hull", (first, second), poses, sample)[1].nearest_points
        return np.array(p), np.array(q)

    def surface_points(self, first: int, second: int, poses: BodyPoses, *, sample: int) -> tuple[Array, Array] | None:
        """Nearest points of the surfaces of two bodies in the world, shape (3,) each; None when they touch.

        Exact but slow.
        """
        distance, result = _nearest(self, "core", (first, second), poses, sample)
        p, q = (np.array(point) for point in result.nearest_points)
        inner, outer = self.bodies[first].inflation, self.bodies[second].inflation
        if not distance > inner + outer:
            return None
        along = (q - p) / np.linalg.norm(q - p)
        return p + inner * along, q - outer * along

    def surface_distance(self, first: int, second: int, poses: BodyPoses, *, sample: int) -> float:
        """Distance in [m] between two bodies that do not touch, never above the truth; exact but slow."""
        self.queries.distances += 1
        a, b = self._placed("core", first, poses, sample), self._placed("core", second, poses, sample)
        distance = float(fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()))
        if not np.isfinite(distance):
            raise CellplanError(NO_ANSWER.format(self.bodies[first].name, self.bodies[second].name))
        return max(0.0, distance - self.bodies[first].inflation - self.bodies[second].inflation)

    def _placed(self, kind: str, index: int, poses: BodyPoses, sample: int) -> Any:
        """FCL's object for the solid, hull or core of a body, moved to its pose."""
        key = (kind, id(self.bodies[index]))
        geometry = self._objects.get(key)
        if geometry is None:
            geometry = self._objects[key] = self._built(kind, index)
        geometry.setTransform(fcl.Transform(poses.R[index, sample], poses.p[index, sample]))
        return geometry

    def _built(self, kind: str, index: int) -> Any:
        """FCL's object for the solid, hull or core of a body."""
        body = self.bodies[index]
        if kind == "hull" and isinstance(body.hull, Mesh):
            return fcl.CollisionObject(_convex(body.hull))
        return fcl.CollisionObject(_geometry(body.core if kind == "core" else body.shape))


def _nearest(engine: Engine, kind: str, pair: tuple[int, int], poses: BodyPoses, sample: int) -> tuple[float, Any]:
    """FCL's distance in [m] between the hulls or cores of two bodies, and its result with the nearest points."""
    engine.queries.distances += 1
    a, b = (engine._placed(kind, index, poses, sample) for index in pair)
    result = fcl.DistanceResult()
    return float(fcl.distance(a, b, fcl.DistanceRequest(enable_nearest_points=True), result)), result


def nearest_triangle(engine: Engine, mesh: int, other: int, poses: BodyPoses, *, sample: int) -> tuple[int, Array]:
    """The triangle of a mesh that is nearest to another body, and the vector to that body in [m], shape (3,).

    Where an edge is nearest, it is any of its triangles. The vector is zero between bodies that touch: FCL's nearest
    points are none there.
    """
    distance, result = _nearest(engine, "core", (mesh, other), poses, sample)
    p, q = result.nearest_points
    return int(result.b1), np.subtract(q, p) if distance > 0.0 else np.zeros(3)


def _geometry(shape: Solid) -> Any:
    """FCL's geometry of a solid; a mesh becomes a tree of triangles."""
    match shape:
        case Box(size):
            return fcl.Box(*size)
        case Cylinder(radius, length):
            return fcl.Cylinder(radius, length)
        case Capsule(radius, length):
            return fcl.Capsule(radius, length)
        case Sphere(radius):
            return fcl.Sphere(radius)
        case Mesh(vertices, faces):
            tree = fcl.BVHModel()
            tree.beginModel(len(vertices), len(faces))
            tree.addSubModel(np.ascontiguousarray(vertices), np.ascontiguousarray(faces))
            tree.endModel()
            return tree


def _convex(hull: Mesh) -> Any:
    """FCL's convex polytope."""
    corners = np.column_stack([np.full(len(hull.faces), 3), hull.faces]).ravel()
    return fcl.Convex(np.ascontiguousarray(hull.vertices), len(hull.faces), corners)
