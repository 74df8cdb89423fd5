"""The closest pair at some instants of a motion, with the points at which it is nearest."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.transforms import inverse
from cellplan.model.units import MM
from cellplan.report.record.view import NearestRecord, point_numbers
from cellplan.scene.bodies import SceneBody, is_ground
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

INSTANTS: Final = 200  # [-] at which the closest pair of a motion is looked for, beside those of the report
WITHIN: Final = (0.05, 0.2, 0.8, 3.2)  # [m] distances within which it is looked for, one after the other
DECIMALS: Final = 4  # of distances in [mm]


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Rows of a motion that one scene is for: the first of them and the one after the last."""

    scene: Scene
    first: int
    end: int


def instants(times: Array, further: Iterable[float | None]) -> Indices:
    """Rows at which the closest pair is looked for: evenly spread ones, and those nearest to further times in [s]."""
    rows = np.linspace(0, len(times) - 1, min(len(times), INSTANTS + 1)).round().astype(np.intp)
    named = [int(np.argmin(np.abs(times - at))) for at in further if at is not None]
    return np.unique(np.concatenate([rows, np.array(named, dtype=np.intp)]))


def nearest_record(stretches: Sequence[Stretch], times: Array, q: Array, rows: Indices) -> NearestRecord:
    """The closest pair of bodies that move against each other and are to keep a clearance, at some rows.

    Args:
        stretches: The scenes of the motion, one after the other.
        times: Times of all rows in [s], shape (N,).
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        rows: The rows, ascending.
    """
    chosen = times[rows]
    record = NearestRecord(
        step=round(float(np.diff(chosen).max(initial=0.0)), 6),
        required=MM * stretches[0].scene.cell.checks.clearance,
        times=[round(float(each), 9) for each in chosen],
        pairs=[],
        distances=[],
        lower_bound=[],
        points=[],
    )
    for stretch in stretches:
        own = rows[(rows >= stretch.first) & (rows < stretch.end)]
        if len(own):
            _look(stretch.scene, q[own], record)
    return record


def _look(scene: Scene, q: Array, record: NearestRecord) -> None:
    """Add the closest pair at some configurations, shape (K, nq)."""
    counted = np.array([_counts(scene, pair) for pair in scene.pairs], dtype=bool)
    found: dict[int, tuple[int, float, Array, Array]] = {}
    for within in WITHIN:
        open_ = np.array([sample for sample in range(len(q)) if sample not in found], dtype=np.intp)
        if len(open_):
            found |= _closest(scene, q[open_], within, counted, open_)
    poses = scene.body_poses(q)
    for sample in range(len(q)):
        if sample not in found:
            record["pairs"].append([])
            record["distances"].append(0.0)
            record["lower_bound"].append(False)
            record["points"].append([])
            continue
        row, distance, first, second = found[sample]
        pair, ends = scene.pairs[row], np.empty((2, 3))
        for end, (body, point) in enumerate(((pair.first, first), (pair.second, second))):
            if is_ground(scene.bodies[body]):
                X_SW = inverse(scene.bodies[body].X_BS)
                ends[end] = X_SW[:3, :3] @ point + X_SW[:3, 3]
            else:
                ends[end] = poses.R[body, sample].T @ (point - poses.p[body, sample])
        record["pairs"].append([pair.first, pair.second])
        record["distances"].append(round(MM * distance, DECIMALS) + 0.0)
        record["lower_bound"].append(_is_bound(scene, pair, distance))
        record["points"].append(point_numbers(ends))


def _closest(
    scene: Scene, q: Array, within: float, counted: Flags, samples: Indices
) -> dict[int, tuple[int, float, Array, Array]]:
    """Row of the closest pair, distance in [m] and both points, by sample; those without a pair so near are left out."""
    near = scene.near(q, within)
    kept = np.flatnonzero(counted[near.rows])
    order = kept[np.lexsort((near.distances[kept], near.samples[kept]))]
    _, first = np.unique(near.samples[order], return_index=True)
    return {
        int(samples[near.samples[k]]): (int(near.rows[k]), float(near.distances[k]), near.first[k], near.second[k])
        for k in order[first]
    }


def touching_pairs(scene: Scene, q: Array) -> list[tuple[int, int]]:
    """Pairs that must not touch but do, at one configuration of shape (nq,)."""
    near = scene.near(q[None], 0.0)
    kept = []
    for row in near.rows:
        pair = scene.pairs[row]
        poses = scene.body_poses(q[None])
        if pair.is_ground:
            touches = scene.ground_heights(pair, poses)[0] <= 0.0
        else:
            touches = pair.solids is not None and scene.engine.touch(*pair.solids, poses, sample=0)
        if touches:
            kept.append((pair.first, pair.second))
    return kept


def _counts(scene: Scene, pair: ScenePair) -> bool:
    """Whether a pair is to keep a clearance and moves against each other."""
    a, b = scene.bodies[pair.first], scene.bodies[pair.second]
    return pair.rule is Rule.CLEARANCE and not (a.is_at_rest and b.is_at_rest) and not _is_joined(a, b)


def _is_joined(a: SceneBody, b: SceneBody) -> bool:
    """Whether two bodies are on one link."""
    return a.robot is not None and a.robot == b.robot and a.link == b.link


def _is_bound(scene: Scene, pair: ScenePair, distance: float) -> bool:
    """Whether a distance is that of hulls that hold more than the bodies; see ``NearPairs``."""
    solids = pair.solids if pair.solids is not None else (pair.first,)
    is_hull = not all(scene.engine.bodies[index].is_convex for index in solids)
    return is_hull and not pair.is_ground and distance > pair.demand
