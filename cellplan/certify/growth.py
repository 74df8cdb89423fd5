r"""Growth: pairs of bodies that begin nearer than is demanded, and only come apart.

Where a cell has stopped, tools are on the part, and bodies may be in each other. A motion away from there is judged by
pairs. Those that keep their demand at its beginning keep it throughout. All others may come apart only: with the signed
distance d, negative by the depth where the bodies overlap, and the largest one so far,

.. math:: d(t) \ge \max_{s \le t} d(s) - \epsilon

until the demand is met, which then holds to the end. While bodies overlap or all but touch, d is taken at moments
between which no point of the one comes farther than :math:`\tau`, seen from the other; d changes by no more than that
travel, so it falls by :math:`\tau / 2` at most below the smaller one of two neighbours. Farther apart the certificate
of distances is used, from block to block of the motion.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.certify.bound import Bound
from cellplan.certify.certify import certify
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_rows, scene_of_run
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.units import MM
from cellplan.scene.collision.distance import APART_TOL, is_nearer, measure
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.overlap.depth import overlap_depth
from cellplan.scene.collision.overlap.sunk_points import SUNK_TOL
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

TRAVEL: Final = 4e-5  # [m] between two moments at which overlapping bodies are measured …
TRAVEL_SHARE: Final = 0.02  # [-] … or this share of the depth at the beginning, where that is more
READING_TOL: Final = 5e-5  # [m] a distance is measured to within this …
DEPTH_SHARE: Final = 2e-3  # [-] … and a depth to within this share of it beside
APART: Final = 3e-4  # [m] bodies farther apart than this are judged by the certificate of distances
MOST_MOMENTS: Final = 4000  # of one pair while it overlaps
SAMPLED_SHARE: Final = 0.1  # [-] of the depth at the beginning, to which a search measures depths in meshes
SUNK_SHARE: Final = 0.5  # [-] of the tolerance of depths in meshes, that may be travelled between two of them
SAMPLED: Final = 10.0  # [-] times that travel for a search, after which everything is proved
MOST_LOOKED_AT: Final = 60  # rows at which blocks may end
BLOCKS: Final = 6  # of the motion in which a pair comes apart, each certified with the distance at its beginning


@dataclass(frozen=True, slots=True, kw_only=True)
class ComingApart:
    """A pair that begins nearer than is demanded."""

    names: tuple[str, str]  # its bodies
    begin: float  # signed distance at the beginning in [m]: negative by the depth where the bodies overlap
    end: float  # likewise at the end
    demand: float  # distance in [m] that is demanded of it
    row: int | None  # the first row from which on the demand is kept; None where it never is
    slack: float  # by how much in [m] the distance may fall, as the measurement leaves it open


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Growth:
    """What is proved of a motion away from a stopped state."""

    bound: Bound  # what is proved of the pairs that begin with the distance demanded of them
    apart: tuple[ComingApart, ...]  # the pairs that do not
    faults: tuple[tuple[tuple[str, str], str], ...]  # names of the bodies, and what is wrong, in one line

    @classmethod
    def of(cls, bound: Bound, separations: "Sequence[_Separation]") -> "Growth":
        """What is found of the pairs that begin too near, beside what is proved of the others."""
        judged = [separation.judged() for separation in separations]
        faults = tuple((pair.names, fault) for pair, fault in judged if fault)
        return cls(bound=bound, apart=tuple(pair for pair, _ in judged), faults=faults)

    @property
    def is_proved(self) -> bool:
        """Whether every pair keeps its demand, or only comes apart."""
        return not self.faults and self.bound.is_met

    @property
    def is_clear(self) -> bool:
        """Whether every pair keeps its demand at the end."""
        return self.is_proved and all(pair.row is not None for pair in self.apart)


def scene_at_stop(scene: Scene) -> Scene:
    """The scene of a cell that has stopped, from that in which all tools are at work.

    The full distance is demanded of every tool and the part, and what of a tool lies outside its contact zone must not
    touch the part.
    """
    clear = scene_of_run(scene, ())
    outside = [
        replace(pair, rule=Rule.CONTACT, reason="outside the contact zone of the tool")
        for pair, other in zip(scene.pairs, clear.pairs, strict=True)
        if pair.rule is Rule.PROCESS and other.rule is Rule.CLEARANCE and pair.solids not in {None, other.solids}
    ]
    return replace(clear, pairs=(*clear.pairs, *outside))


def rows_too_near(scene: Scene, q: Array) -> list[int]:
    """Pairs that do not keep their demand at one configuration, shape (nq,), by their places in the scene."""
    poses, engine = scene.body_poses(q[None]), scene.engine
    centres, near_rows = engine.sphere_centres(poses, sample=0), []
    for row, pair in enumerate(scene.pairs):
        if pair.is_ground:
            is_near = float(scene.ground_heights(pair, poses)[0]) < pair.least_distance
        elif pair.solids is None:
            continue
        else:
            first, second = pair.solids
            gap = float(np.linalg.norm(centres[first] - centres[second])) - engine.radii[first] - engine.radii[second]
            is_near = gap < pair.least_distance and is_nearer(
                engine, pair.solids, poses, sample=0, limit=pair.least_distance
            )
        if is_near:
            near_rows.append(row)
    return near_rows


def certify_growth(scene: Scene, q: Array, *, with_minimum: bool = False) -> Growth:
    """Judge a motion that begins where a cell has stopped, in ``scene_at_stop``; between rows joints move evenly.

    Joint positions are stacked, in [rad] or [m], shape (N, nq), N at least 2. The smallest distances of the pairs that
    begin with their demand may be searched for too.
    """
    near = rows_too_near(scene, q[0])
    others = scene_of_rows(scene, [row for row in range(len(scene.pairs)) if row not in set(near)])
    bound = certify(others, q, with_minimum=with_minimum, with_curves=False)
    return Growth.of(bound, [_Separation(scene, row, q) for row in near] if with_minimum or bound.is_met else [])


def sampled_growth(scene: Scene, q: Array, *, near: Sequence[int], moved: Collection[int]) -> Growth:
    """As ``certify_growth``, for a search: pairs that come apart are measured at few moments, and nothing is proved.

    Args:
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        near: Pairs that do not keep their demand in the first row.
        moved: Pairs that the motion changes; the others are not asked.
    """
    bound = certify(scene_of_rows(scene, sorted({*moved} - {*near})), q, with_minimum=False)
    return Growth.of(bound, [_Separation(scene, row, q, is_sampled=True) for row in near] if bound.is_met else [])


def signed_distances(scene: Scene, pair: ScenePair, q: Array, *, tolerance: float = SUNK_TOL) -> Array:
    """Distance of a pair at configurations, shape (N, nq), in [m], negative by its depth where it overlaps, (N,).

    The tolerance in [m] is that of depths in meshes, see ``overlap_depth``.
    """
    if pair.solids is None:
        return scene.ground_heights(pair, scene.pair_poses((pair.first, pair.first), q))
    poses, distances = scene.pair_poses(pair.solids, q), np.empty(len(q))
    for sample in range(len(q)):
        depth = 0.0
        reading = measure(scene.engine, pair.solids, poses, sample=sample)
        is_apart = not (reading.touches or is_inside(scene.engine, pair.solids, poses, sample=sample))
        if not is_apart:
            depth = overlap_depth(scene.engine, pair.solids, poses, sample=sample, tolerance=tolerance)
        distances[sample] = reading.bound if is_apart else -depth
    return distances


class _Separation:
    """One pair over a motion."""

    def __init__(self, scene: Scene, row: int, q: Array, *, is_sampled: bool = False) -> None:
        self._pair, self._q, self._scene = scene.pairs[row], q, scene_of_rows(scene, [row])
        self._is_sampled = is_sampled
        self._demand = self._pair.demand if self._pair.rule is Rule.CLEARANCE else APART_TOL
        self._reach = _reach(scene, self._pair, q)
        self._begin = float(signed_distances(scene, self._pair, q[:1])[0])
        depth = max(0.0, -self._begin)
        self._travel = max(TRAVEL, TRAVEL_SHARE * depth) * (SAMPLED if is_sampled else 1.0)
        self._sunk_tol = max(SUNK_TOL, SAMPLED_SHARE * depth) if is_sampled else SUNK_TOL
        self._tolerance = READING_TOL + DEPTH_SHARE * depth
        if not self._is_convex():
            self._tolerance += self._sunk_tol
            self._travel = max(self._travel, SUNK_SHARE * self._sunk_tol)

    def _is_convex(self) -> bool:
        """Whether the depth of the pair is that of two convex solids, which has no tolerance of its own."""
        bodies = self._scene.engine.bodies
        return self._pair.solids is None or all(bodies[index].is_convex for index in self._pair.solids)

    def _distances(self, q: Array) -> Array:
        """Signed distances of the pair at configurations, shape (N, nq), in [m], shape (N,)."""
        return signed_distances(self._scene, self._pair, q, tolerance=self._sunk_tol)

    def judged(self) -> tuple[ComingApart, str]:
        """What is found, and what is wrong with it in words; empty where nothing is."""
        reached, fault, end = None, "", self._begin
        if self._reach.any():
            row, largest, fault = self._through_contact()
            if not fault and row < len(self._q) - 1:
                reached, fault = self._beyond(row, largest)
            end = float(self._distances(self._q[-1:])[0])
        coming_apart = ComingApart(
            names=self._scene.names(self._pair),
            begin=self._begin,
            end=end,
            demand=self._demand,
            row=reached,
            slack=self._tolerance + 0.5 * self._travel,
        )
        return coming_apart, fault

    def _through_contact(self) -> tuple[int, float, str]:
        """The first row from which on the certificate of distances is used, and the largest distance so far in [m]."""
        largest, left = self._begin, MOST_MOMENTS
        for row in range(len(self._q) - 1):
            if largest > APART:
                return row, largest, ""
            if self._reach[row] == 0.0:
                continue
            parts = int(np.ceil(self._reach[row] / self._travel))
            left -= parts
            if left < 0:
                return row, largest, "comes apart too slowly to be judged"
            share = np.arange(1, parts + 1)[:, None] / parts
            at = self._q[row] + share * (self._q[row + 1] - self._q[row])
            for distance in self._distances(at).tolist():
                if distance < largest - self._tolerance:
                    return row, largest, f"comes nearer, from {_shown(largest)} to {_shown(distance)}"
                largest = max(largest, distance)
        return len(self._q) - 1, largest, ""

    def _beyond(self, row: int, largest: float) -> tuple[int | None, str]:
        """The row from which on the demand is kept, None where it never is; and what is wrong."""
        last = len(self._q) - 1
        moving = row + np.flatnonzero(self._reach[row:])
        if not len(moving):
            return None, ""
        ends = np.unique(np.append(self._blocks(int(moving[0]), int(moving[-1]) + 1, largest), [row, last]))
        distances = self._distances(self._q[ends])
        is_met = np.minimum.accumulate(distances[::-1])[::-1] >= self._demand + READING_TOL
        blocks = np.append(np.flatnonzero(~is_met), np.flatnonzero(is_met)[:1]).tolist()
        for place, following in pairwise(blocks):
            largest = max(largest, float(distances[place]))
            demand = min(self._demand, largest - self._tolerance)
            if not self._keeps(int(ends[place]), int(ends[following]), demand):
                return None, f"is not proved to stay {_shown(demand)} apart"
        if not is_met.any():
            return None, ""
        met = int(ends[np.flatnonzero(is_met)[0]])
        if met < last and not self._keeps(met, last, self._demand):
            return None, f"is not proved to keep {_shown(self._demand)}"
        return met, ""

    def _blocks(self, first: int, last: int, largest: float) -> Indices:
        """Rows at which blocks end: near each other while the demand is not met."""
        count = 4 * BLOCKS if self._is_sampled else BLOCKS
        if self._is_sampled:
            return np.linspace(first, last, count + 1).astype(np.intp)
        rows = np.linspace(first, last, min(MOST_LOOKED_AT, last - first + 1)).astype(np.intp)
        distances = self._distances(self._q[rows])
        levels = np.linspace(largest, self._demand + 2.0 * READING_TOL, count + 1)[1:]
        highest = np.maximum.accumulate(distances)
        ends = np.minimum(np.searchsorted(highest, levels), len(rows) - 1)
        return rows[ends]

    def _keeps(self, first: int, last: int, demand: float) -> bool:
        """Whether a distance in [m] is proved between two rows; for a search, that it is not less at both is enough."""
        if self._is_sampled:
            at = self._distances(self._q[[first, last]])
            return bool(at.min() >= demand)
        pair = replace(self._pair, rule=Rule.CLEARANCE, demand=max(APART_TOL, demand))
        scene = replace(self._scene, pairs=(pair,))
        return certify(scene, self._q[first : last + 1], with_minimum=False).is_met


def _reach(scene: Scene, pair: ScenePair, q: Array) -> Array:
    """How far a point of a pair comes at most in each step, seen from the other body, in [m], shape (N - 1,)."""
    arms = LeverArms(scene, q)
    steps = arms.steps(q)
    sides = [(None, pair.first)] if pair.solids is None else [pair.solids, pair.solids[::-1]]
    return np.min([arms.chain(*ends).reach(steps) for ends in sides], axis=0)


def _shown(distance: float) -> str:
    """A distance or depth in words."""
    return f"{MM * distance:.2f} mm" if distance >= 0.0 else f"{-MM * distance:.2f} mm deep"
