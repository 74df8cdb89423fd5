"""Result of the certificate: lower bounds of the distance of every pair of bodies over a motion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from cellplan.certify.pair_state import PairState
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.distance import nearest_points, point_above
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

ROWS_AT_ONCE: Final = 10_000  # pairs whose bounds are copied at once: 16 MB


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairBound:
    """What is known of one pair over a motion; times are counted in samples, with fractions between them."""

    row: int  # index of the pair in ``Scene.pairs``
    pair: ScenePair
    # no distance is below this in a block of the motion, in [m], shape (K,); zero where the bodies touch; inf where all
    # of a tool lies inside its contact zone. Negative where nothing is proved.
    low: Array
    lowest: float  # smallest one of them
    distance: float  # smallest distance measured in [m], never above the truth; inf where none was
    at: float  # its time
    touches: tuple[float, ...]  # times at which the bodies touch
    unproved: tuple[float, ...]  # times at which steps begin in which the necessary distance could not be proved
    demand: float  # distance in [m] that is demanded; where only contact is forbidden, more than rounding
    needed: float  # distance in [m] that had to be proved: less than the demand once a smaller distance was measured
    cuts: int  # number of steps that were searched in finer steps
    at_surface: tuple[int, int] | None = None  # first and last sample of a tool at work at the part; None if never

    @classmethod
    def of(
        cls, row: int, pair: ScenePair, state: PairState, *, low: Array, lowest: float, span: tuple[int, int] | None
    ) -> "PairBound":
        """The result of a search that has ended."""
        return cls(
            row=row,
            pair=pair,
            low=low,
            lowest=lowest,
            distance=state.distance,
            at=state.at,
            touches=tuple(state.touches),
            unproved=tuple(state.unproved),
            demand=state.demand,
            needed=state.needed,
            cuts=state.cuts,
            at_surface=span,
        )

    @property
    def keeps_clearance(self) -> bool:
        """Whether the pair is to keep the clearance of the cell, not only to be free of contact."""
        return self.pair.rule is Rule.CLEARANCE

    @property
    def is_compared(self) -> bool:
        """Whether it counts for the smallest distance: where it is watched on a part of a way, only if it falls short.

        Otherwise its smallest distance is that at the end of that part, which says nothing of the cell.
        """
        return self.keeps_clearance and (self.pair.samples is None or not self.is_met)

    @property
    def is_open(self) -> bool:
        """Whether the pair was neither found to touch or to come too near, nor proved not to."""
        return bool(self.unproved and not self.touches and self.lowest < self.needed)

    @property
    def nearest(self) -> float:
        """Smallest distance found in [m]: zero when the pair touches, inf when it was not measured."""
        return 0.0 if self.touches else self.distance

    @property
    def proved(self) -> float:
        """Distance in [m] that the pair is proved to keep over the whole motion; zero when it touches."""
        return max(0.0, min(self.nearest, self.lowest))

    @property
    def is_met(self) -> bool:
        """Whether the demand is proved: the clearance of the pair, or that it does not touch."""
        if self.keeps_clearance:
            return not self.touches and self.proved >= self.demand
        return not self.touches and not self.is_open


@dataclass(frozen=True, kw_only=True, eq=False)
class Bound:
    """What is proved of all pairs over a motion."""

    scene: Scene
    q: Array  # stacked joint positions in [rad] or [m], shape (N, nq)
    edges: Indices  # samples at which blocks begin and end, ascending from 0 to N - 1, shape (K + 1,)
    low: Array  # ``PairBound.low`` of all pairs, shape (pairs, K)
    states: Sequence[PairState]  # in which the searches of all pairs ended
    at_surface: Mapping[int, tuple[int, int]]  # ``PairBound.at_surface`` by row

    @cached_property
    def pairs(self) -> tuple[PairBound, ...]:
        """All pairs, in the order of the scene."""
        return tuple(map(self._pair, range(len(self.states))))

    def _pair(self, row: int) -> PairBound:
        pair, state, span = self.scene.pairs[row], self.states[row], self.at_surface.get(row)
        return PairBound.of(row, pair, state, low=self.low[row], lowest=float(self._lowest[row]), span=span)

    @cached_property
    def _lowest(self) -> Array:
        """Smallest bound of each pair in [m], shape (pairs,)."""
        return self.low.min(axis=1, initial=np.inf)

    @cached_property
    def is_met(self) -> bool:
        """Whether every pair is proved to keep what is demanded of it; most do by their bounds alone."""
        nearest, demands = (
            np.array([(0.0 if it.touches else it.distance, it.demand) for it in self.states]).reshape(-1, 2).T
        )
        doubted = np.flatnonzero(np.minimum(nearest, self._lowest) < demands)
        return all(self._pair(row).is_met for row in doubted.tolist())

    @property
    def minimum(self) -> float:
        """Distance in [m] that all pairs are proved to keep that are to keep the clearance; inf without such pairs."""
        return min((pair.proved for pair in self.pairs if pair.keeps_clearance), default=np.inf)

    def of_class(self, kind: ClearanceClass) -> list[PairBound]:
        """All pairs of a class: none of them may touch."""
        return [pair for pair in self.pairs if pair.pair.clearance_class is kind]

    def names(self, pair: PairBound) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        return self.scene.names(pair.pair)

    def lowest_bounds(self, pairs: Sequence[PairBound]) -> Array:
        """Smallest bound of some pairs in each block in [m], shape (K,)."""
        rows, lowest = np.array([pair.row for pair in pairs], dtype=np.intp), np.full(self.low.shape[1], np.inf)
        for first in range(0, len(rows), ROWS_AT_ONCE):
            np.minimum(lowest, self.low[rows[first : first + ROWS_AT_ONCE]].min(axis=0), out=lowest)
        return lowest

    def nearest_points(self, pair: PairBound) -> tuple[Array, Array] | None:
        """Points of a pair where it is nearest, in the world in [m]; None when it touches or was not measured."""
        if pair.touches or not np.isfinite(pair.distance):
            return None
        before = min(int(pair.at), len(self.q) - 2)
        share = pair.at - before
        q = (1.0 - share) * self.q[before] + share * self.q[before + 1]
        scene, ends = self.scene, pair.pair.solids
        if ends is None:
            solid, ground = pair.pair.first, scene.bodies[pair.pair.second]
            poses = scene.pair_poses((solid, solid), q[None])
            points = point_above(scene.engine, solid, poses, X_WS=ground.X_BS, sample=0)
        else:
            points = nearest_points(scene.engine, ends, scene.pair_poses(ends, q[None]), sample=0)
        return points.first, points.second
