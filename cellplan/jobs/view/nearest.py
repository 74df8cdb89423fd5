"""The closest pair at some rows of a motion, with the points at which it is nearest."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.transforms import inverse
from cellplan.jobs.view.result import point_numbers
from cellplan.model.units import MM
from cellplan.report.record.common import Record
from cellplan.scene.bodies import is_ground
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.near import NearPairs
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

SAMPLES: Final = 120  # [-] at which the closest pair of a motion is searched, beside those of the report
WITHIN: Final = (0.05, 0.2, 0.8, 3.2)  # [m] distances within which it is searched, one after the other
SURFACES: Final = 600  # [-] distances of surfaces that are asked of a page: some milliseconds each
CUT: Final = (Rule.PROCESS, Rule.GRIP)  # of pairs that may touch in a zone
DECIMALS: Final = 4  # of distances in [mm]


@dataclass(frozen=True, slots=True, eq=False)
class ViewedStretch:
    """Rows of a motion that one scene is for: the first of them and the one after the last."""

    scene: Scene
    first: int
    end: int


class Closest(NamedTuple):
    """The closest pair of a configuration."""

    row: int  # its place in ``Scene.pairs``
    distance: float  # in [m]; zero or less where the bodies touch
    first: Array  # point of the first body in the world in [m], shape (3,)
    second: Array  # point of the second body likewise
    is_bound: bool  # whether the distance is that of hulls that hold more than the bodies


def sampled_rows(times: Array, further: Iterable[float | None], steps: int = SAMPLES) -> Indices:
    """Rows at which the closest pair is searched: evenly spread ones, and those nearest to further times in [s]."""
    rows = np.linspace(0, len(times) - 1, min(len(times), steps + 1)).round().astype(np.intp)
    named = [int(np.argmin(np.abs(times - at))) for at in further if at is not None]
    return np.unique(np.concatenate([rows, np.array(named, dtype=np.intp)]))


def nearest_record(stretches: Sequence[ViewedStretch], times: Array, q: Array, rows: Indices) -> Record:
    """The closest pair of bodies that move against each other and are to keep a clearance, at some rows.

    Args:
        times: Times of all rows in [s], shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        rows: The rows, ascending.
    """
    chosen = times[rows]
    record: Record = {
        "step": round(float(np.diff(chosen).max(initial=0.0)), 6),
        "required": stretches[0].scene.cell.checks.clearance_mm,
        "times": [round(float(time), 9) for time in chosen],
        "pairs": [],
        "distances": [],
        "lower_bound": [],
        "points": [],
    }
    queries = SURFACES
    for stretch in stretches:
        selected = rows[(rows >= stretch.first) & (rows < stretch.end)]
        if len(selected):
            queries = _search(stretch.scene, q[selected], record, queries)
    return record


@dataclass(slots=True)
class _ClosestSearch:
    """The closest pairs of some configurations while they are searched."""

    scene: Scene
    poses: BodyPoses  # poses of its bodies
    queries: int  # surface queries that may still be asked

    def closest(self, sample: int, near: NearPairs, places: Indices) -> Closest | None:
        """The closest of some near pairs, the nearest hulls first: surfaces are asked while hulls leave it open."""
        best: Closest | None = None
        for place in places[np.argsort(near.distances[places], kind="stable")].tolist():
            bound = float(near.distances[place])
            if best is not None and bound >= best.distance:
                break
            row = int(near.rows[place])
            candidate = Closest(row, bound, near.first[place], near.second[place], _is_bound(self.scene, row, bound))
            if candidate.is_bound and self.queries > 0:
                candidate = self._of_surfaces(candidate, sample)
            best = candidate if best is None or candidate.distance < best.distance else best
        return best

    def _of_surfaces(self, closest_pair: Closest, sample: int) -> Closest:
        """The same pair with the distance of its surfaces; as it was where they touch."""
        solids = self.scene.pairs[closest_pair.row].solids
        if solids is None:
            return closest_pair
        self.queries -= 1
        points = self.scene.engine.surface_points(*solids, self.poses, sample=sample)
        if points is None:
            return closest_pair
        return Closest(closest_pair.row, float(np.linalg.norm(points[1] - points[0])), *points, is_bound=False)

    def local(self, body: int, point: Array, sample: int) -> Array:
        """A point of the world in the frame of a body, shape (3,)."""
        if is_ground(self.scene.bodies[body]):
            X_SW = inverse(self.scene.bodies[body].X_BS)
            return X_SW[:3, :3] @ point + X_SW[:3, 3]
        return self.poses.R[body, sample].T @ (point - self.poses.p[body, sample])


def _search(scene: Scene, q: Array, record: Record, queries: int) -> int:
    """Add the closest pair at some configurations, shape (K, nq); gives the surface queries that are left."""
    counted = np.array([_counts(scene, pair) for pair in scene.pairs], dtype=bool)
    search = _ClosestSearch(scene, scene.body_poses(q), queries)
    closest_pairs: dict[int, Closest] = {}
    for within in WITHIN:
        left = np.array([sample for sample in range(len(q)) if sample not in closest_pairs], dtype=np.intp)
        if not len(left):
            break
        near = scene.near(q[left], within)
        for place, sample in enumerate(left.tolist()):
            places = np.flatnonzero((near.samples == place) & counted[near.rows])
            closest = search.closest(sample, near, places)
            if closest is not None and closest.distance < within:
                closest_pairs[sample] = closest
    for sample in range(len(q)):
        _add(record, search, sample, closest_pairs.get(sample))
    return search.queries


def _add(record: Record, search: _ClosestSearch, sample: int, closest_pair: Closest | None) -> None:
    """Add what was found at a configuration."""
    pair = None if closest_pair is None else search.scene.pairs[closest_pair.row]
    record["pairs"].append([] if pair is None else [pair.first, pair.second])
    record["distances"].append(0.0 if closest_pair is None else round(MM * closest_pair.distance, DECIMALS) + 0.0)
    record["lower_bound"].append(closest_pair is not None and closest_pair.is_bound)
    points: list[float] = []
    if closest_pair is not None and pair is not None:
        ends = ((pair.first, closest_pair.first), (pair.second, closest_pair.second))
        points = point_numbers(np.stack([search.local(body, point, sample) for body, point in ends]))
    record["points"].append(points)


def touching_pairs(scene: Scene, q: Array) -> list[tuple[int, int]]:
    """Pairs that must not touch but do, at one configuration of shape (nq,); tools at work on the part are left out."""
    near, poses = scene.near(q[None], 0.0), scene.body_poses(q[None])
    touching = []
    for row in near.rows:
        pair = scene.pairs[row]
        if pair.rule in CUT:
            continue
        if pair.is_ground:
            touches = scene.ground_heights(pair, poses)[0] <= 0.0
        else:
            first, second = pair.solids or (pair.first, pair.second)
            touches = scene.engine.touch(first, second, poses, sample=0)
        if touches:
            touching.append((pair.first, pair.second))
    return touching


def _counts(scene: Scene, pair: ScenePair) -> bool:
    """Whether a pair is to keep a clearance and moves against each other."""
    a, b = scene.bodies[pair.first], scene.bodies[pair.second]
    is_joined = a.robot is not None and (a.robot, a.link) == (b.robot, b.link)
    return pair.rule is Rule.CLEARANCE and not (a.is_at_rest and b.is_at_rest) and not is_joined


def _is_bound(scene: Scene, row: int, distance: float) -> bool:
    """Whether a distance is that of hulls that hold more than the bodies; see ``NearPairs``."""
    pair = scene.pairs[row]
    if pair.solids is None or distance <= pair.demand:
        return False
    return not all(scene.engine.bodies[index].is_convex for index in pair.solids)
