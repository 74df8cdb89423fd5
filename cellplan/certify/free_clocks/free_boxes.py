"""Boxes of two programs, a stretch of the one times a stretch of the other: what is proved of a pair in each of them.

The distance in the middle of a box, less how far each body gets from where it is there, is a lower bound in the whole
box. So is what a direction proves between the farthest places of both bodies along it: these are where a stretch begins
or ends, but for what the paths stray from their chords. Bodies that pass each other thus need no small boxes.

Directions are tried first, many boxes at once; the engine is asked where that is not enough, and a box of which too
little is proved is cut in two.
"""

from dataclasses import dataclass, fields, replace
from typing import Final

import numpy as np

from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.line_distances import line_gaps
from cellplan.geometry.shapes import Mesh
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.distance import APART_TOL, TIGHT_TOL, TOUCHING, Reading, quick_reading
from cellplan.scene.collision.hull_supports import HullSupports
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.separation import separation

ROUNDING_TOL: Final = 1e-9  # [m] taken off every bound, so that rounding never lifts it above the truth
SMALL: Final = 1e-4  # [m] reach of boxes in which surfaces are measured where hulls prove the middle but not the box
SLOW_COUNT: Final = 3000  # distances of surfaces, of one search; hulls say less but true things after them


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Some boxes."""

    pair: Indices  # pair of each among those of the search, shape (M,)
    rows: Array  # stretch of the first program and of the second, as (from, to, from, to), shape (M, 4)
    low: Array  # no distance in the box is below this in [m], shape (M,)
    gap: Array  # lower bound of the distance in its middle in [m], shape (M,)
    reach: Array  # how far each of both bodies gets from its place in the middle in [m], shape (M, 2)
    n: Array  # direction in the world that proves the gap, shape (M, 3); zero without one
    is_read: Flags  # whether the engine was asked in its middle, shape (M,)

    def __len__(self) -> int:
        """How many there are."""
        return len(self.pair)

    def some(self, which: Flags | Indices | list[int]) -> "Boxes":
        """Some of them."""
        return Boxes(*(getattr(self, field.name)[which] for field in fields(self)))

    @property
    def middles(self) -> Array:
        """Their middles, shape (M, 2)."""
        return 0.5 * (self.rows[:, 0::2] + self.rows[:, 1::2])

    @staticmethod
    def joined(*parts: "Boxes") -> "Boxes":
        """All boxes of several."""
        return Boxes(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Boxes)))


class BoxBounds:
    """Bounds of the distance of some pairs of bodies in boxes.

    Attributes:
        ends: Two of the engine's bodies for each pair, the first and the second robot's, shape (P, 2).
        readings: Number of readings so far.
    """

    def __init__(self, motion: FreeMotion, ends: Indices) -> None:
        """Take the shapes of the bodies."""
        bodies = motion.scene.engine.bodies
        self.ends, self.readings, self._motion, self._slow = ends, 0, motion, 0
        self._engine, self._supports = motion.scene.engine, HullSupports(bodies)
        self._looseness = np.array([body.looseness for body in bodies])
        self._lines = np.array([body.ends for body in bodies]).reshape(-1, 2, 3)

    def start(self, pair: Indices, rows: Array) -> Boxes:
        """Boxes of which nothing is known yet; see ``Boxes``."""
        count = len(pair)
        return self._bounded(pair, rows, low=np.full(count, -np.inf), n=np.zeros((count, 3)))

    def halves(self, boxes: Boxes) -> Boxes:
        """Both halves of each box, cut across the stretch in which a body gets farther."""
        second = boxes.reach[:, 1] > boxes.reach[:, 0]
        lower, upper, middles = boxes.rows.copy(), boxes.rows.copy(), boxes.middles
        for side, mine in enumerate((~second, second)):
            lower[mine, 2 * side + 1] = upper[mine, 2 * side] = middles[mine, side]
        pair, low, n = (np.concatenate([column, column]) for column in (boxes.pair, boxes.low, boxes.n))
        return self._bounded(pair, np.concatenate([lower, upper]), low=low, n=n)

    def sharpened(self, boxes: Boxes) -> Boxes:
        """The boxes with what the direction of each proves between the farthest places of both bodies along it."""
        reach = np.zeros(len(boxes))
        for side, sign in ((0, 1.0), (1, -1.0)):
            bodies, spans, n = self.ends[boxes.pair, side], boxes.rows[:, 2 * side : 2 * side + 2], sign * boxes.n
            ends = [self._along(bodies, *self._motion.poses(bodies, spans[:, end]), n) for end in (0, 1)]
            reach += np.maximum(*ends) + self._motion.stray(bodies, spans[:, 0], spans[:, 1]) + self._looseness[bodies]
        proved = np.where(boxes.n.any(axis=1), -reach - ROUNDING_TOL, -np.inf)
        return replace(boxes, low=np.maximum(boxes.low, proved))

    def _along(self, bodies: Indices, R: Array, p: Array, n: Array) -> Array:
        """How far some bodies reach along unit directions from the origin of the world in [m], shape (M,)."""
        return np.einsum("mi,mi->m", n, p) + self._supports.reach(bodies, _turned(np.swapaxes(R, 1, 2), n))

    def read(self, boxes: Boxes, goals: Array) -> tuple[Boxes, list[Reading]]:
        """Ask the engine in the middle of each box; exactly, where the hulls do not reach a goal in [m], shape (M,).

        In a small box they are to reach it everywhere: else cuts would follow the places where they just do.
        """
        poses, reach = self._placed(boxes), boxes.reach.sum(axis=1)
        goals = goals + np.where(reach < SMALL, reach + 2.0 * ROUNDING_TOL, 0.0)
        readings = [
            self._reading(int(u), int(v), poses, sample=place, goal=float(goals[place]))
            for place, (u, v) in enumerate(self.ends[boxes.pair])
        ]
        self.readings += len(readings)
        gap = np.maximum(boxes.gap, [reading.bound for reading in readings])
        gap[[reading.touches for reading in readings]] = 0.0
        n = np.array(
            [np.zeros(3) if reading.direction is None else _unit(reading.direction) for reading in readings]
        ).reshape(-1, 3)
        low = np.maximum(boxes.low, gap - reach - ROUNDING_TOL)
        read = np.ones(len(boxes), dtype=bool)
        return Boxes(boxes.pair, boxes.rows, low, gap, boxes.reach, n, read), readings

    def _reading(self, u: int, v: int, poses: BodyPoses, *, sample: int, goal: float) -> Reading:
        """Reading at one sample; a body inside another one counts as a touch."""
        engine, ends = self._engine, (u, v)
        if not any(isinstance(engine.bodies[index].shape, Mesh) for index in ends):
            return quick_reading(engine, ends, poses, sample=sample)
        proposed, n = engine.proposed_direction(u, v, poses, sample=sample)
        (a, X_a), (b, X_b) = ((engine.bodies[k], (poses.R[k, sample], poses.p[k, sample])) for k in ends)
        bound = separation(a.hull, b.hull, n, X_first=X_a, X_second=X_b) - a.looseness - b.looseness
        is_exact = a.is_convex and b.is_convex and bound >= proposed - TIGHT_TOL
        if bound > APART_TOL and (is_exact or bound >= goal):
            return Reading(False, bound, is_exact, n)
        return self._by_surfaces(ends, poses, Reading(False, max(0.0, bound), False, n), sample=sample)

    def _by_surfaces(self, ends: tuple[int, int], poses: BodyPoses, hulls: Reading, *, sample: int) -> Reading:
        """Reading of two bodies of which the hulls prove too little; ``hulls`` is what they prove.

        Surfaces are measured as triangles: of all that touches the distance is zero, and that takes a tenth of the
        time of the question whether a mesh touches a body of another kind.
        """
        if hulls.bound <= APART_TOL:
            if is_inside(self._engine, ends, poses, sample=sample):
                return TOUCHING
            hulls = replace(hulls, bound=0.0, direction=None)
        elif self._slow >= SLOW_COUNT:
            return hulls
        self._slow += 1
        distance = self._engine.surface_distance(*ends, poses, sample=sample)
        if not max(distance, hulls.bound) > APART_TOL:
            return TOUCHING
        return replace(hulls, bound=max(distance, hulls.bound), is_exact=True)

    def _placed(self, boxes: Boxes) -> BodyPoses:
        """Poses of the two bodies of each box in its middle, one sample a box; those of others are not numbers."""
        count, middles = len(boxes), boxes.middles
        R, p = (np.full((len(self._engine.bodies), count, *shape), np.nan) for shape in ((3, 3), (3,)))
        for side in (0, 1):
            bodies = self.ends[boxes.pair, side]
            R[bodies, np.arange(count)], p[bodies, np.arange(count)] = self._motion.poses(bodies, middles[:, side])
        return BodyPoses(R, p)

    def _bounded(self, pair: Indices, rows: Array, *, low: Array, n: Array) -> Boxes:
        """Boxes with the bounds that directions prove: the one given, and those of the spheres and of the lines."""
        middles, reach = 0.5 * (rows[:, 0::2] + rows[:, 1::2]), np.empty((len(pair), 2))
        placed = []
        for side in (0, 1):
            bodies, spans = self.ends[pair, side], rows[:, 2 * side : 2 * side + 2]
            at = self._motion.travel(bodies, middles[:, side])
            ends = [self._motion.travel(bodies, spans[:, end]) for end in (0, 1)]
            reach[:, side] = np.maximum(ends[1] - at, at - ends[0])
            placed.append((bodies, *self._motion.poses(bodies, middles[:, side])))
        gap, n = self._gaps(placed, n)
        low = np.maximum(low, gap - reach.sum(axis=1) - ROUNDING_TOL)
        return Boxes(pair, rows, low, gap, reach, n, np.zeros(len(pair), dtype=bool))

    def _gaps(self, placed: list[tuple[Indices, Array, Array]], n: Array) -> tuple[Array, Array]:
        """Best proved distance in [m] of the bodies in the middles, shape (M,), and its direction, shape (M, 3)."""
        (a, R_a, p_a), (b, R_b, p_b) = placed
        lines = [
            np.stack([_turned(R, self._lines[bodies, end]) + p for end in (0, 1)], axis=1) for bodies, R, p in placed
        ]
        between = line_gaps(*lines)
        apart = lines[1].mean(axis=1) - lines[0].mean(axis=1)
        best = np.full(len(a), -np.inf)
        for direction in (n, _units(between), _units(apart)):
            along = -self._along(a, R_a, p_a, direction) - self._along(b, R_b, p_b, -direction)
            along = np.where(direction.any(axis=1), along, -np.inf)
            n = np.where((along > best)[:, None], direction, n)
            np.maximum(best, along, out=best)
        best -= self._looseness[a] + self._looseness[b]
        return best, n


def is_below(reading: Reading, goal: float) -> bool:
    """Whether a reading shows that two bodies are nearer than a goal in [m]."""
    return reading.touches or (reading.is_exact and reading.bound < goal)


def _turned(R: Array, vectors: Array) -> Array:
    """Each vector turned by its own rotation, shape (M, 3)."""
    return (R @ vectors[..., None])[..., 0]


def _unit(direction: Array) -> Array:
    length = float(np.linalg.norm(direction))
    return direction / length if length > 0.0 else np.zeros(3)


def _units(directions: Array) -> Array:
    """Directions at unit length, shape (M, 3); zero where there is none."""
    length = np.linalg.norm(directions, axis=1, keepdims=True)
    return np.where(length > 0.0, directions / np.where(length > 0.0, length, 1.0), 0.0)
