"""Survey: what is known of all watched pairs over a program, and which of them are worth looking at more closely.

The program is cut into blocks of steps. Each pair has one certified lower bound per block, at first from its bounding
spheres. Pairs are then searched (``survey_search``), the nearest first, as far as they may be the nearest of their
class or among the nearest of the cell; the others keep the bounds they have.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.continuous.found import SEARCH_ROOM, Found
from cellplan.collision.continuous.interval_search import Search
from cellplan.collision.continuous.motion_bound import Pair
from cellplan.collision.distance import SURELY_APART
from cellplan.collision.nearest_points import nearest_points, point_above
from cellplan.geometry.transforms import Array
from cellplan.model.report import ClearanceClass
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

Rows = NDArray[np.intp]  # indices of pairs

BLOCKS: Final = 200  # [-] stretches of the program that have a bound of their own
ROWS_AT_ONCE: Final = 10_000  # [-] pairs whose bounds are copied at once: 16 MB
CLOSEST: Final = 10  # [-] pairs that are reported as the closest ones


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ranks:
    """Smallest distances in [m]: of one pair more than are reported, ascending, and of each class."""

    closest: Sequence[float]
    best: Mapping[ClearanceClass, float]


class Survey:
    """All watched pairs over a program.

    Attributes:
        scene: The scene.
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        edges: Samples at which blocks begin and end, ascending from 0 to N - 1, shape (K + 1,).
        low: No distance of a pair is below this in a block, in [m], shape (pairs, K); zero where the pair touches; inf
            where nothing of a tool sticks out of its contact zone. May be negative where little is proved.
        found: What is known of each pair; instants are counted in samples.
        solid_ends: The engine's bodies of each pair of solids, by the pair.
        at_work: Pairs of a tool at work and the part.
        at_surface: First and last sample at which a tool at work is at the surface of the part, by pair.
    """

    def __init__(self, scene: Scene, q: Array) -> None:
        """Lay out the blocks.

        Args:
            scene: The scene.
            q: Stacked joint positions in [rad] or [m], shape (N, nq), N at least 2.
        """
        count = len(scene.pairs)
        self.scene, self.q = scene, q
        self.edges = np.unique(np.linspace(0, len(q) - 1, min(BLOCKS, len(q) - 1) + 1).round().astype(np.intp))
        self.low = np.full((count, len(self.edges) - 1), np.inf)
        self.found = [_nothing_found(pair) for pair in scene.pairs]
        self.at_surface: dict[int, tuple[int, int]] = {}
        pairs = zip(scene.solid_rows.tolist(), scene.solid_pairs.tolist(), strict=True)
        self.solid_ends: dict[int, Pair] = {row: (first, second) for row, (first, second) in pairs}
        self.at_work = [row for row, pair in enumerate(scene.pairs) if pair.rule is Rule.PROCESS]
        self._nearest = np.full(count, np.inf)  # smallest distance found in [m], zero where a pair touches
        self._ranks: _Ranks | None = None  # of the distances found, until one of them changes
        kinds = np.array([pair.clearance_class for pair in scene.pairs])
        self._keeps_any = np.array([pair.rule is Rule.CLEARANCE for pair in scene.pairs], dtype=bool)
        self._watched = {kind: kinds == kind for kind in ClearanceClass}
        self._raised = _raised_demands(scene) if scene.cell.checks.adds_accuracy else np.zeros(count)
        self._keeps = {kind: self._keeps_any & (kinds == kind) for kind in ClearanceClass}

    def rows(self, kind: ClearanceClass) -> Rows:
        """Pairs of a class that are to keep the distance that the cell demands, shape (M,), ascending."""
        return np.flatnonzero(self._keeps[kind])

    def watched(self, kind: ClearanceClass) -> Rows:
        """Pairs of a class that must not touch, whatever else is asked of them, shape (M,), ascending."""
        return np.flatnonzero(self._watched[kind])

    def known(self) -> list[int]:
        """Pairs that are to keep the distance that the cell demands and were found to touch or measured."""
        return np.flatnonzero(self._keeps_any & np.isfinite(self._nearest)).tolist()

    def distance(self, row: int) -> float:
        """Smallest distance of a pair that was found in [m]: zero when it touches, inf when it was not measured."""
        return 0.0 if self.found[row].touches else self.found[row].distance

    def best(self, kind: ClearanceClass) -> float:
        """Smallest distance of a class found so far in [m]; zero when any pair of it touches."""
        return self._ranked().best[kind]

    def cutoff(self, row: int) -> float:
        """Distance in [m] from which on a pair is neither the nearest of its class nor among the closest of all.

        Where the accuracy of bodies is added to the demand it is also no less than the demand of the pair.
        """
        kind = self.scene.pairs[row].clearance_class
        if not self._keeps[kind][row]:
            return SURELY_APART
        ranks = self._ranked()
        is_among = self._nearest[row] <= ranks.closest[CLOSEST - 1]
        last = ranks.closest[CLOSEST if is_among else CLOSEST - 1]  # of the others
        return max(SURELY_APART, max(ranks.best[kind], last) - SEARCH_ROOM, float(self._raised[row]))

    def largest_cutoff(self) -> float:
        """No pair has a larger cutoff in [m], now or later: distances that are found only become smaller."""
        ranks = self._ranked()
        kept = [ranks.best[kind] for kind in ClearanceClass if self._keeps[kind].any()]
        raised = float(self._raised.max(initial=0.0))
        return max(SURELY_APART, max([ranks.closest[CLOSEST], *kept]) - SEARCH_ROOM, raised)

    def remember(self, row: int) -> None:
        """Keep the smallest distance of a pair at hand; of pairs that only must not touch only the touch counts."""
        found, known = self.found[row], float(self._nearest[row])
        if found.touches:
            self._nearest[row] = 0.0
        elif self._keeps_any[row]:
            self._nearest[row] = found.distance
        if self._nearest[row] != known:
            self._ranks = None

    def _ranked(self) -> "_Ranks":
        """The smallest distances found so far."""
        if self._ranks is None:
            kept = self._nearest[self._keeps_any]
            few = np.partition(kept, CLOSEST)[: CLOSEST + 1] if len(kept) > CLOSEST else kept
            closest = np.append(np.sort(few), np.full(CLOSEST + 1 - len(few), np.inf))
            best = {kind: float(self._nearest[self._watched[kind]].min(initial=np.inf)) for kind in ClearanceClass}
            self._ranks = _Ranks(closest=closest.tolist(), best=best)
        return self._ranks

    def lift(self, row: int, search: Search, first: int) -> None:
        """Raise the bounds of a pair by those of a search that begins where a block does."""
        begin = int(self.edges[first])
        last = int(np.searchsorted(self.edges, begin + len(search.low)))
        low = np.minimum.reduceat(search.low, self.edges[first:last] - begin)
        known = self.low[row, first:last]
        self.low[row, first:last] = np.where(np.isinf(known) | (low == 0.0), low, np.maximum(known, low))
        self.remember(row)

    def nearest_points(self, row: int) -> tuple[Array, Array] | None:
        """Points of a pair where it is nearest, in the world in [m]; None when it touches or was not measured."""
        found, scene, ends = self.found[row], self.scene, self.solid_ends.get(row)
        if found.touches or not np.isfinite(found.distance):
            return None
        before = min(int(found.at), len(self.q) - 2)
        share = found.at - before
        q = (1.0 - share) * self.q[before] + share * self.q[before + 1]
        if ends is None:
            pair = scene.pairs[row]
            poses = scene.pair_poses((pair.first, pair.first), q[None])
            points = point_above(scene.engine, pair.first, poses, X_WS=scene.bodies[pair.second].X_BS, sample=0)
        else:
            points = nearest_points(scene.engine, ends, scene.pair_poses(ends, q[None]), sample=0)
        return points.first, points.second


def _raised_demands(scene: Scene) -> Array:
    """Distance in [m] that each pair is to be searched up to, whatever other pairs keep, shape (pairs,).

    Where the accuracy of bodies is added to the demand, the nearest pair of a class is not always the one that keeps
    least of what is demanded of it; so every pair is searched up to its own demand.
    """
    return np.array([pair.demand if pair.rule is Rule.CLEARANCE else 0.0 for pair in scene.pairs])


def proved_distance(seen: Survey, row: int) -> float:
    """Distance in [m] that a pair is proved to keep over the whole program; zero when it touches."""
    return max(0.0, min(seen.distance(row), float(seen.low[row].min())))


def lowest_bounds(seen: Survey, rows: Rows) -> Array:
    """Smallest bound of some pairs in each block in [m], shape (K,)."""
    lowest = np.full(seen.low.shape[1], np.inf)
    for first in range(0, len(rows), ROWS_AT_ONCE):
        np.minimum(lowest, seen.low[rows[first : first + ROWS_AT_ONCE]].min(axis=0), out=lowest)
    return lowest


def _nothing_found(pair: ScenePair) -> Found:
    """What is known of a pair before anything is searched, with what is to be proved of it first."""
    demand = pair.demand if pair.rule is Rule.CLEARANCE else 0.0
    return Found(demand=max(SURELY_APART, demand))
