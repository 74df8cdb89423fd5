"""Survey: what is known of all watched pairs while a motion is searched, and which of them must be searched further.

The motion is cut into blocks of steps. Each pair has one certified lower bound per block, at first from its bounding
spheres. Pairs are then searched (``certify.search``), the nearest first, as far as they may be the nearest of their
class or among the nearest of the cell; the others keep the bounds they have.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Final

import numpy as np

from cellplan.certify.bound import Bound
from cellplan.certify.pair_search import Search
from cellplan.certify.pair_state import SEARCH_TOL, PairState
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.distance import APART_TOL
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

MAX_BLOCKS: Final = 200  # stretches of the motion that have a bound of their own
CLOSEST_COUNT: Final = 10  # pairs that are reported as the closest ones


@dataclass(frozen=True, slots=True, kw_only=True)
class _Ranks:
    """Smallest distances in [m]: of one pair more than are reported, ascending, and of each class."""

    closest: Sequence[float]
    best: Mapping[ClearanceClass, float]


class Survey:
    """All watched pairs over a motion, while they are searched.

    Attributes:
        scene: The scene.
        edges: Samples at which blocks begin and end, ascending from 0 to N - 1, shape (K + 1,).
        low: No distance of a pair is below this in a block, in [m], shape (pairs, K); see ``PairBound.low``.
        states: State of the search of each pair.
        is_ignored: Blocks in which a pair is not watched, shape (pairs, K).
        at_work: Indices of pairs of a tool at work and the part.
        at_surface: First and last sample at which a tool at work is at the surface of the part, by index of the pair.
    """

    def __init__(self, scene: Scene, q: Array) -> None:
        """Divide the motion into blocks; joint positions are stacked, in [rad] or [m], shape (N, nq), N at least 2."""
        count = len(scene.pairs)
        self.scene, self._q = scene, q
        even = np.linspace(0, len(q) - 1, min(MAX_BLOCKS, len(q) - 1) + 1).round().astype(np.intp)
        parts = {row: pair.samples for row, pair in enumerate(scene.pairs) if pair.samples is not None}
        self.edges = np.unique([*even, *chain.from_iterable(parts.values())])
        self.low = np.full((count, len(self.edges) - 1), np.inf)
        self.is_ignored = np.zeros(self.low.shape, dtype=bool)
        for row, (first, last) in parts.items():
            self.is_ignored[row] = (self.edges[:-1] < first) | (self.edges[1:] > last)
        self.states = [PairState(demand=pair.least_distance) for pair in scene.pairs]
        self.at_surface: dict[int, tuple[int, int]] = {}
        self.at_work = [row for row, pair in enumerate(scene.pairs) if pair.rule is Rule.PROCESS]
        self._nearest = np.full(count, np.inf)  # smallest distance found in [m], zero where a pair touches
        self._ranks: _Ranks | None = None  # of the distances found, until one of them changes
        kinds = np.array([pair.clearance_class for pair in scene.pairs])
        self._keeps_any = np.array([pair.rule is Rule.CLEARANCE for pair in scene.pairs], dtype=bool)
        self._watched = {kind: kinds == kind for kind in ClearanceClass}
        self._raised = _raised_demands(scene) if scene.cell.checks.adds_accuracy else np.zeros(count)
        self._keeps = {kind: self._keeps_any & (kinds == kind) for kind in ClearanceClass}

    def rows(self, kind: ClearanceClass) -> Indices:
        """Pairs of a class that are to keep the clearance of the cell, shape (M,), ascending."""
        return np.flatnonzero(self._keeps[kind])

    def best(self, kind: ClearanceClass) -> float:
        """Smallest distance of a class found so far in [m]; zero when any pair of it touches."""
        return self._ranked().best[kind]

    def cutoff(self, row: int) -> float:
        """Distance in [m] from which on a pair is neither the nearest of its class nor among the closest of all.

        Where the accuracy of bodies is added to the demand it is also no less than the demand of the pair.
        """
        kind = self.scene.pairs[row].clearance_class
        if not self._keeps[kind][row]:
            return APART_TOL
        ranks = self._ranked()
        is_among = self._nearest[row] <= ranks.closest[CLOSEST_COUNT - 1]
        last = ranks.closest[CLOSEST_COUNT if is_among else CLOSEST_COUNT - 1]  # of the others
        return max(APART_TOL, max(ranks.best[kind], last) - SEARCH_TOL, float(self._raised[row]))

    def largest_cutoff(self) -> float:
        """No pair has a larger cutoff in [m], now or later: distances that are found only become smaller."""
        ranks = self._ranked()
        best = [ranks.best[kind] for kind in ClearanceClass if self._keeps[kind].any()]
        raised = float(self._raised.max(initial=0.0))
        return max(APART_TOL, max([ranks.closest[CLOSEST_COUNT], *best]) - SEARCH_TOL, raised)

    def note_distance(self, row: int, distance: float, at: float) -> None:
        """Record a measured distance of a pair in [m] and its time in samples."""
        self.states[row].note_distance(distance, at)
        self._rank(row)

    def lift(self, row: int, search: Search, first: int) -> None:
        """Raise the bounds of a pair by those of a search that begins where a block does."""
        begin = int(self.edges[first])
        last = int(np.searchsorted(self.edges, begin + len(search.low)))
        low = np.minimum.reduceat(search.low, self.edges[first:last] - begin)
        known = self.low[row, first:last]
        self.low[row, first:last] = np.where(np.isinf(known) | (low == 0.0), low, np.maximum(known, low))
        self._rank(row)

    def bound(self) -> Bound:
        """All that was found and proved; the survey ends with it."""
        self.low.flags.writeable = False
        return Bound(
            scene=self.scene,
            q=self._q,
            edges=self.edges,
            low=self.low,
            states=tuple(self.states),
            at_surface=self.at_surface,
        )

    def _rank(self, row: int) -> None:
        """Rank a pair by its smallest distance; of pairs that only must not touch only the touch counts."""
        state, known = self.states[row], float(self._nearest[row])
        if state.touches:
            self._nearest[row] = 0.0
        elif self._keeps_any[row]:
            self._nearest[row] = state.distance
        if self._nearest[row] != known:
            self._ranks = None

    def _ranked(self) -> "_Ranks":
        """The smallest distances found so far."""
        if self._ranks is None:
            nearest = self._nearest[self._keeps_any]
            few = np.partition(nearest, CLOSEST_COUNT)[: CLOSEST_COUNT + 1] if len(nearest) > CLOSEST_COUNT else nearest
            closest = np.append(np.sort(few), np.full(CLOSEST_COUNT + 1 - len(few), np.inf))
            best = {kind: float(self._nearest[self._watched[kind]].min(initial=np.inf)) for kind in ClearanceClass}
            self._ranks = _Ranks(closest=closest.tolist(), best=best)
        return self._ranks


def _raised_demands(scene: Scene) -> Array:
    """Distance in [m] that each pair is to be searched up to, whatever other pairs keep, shape (pairs,).

    Where the accuracy of bodies is added to the demand, the nearest pair of a class is not always the one that keeps
    least of what is demanded of it; so every pair is searched up to its own demand.
    """
    return np.array([pair.demand if pair.rule is Rule.CLEARANCE else 0.0 for pair in scene.pairs])
