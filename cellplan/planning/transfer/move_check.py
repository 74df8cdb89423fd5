r"""Move check: whether a robot can move through some configurations while everything else stands or moves as known.

Only pairs that the robot changes are tested. From one sample to the next no point of a body comes farther than its
lever arms times the moves of the joints; so with the travel :math:`C_k` of a pair up to sample k, a distance d read at
sample i clears all samples k with :math:`|C_k - C_i| \le d - m`, and few of them are read. What is needed, m, is the
demanded distance and a reserve for what happens between two samples.
"""

from collections import Counter
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import rows_moved_by
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.continuous.motion_bound import Pair
from cellplan.scene.collision.distance import APART_TOL, exact_reading, quick_reading
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

SPREAD: Final = 2.0  # [-] samples lie no farther apart than this, in reserves
MOST_SAMPLES: Final = 2000  # of one move
STRIDE: Final = 16  # every so many of them are tested first
RECENT: Final = 4  # pairs that refused something lately come first
LEAST_RESERVE: Final = 1e-6  # [m] where a pair is hardly farther apart than demanded at an end of the move


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Others:
    """Everything but the robot that moves, at one moment or at many."""

    poses: BodyPoses  # where the engine's bodies are at each moment
    travel: Array  # how far a point of each body has come at most by each moment in [m], shape (B, moments)

    @classmethod
    def moving(cls, scene: Scene, q: Array) -> "Others":
        """The cell at stacked joint positions in [rad] or [m], shape (moments, nq)."""
        arms = LeverArms(scene, q)
        steps = arms.steps(q)
        travel = np.zeros((len(scene.engine.bodies), len(q)))
        for index in range(len(travel) if len(q) > 1 else 0):
            travel[index, 1:] = np.cumsum(arms.chain(None, index).reach(steps))
        return cls(poses=scene.body_poses(q), travel=travel)


