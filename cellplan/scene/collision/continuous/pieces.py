"""A body that is not convex, taken apart: what holds for every piece of its surface holds for the whole.

The hull of such a body may be much nearer to another body than its surface is, and then no direction proves the true
distance. Hulls of small pieces fit better; a single triangle is its own hull.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.shapes import Mesh, bounding_capsule
from cellplan.geometry.transforms import Array
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody
from cellplan.scene.collision.continuous.motion_bound import ROUNDING_TOL, Bends, BodyMotion, Pair
from cellplan.scene.collision.distance import APART_TOL, TIGHT_TOL, Reading, quick_reading
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.separation import separation

SMALL_COUNT: Final = 8  # [-] triangles of a piece up to which its distance is measured
PIECE_COUNT: Final = 4  # [-] pieces that a body is taken apart into at once; those that are far need no more


@dataclass(frozen=True, slots=True, eq=False)
class PieceMotion:
    """The motion of one body and of the pieces of another, which move like the body they are pieces of."""

    whole: BodyMotion  # the motion of the two bodies
    pair: Pair  # the two bodies in that motion
    engine: Engine  # the one body first, then the pieces of the other
    is_first_split: bool  # whether it is the first of the pair that was taken apart
    poses: BodyPoses  # where they are
    bend: Bends  # how much the paths of the two bodies bend
    seen: tuple[Array, Array]  # rotations and positions of the second of the pair seen from the first

    @classmethod
    def of(cls, whole: BodyMotion, pair: Pair, engine: Engine, *, is_first_split: bool) -> "PieceMotion":
        """Give every piece the poses of its body."""
        split, other = pair if is_first_split else pair[::-1]
        bodies = [other] + [split] * (len(engine.bodies) - 1)
        poses = BodyPoses(whole.poses.R[bodies], whole.poses.p[bodies])
        return cls(whole, pair, engine, is_first_split, poses, whole.bends(pair), whole.relative(pair))

    def piece_pair(self, piece: int) -> Pair:
        """A piece and the other body, in the order of the pair."""
        return (1 + piece, 0) if self.is_first_split else (0, 1 + piece)

    def bends(self, pair: Pair) -> Bends:  # noqa: ARG002 - the same for every piece
        """How much the paths of a piece and the other body bend: no more than those of the whole bodies."""
        return self.bend

    def relative(self, pair: Pair) -> tuple[Array, Array]:  # noqa: ARG002 - the same for every piece
        """Rotations and positions of the second of the pair seen from the first."""
        return self.seen

    def sphere_bounds(self, pair: Pair) -> Array:
        """Lower bound of the distance of two bounding spheres in each step in [m], shape (n - 1,)."""
        first, second = pair
        bodies, (R, p) = self.engine.bodies, self.seen
        seen = R @ bodies[second].centre + p - bodies[first].centre
        gaps = np.linalg.norm(seen, axis=1)
        low: Array = 0.5 * (gaps[1:] + gaps[:-1] - np.linalg.norm(np.diff(seen, axis=0), axis=1))
        return low - bodies[first].radius - bodies[second].radius - self.bend.second / 8.0

    def finer(self, pair: Pair, step: int, *, parts: int) -> "PieceMotion":  # noqa: ARG002 - for every piece
        """One step cut into equal parts."""
        fine = self.whole.finer(self.pair, step, parts=parts)
        return PieceMotion.of(fine, self.pair, self.engine, is_first_split=self.is_first_split)


def can_be_split(body: CollisionBody) -> bool:
    """Whether a body is not convex and has more than one triangle."""
    return not body.is_convex and isinstance(body.shape, Mesh) and len(body.shape.faces) > 1


def split(engine: Engine, pair: Pair) -> tuple[Engine, bool]:
    """The pieces of that body of a pair which has more triangles, after the other one; and whether it is the first.

    At least one of the two must be one that can be split. It is taken apart once only.
    """
    sizes = [len(engine.bodies[k].core.faces) if can_be_split(engine.bodies[k]) else 0 for k in pair]
    is_first = sizes[0] > sizes[1]
    whole, other = pair if is_first else pair[::-1]
    return engine.part(other, whole, _pieces), is_first


def read_piece(engine: Engine, pair: Pair, poses: BodyPoses, *, sample: int, goal: float) -> tuple[Reading, bool]:
    """Reading of a piece and another body, and whether a direction proves all of it, or reaches the goal.

    Where the hulls do not prove the goal, small pieces are measured exactly; large ones are not, as their own pieces
    are less work.

    The piece may come first or second; the goal is a distance in [m].
    """
    reading = quick_reading(engine, pair, poses, sample=sample)
    if reading.touches or reading.is_exact or reading.bound >= goal:
        return reading, True
    dented = [engine.bodies[k] for k in pair if can_be_split(engine.bodies[k])]
    if len(dented) == 1 and len(dented[0].core.faces) > SMALL_COUNT:
        return reading, False
    return _exact(engine, pair, poses, sample=sample, reading=reading)


def _exact(engine: Engine, pair: Pair, poses: BodyPoses, *, sample: int, reading: Reading) -> tuple[Reading, bool]:
    """Exact reading of two small bodies by their surfaces, and whether a direction proves it."""
    first, second = pair
    points = engine.surface_points(first, second, poses, sample=sample)
    if points is None:
        return Reading(False, 0.0, True, None), False
    apart = points[1] - points[0]
    distance = max(0.0, float(np.linalg.norm(apart)) - ROUNDING_TOL)
    X_first, X_second = ((poses.R[body, sample], poses.p[body, sample]) for body in pair)
    a, b = engine.bodies[first], engine.bodies[second]
    proved = separation(a.hull, b.hull, apart, X_first=X_first, X_second=X_second)
    proved -= a.looseness + b.looseness
    n: Array | None = apart
    if proved < reading.bound:
        proved, n = reading.bound, reading.direction
    bound = max(distance, proved)
    return Reading(False, bound, True, n if proved > APART_TOL else None), proved >= bound - TIGHT_TOL


def _pieces(body: CollisionBody) -> list[CollisionBody]:
    """The surface of a body cut again and again across its longest extent, each half with as many triangles."""
    mesh = body.core
    groups = [np.arange(len(mesh.faces))]
    while len(groups) < PIECE_COUNT:
        halves = [half for group in groups for half in _halves(mesh, group)]
        if len(halves) == len(groups):
            break
        groups = halves
    return [_piece(body, group) for group in groups]


def _halves(mesh: Mesh, group: np.ndarray) -> list[np.ndarray]:
    """A group of triangles in two halves; as it is when there is one only."""
    if len(group) < 2:
        return [group]
    middles = mesh.vertices[mesh.faces[group]].mean(axis=1)
    order = np.argsort(middles[:, int(np.argmax(np.ptp(middles, axis=0)))], kind="stable")
    half = len(group) // 2
    return [group[order[:half]], group[order[half:]]]


def _piece(body: CollisionBody, group: np.ndarray) -> CollisionBody:
    """Some triangles of a body as a body of their own; of its hull only the corners are needed, which are its own."""
    used, faces = np.unique(body.core.faces[group], return_inverse=True)
    surface = Mesh(
        vertices=body.core.vertices[used], faces=faces.reshape(-1, 3), source=body.core.source, is_closed=False
    )
    centre = surface.vertices.mean(axis=0)  # within the body, as bends are those of its points
    radius = float(np.linalg.norm(surface.vertices - centre, axis=1).max())
    ends, girth = bounding_capsule(surface)
    return CollisionBody(
        name=body.name,
        shape=surface,
        hull=surface,
        looseness=0.0,
        is_convex=len(group) == 1,
        inflation=0.0,
        centre=centre,
        radius=radius,
        ends=ends,
        girth=girth,
        witnesses=surface.vertices[:1],
    )