class MoveCheck:
    """Moves of one robot.

    Attributes:
        refused: How often each pair was too near, by the names of its bodies.
    """

    def __init__(self, scene: Scene, robot: str, others: Others, *, reserve: float) -> None:
        """Collect the pairs that the robot changes, with ``reserve`` in [m] beyond the demanded distance."""
        self.robot, self.refused = robot, Counter[tuple[str, str]]()
        self._scene, self._others, self._reserve = scene, others, reserve
        self._chain = scene.chains[robot]
        moved = rows_moved_by(scene, robot)
        self._rows = [row for row in moved if scene.pairs[row].is_ground or scene.pairs[row].solids is not None]
        self._ends = np.array([_ends(scene, row) for row in self._rows], dtype=np.intp).reshape(-1, 2)
        self._robot_bodies = _robot_bodies(scene, robot)
        self._demands = np.array([_demand(scene, row) for row in self._rows])
        self._needs = self._demands + reserve
        self._levers = lever_matrix(scene, robot, self._ends)
        self._at_one = BodyPoses(others.poses.R[:, :1].copy(), others.poses.p[:, :1].copy())
        self._recent: list[int] = []

    def relax_at(self, q: Array, moment: int = 0) -> None:
        """Ask for less reserve of pairs that are near at an end of the move, shape (n,), so that it can begin there.

        The configuration keeps the demanded distance, which is not judged here.
        """
        everything = np.arange(len(self._rows))
        samples = self._placed(q[None], np.array([moment]), everything)
        enough = self._demands + 2.0 * self._reserve
        for place in np.flatnonzero(self._gaps(everything, samples)[:, 0] < enough).tolist():
            spare = 0.5 * (self._read(place, samples, 0, enough[place]) - self._demands[place])
            self._needs[place] = min(self._needs[place], self._demands[place] + max(LEAST_RESERVE, spare))

    def is_free(self, first: Array, second: Array) -> bool:
        """Whether the straight move between two configurations, shape (n,) each, is free while the others stand."""
        share = np.linspace(0.0, 1.0, self.samples(np.array([first, second])))[:, None]
        return self.are_free(first + share * (second - first))

    def samples(self, path: Array) -> int:
        """How many configurations along straight lines through via points, shape (K, n), lie near enough together."""
        farthest = float((np.abs(np.diff(path, axis=0)) @ self._levers.T).sum(axis=0).max(initial=0.0))
        return 1 + int(np.clip(np.ceil(farthest / (SPREAD * self._reserve)), 1, MOST_SAMPLES))

    def are_free(self, q: Array, moments: Indices | None = None) -> bool:
        """Whether configurations, shape (K, n), are free one after the other, each at its moment of the others.

        Few of them are tested first: most moves that are blocked are so there, and what is read there clears most of
        the others.
        """
        at = np.zeros(len(q), dtype=np.intp) if moments is None else moments
        swept = np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(np.abs(np.diff(q, axis=0)), axis=0)])
        few = np.unique(np.append(np.arange(0, len(q), STRIDE), len(q) - 1))
        everything = np.arange(len(self._rows))
        spare = self._spare(q[few], at[few], everything, self._travel(swept[few], at[few], everything))
        if spare is None or len(few) == len(q):
            return spare is not None
        places, between = _not_cleared(spare, self._travel(swept[few], at[few], everything))
        if not places.size:
            return True
        travel = self._travel(swept, at, places)
        is_clear = np.zeros(travel.shape, dtype=bool)
        for k, sample in enumerate(few):
            is_clear |= np.abs(travel - travel[:, sample, None]) <= spare[places, k, None]
        left = np.flatnonzero(~is_clear.all(axis=0) & np.repeat(between, np.diff(np.append(few, few[-1] + 1))))
        if not left.size:
            return True
        return self._spare(q[left], at[left], places, travel[:, left], is_clear=is_clear[:, left]) is not None

    def _travel(self, moved: Array, moments: Indices, places: Indices) -> Array:
        """How far the bodies of some pairs have come at most in [m], shape (pairs, K)."""
        travel = self._levers[places] @ moved.T
        for side in self._ends[places].T:
            travel = travel + np.where(side[:, None] >= 0, self._others.travel[side][:, moments], 0.0)
        return travel

    def _spare(
        self, q: Array, moments: Indices, places: Indices, travel: Array, *, is_clear: Flags | None = None
    ) -> Array | None:
        """By how much pairs are known to be farther apart than they have to be, in [m]; None where one is too near.

        Args:
            q: Configurations in [rad] or [m], shape (K, n).
            travel: How far their bodies have come, shape (pairs, K).
            is_clear: Where nothing need be tested, likewise.

        Returns:
            At least zero at all samples; shape (pairs, K).
        """
        samples = self._placed(q, moments, places)
        spare = self._gaps(places, samples) - self._needs[places, None]
        left = spare if is_clear is None else np.where(is_clear, np.inf, spare)
        lowest = left.min(axis=1)
        order = [k for k in np.argsort(lowest, kind="stable").tolist() if lowest[k] < 0.0]
        for k in sorted(order, key=lambda k: places[k] not in self._recent):
            if not self._is_proved(int(places[k]), samples, travel[k], left[k].copy(), spare[k]):
                return None
        return spare

    def _is_proved(self, place: int, samples: "_Samples", travel: Array, left: Array, spare: Array) -> bool:
        """Whether one pair keeps what it needs at all samples; those nearest by their spheres are read first.

        Args:
            travel: How far they have come, shape (K,).
            left: What its spheres are farther apart than needed, shape (K,); is overwritten.
            spare: Receives what is read, and zero where it is only known that enough is left, shape (K,).
        """
        while left[sample := int(np.argmin(left))] < 0.0:
            more = self._read(place, samples, sample, self._needs[place]) - self._needs[place]
            if more < 0.0:
                self._refuse(place)
                return False
            spare[sample] = more
            left[np.abs(travel - travel[sample]) <= more] = np.inf
            left[sample] = np.inf
        np.maximum(spare, 0.0, out=spare)
        return True

    def _refuse(self, place: int) -> None:
        """Count a refusal; the pair comes first in the next moves."""
        self._recent = [place, *(recent for recent in self._recent if recent != place)][:RECENT]
        self.refused[self._scene.names(self._scene.pairs[self._rows[place]])] += 1

    def _placed(self, q: Array, moments: Indices, places: Indices) -> "_Samples":
        """The bodies of some pairs, and the centres of their spheres."""
        D, engine, others = self._chain.link_displacements(q), self._scene.engine, self._others.poses
        samples = _Samples(poses={}, centres=np.zeros((len(engine.bodies), len(q), 3)))
        for index in np.unique(self._ends[places]).tolist():
            if index < 0:
                continue
            if index in self._robot_bodies:
                X = D[:, self._robot_bodies[index][0]] @ self._robot_bodies[index][1]
                R, p = X[:, :3, :3], X[:, :3, 3]
            else:
                R, p = others.R[index][moments], others.p[index][moments]
            samples.poses[index] = R, p
            samples.centres[index] = R @ engine.centres[index] + p
        return samples

    def _gaps(self, places: Indices, samples: "_Samples") -> Array:
        """Distances of the bounding spheres of pairs in [m], or of one above a half-space, shape (pairs, K)."""
        (first, second), radii, centres = self._ends[places].T, self._scene.engine.radii, samples.centres
        apart = centres[second] - centres[first]
        gaps = np.sqrt(np.einsum("pki,pki->pk", apart, apart)) - (radii[first] + radii[second])[:, None]
        for k in np.flatnonzero(second < 0).tolist():
            X_WS = self._scene.bodies[self._scene.pairs[self._rows[places[k]]].second].X_BS
            gaps[k] = (centres[first[k]] - X_WS[:3, 3]) @ X_WS[:3, 2] - radii[first[k]]
        return gaps

    def _read(self, place: int, samples: "_Samples", sample: int, need: float) -> float:
        """Distance of a pair at a sample in [m]: proved, exact where the proof does not reach what is needed.

        That a body is not inside another one is not asked: no move leads there from an end that is free.
        """
        first, second = self._ends[place].tolist()
        poses, engine = self._at_one, self._scene.engine
        for index in (first, second):
            if index >= 0:
                poses.R[index, 0], poses.p[index, 0] = (part[sample] for part in samples.poses[index])
        if second < 0:
            return float(self._scene.ground_heights(self._scene.pairs[self._rows[place]], poses)[0])
        reading = quick_reading(engine, (first, second), poses, sample=0)
        if reading.touches or reading.bound >= need:
            return reading.bound
        return exact_reading(engine, (first, second), poses, sample=0, reading=reading).bound


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Samples:
    """Some bodies at some samples."""

    poses: dict[int, tuple[Array, Array]]  # rotations, shape (K, 3, 3), and positions in [m], shape (K, 3), by the body
    centres: Array  # centres of their bounding spheres in the world in [m], shape (B, K, 3)


def lever_matrix(scene: Scene, robot: str, pairs: Indices) -> Array:
    """How far a point of either body of a pair comes for a unit of each joint of a robot in [m], shape (pairs, n)."""
    cell = scene.cell
    columns, model = cell.columns(robot), cell.robot(robot).model
    n = len(model.joints)
    reached = np.zeros((2, cell.joint_count))
    reached[:, columns] = [np.where(np.isfinite(side), side, 0.0) for side in (model.lower, model.upper)]
    arms = LeverArms(scene, reached)
    unit = np.zeros((2 * n + 1, cell.joint_count))
    unit[1::2, columns] = np.eye(n)
    steps = arms.steps(unit)[::2]
    levers = np.empty((len(pairs), n))
    for place, (first, second) in enumerate(pairs.tolist()):
        sides = [(None, first)] if second < 0 else [(first, second), (second, first)]
        tried = [arms.chain(*ends).reach(steps) for ends in sides]
        levers[place] = min(tried, key=lambda reach: float(reach.sum()))
    return levers


def _ends(scene: Scene, row: int) -> Pair:
    """The engine's bodies of a pair; -1 for a half-space."""
    pair = scene.pairs[row]
    return (pair.first, -1) if pair.solids is None else pair.solids


def _not_cleared(spare: Array, travel: Array) -> tuple[Indices, Flags]:
    """Pairs that may be too near between two samples, and whether any is after each sample, shape (K,)."""
    open_ = spare[:, :-1] + spare[:, 1:] < np.diff(travel, axis=1)
    return np.flatnonzero(open_.any(axis=1)), np.append(open_.any(axis=0), True)


def _robot_bodies(scene: Scene, robot: str) -> dict[int, tuple[int, Array]]:
    """The engine's bodies on moving links of a robot: the place of the link among the displacements, and ``X_BS``."""
    carriers = [scene.carrier(index) for index in range(len(scene.engine.bodies))]
    return {
        index: (body.link + 1, body.X_BS)
        for index, body in enumerate(carriers)
        if body.robot == robot and not body.is_at_rest
    }


def _demand(scene: Scene, row: int) -> float:
    """Distance in [m] that a pair is to keep."""
    pair = scene.pairs[row]
    return max(APART_TOL, pair.demand) if pair.rule is Rule.CLEARANCE else APART_TOL
