"""The certificate: the one entry of this layer."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

import numpy as np

from cellplan.certify.bound import ROWS_AT_ONCE, Bound
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_search import GroundSearch, Search, SolidSearch
from cellplan.certify.survey import Survey
from cellplan.geometry.arrays import Array, Indices
from cellplan.model.report.report import ClearanceClass
from cellplan.scene.collision.continuous.motion_bound import BodyMotion, Pair
from cellplan.scene.collision.distance import TIGHT_TOL, Reading, measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.pairs import ScenePair
from cellplan.scene.scene import Scene

CHUNK_WORK: Final = 400_000  # bodies times samples searched at once: 40 MB of poses
MAX_SAMPLES: Final = 16_384  # samples searched at once, however few bodies there are
MIN_SAMPLES: Final = 512  # likewise, however many bodies there are
PAIR_WORK: Final = 2_000_000  # pairs times blocks bounded at once: 100 MB
FIRST_READINGS: Final = 12  # pairs of each class measured once before any search: a small distance saves much later
SURFACE_TOL: Final = 1e-4  # [m] nearer than this counts as touching: tracking errors of a micrometre decide nothing
CURVE_FRACTION: Final = 0.05  # [-] of the distance in the middle of its block: a bound this far below is drawn as it is
CURVE_TOL: Final = 1e-3  # [m] likewise by this length


def certify(
    scene: Scene,
    q: Array,
    *,
    with_minimum: bool = True,
    with_curves: bool = True,
    arms: LeverArms | None = None,
    progress: Callable[[float], object] | None = None,
) -> Bound:
    """Bound the distance of every pair of bodies from below, at the samples of a motion and between them.

    Between two samples every joint moves linearly, so what is proved holds at all times. The verdict comes first: that
    nothing touches and that every pair keeps what is demanded of it. The smallest distances are searched for after it.

    Args:
        scene: The scene; the rules of its pairs may depend on the run, see ``scene_of_run``.
        q: Stacked joint positions in [rad] or [m], shape (N, nq), N at least 2.
        with_minimum: Whether the smallest distances are searched for too. Otherwise the search ends with the first pair
            that does not keep its demand, and only ``Bound.is_met`` of the result is valid.
        with_curves: Whether the bounds of each class are then raised in every block, to be drawn; the verdict and the
            smallest distances are known before.
    """
    survey, arms = Survey(scene, q), arms or LeverArms(scene, q)
    for first, last in _stretches(survey):
        motion = StraightMotion.of_cell(scene, arms, q[survey.edges[first] : survey.edges[last] + 1])
        stretch = StretchSearch(survey, motion, first, last)
        if with_minimum:
            stretch.search_all()
            for kind in ClearanceClass if with_curves else ():
                stretch.raise_curve(kind)
            stretch.note_work()
        elif not stretch.prove_all():
            survey.low[:, last:] = -np.inf  # nothing is known of the rest
            break
        if progress is not None:
            progress(last / (len(survey.edges) - 1))
    return survey.bound()


def _stretches(survey: Survey) -> Iterator[tuple[int, int]]:
    """Runs of blocks small enough to be searched at once: the first block, and the first one after the last."""
    edges = survey.edges
    most = min(MAX_SAMPLES, max(MIN_SAMPLES, CHUNK_WORK // max(1, len(survey.scene.engine.bodies))))
    first = 0
    while first < len(edges) - 1:
        last = int(np.searchsorted(edges, edges[first] + most, side="right")) - 1
        last = max(last, first + 1)
        yield first, last
        first = last


class StretchSearch:
    """Some blocks of the motion, few enough to be searched at once."""

    def __init__(self, survey: Survey, motion: StraightMotion, first: int, last: int) -> None:
        """Bound all pairs over the stretch by the cheapest means; the survey receives what is found."""
        self._survey, self._motion, self._first, self._last = survey, motion, first, last
        self._scene = survey.scene
        self._edges = survey.edges[first : last + 1] - survey.edges[first]
        self._bound_solids()
        self._grounds: dict[int, GroundSearch] = {}
        for row in self._scene.ground_rows.tolist():
            begin = float(survey.edges[first])
            search = GroundSearch(self._scene.pairs[row], motion, state=survey.states[row], begin=begin)
            self._grounds[row] = search
            survey.lift(row, search, first)

    def prove_all(self) -> bool:
        """Prove what is demanded of every pair, the nearest first; ends with the first pair that does not keep it."""
        survey, lowest = self._survey, self._low().min(axis=1, initial=np.inf)
        for row in np.argsort(lowest, kind="stable").tolist():
            state = survey.states[row]
            state.is_verdict_only = True
            if lowest[row] < state.demand and (begun := self._begin(row, state.demand)) is not None:
                search, block = begun
                search.run(state.demand, with_minimum=False)
                survey.lift(row, search, block)
                if state.touches or self._low()[row].min() < state.demand:
                    return False
        return True

    def search_all(self) -> None:
        """Search every pair as far as it may be the nearest of its class or among the nearest of the cell."""
        lowest = self._low().min(axis=1, initial=np.inf)
        readings = {row: reading for kind in ClearanceClass for row, reading in self._first_readings(kind, lowest)}
        for row in np.argsort(lowest, kind="stable").tolist():
            if lowest[row] >= self._survey.largest_cutoff():
                break  # and so are all that follow
            self._search(row, readings.get(row))

    def raise_curve(self, kind: ClearanceClass) -> None:
        """Raise the bounds of a class in every block until the smallest of them is near the true distance."""
        rows = self._survey.rows(kind)
        if not len(rows):
            return
        rows = self._may_be_nearest(rows)
        low = self._low()[rows]
        refiner = CurveRefiner(self._scene.engine, self._motion, self._edges)
        refiner.raise_bounds(low, [self._scene.pairs[row].solids for row in rows.tolist()])
        self._low()[rows] = low

    def _may_be_nearest(self, rows: Indices) -> Indices:
        """Pairs that some block has a bound of that is no larger than a distance the pairs are known to come to there.

        That distance is the one at the beginning of the block, of the pair with the lowest bound: no larger than the
        distance of the centres of both spheres and their radii. Larger bounds are never the lowest, however far the
        others are raised.
        """
        if len(rows) <= ROWS_AT_ONCE:
            return rows
        low, pieces = self._low(), range(0, len(rows), ROWS_AT_ONCE)
        reached = np.full(low.shape[1], np.inf)
        for first in pieces:
            piece = rows[first : first + ROWS_AT_ONCE]
            lowest = piece[np.argmin(low[piece], axis=0)]
            np.minimum(reached, [self._reached(int(row), block) for block, row in enumerate(lowest)], out=reached)
        near = [np.any(low[rows[first : first + ROWS_AT_ONCE]] <= reached, axis=1) for first in pieces]
        return rows[np.concatenate(near)]

    def _reached(self, row: int, block: int) -> float:
        """A distance in [m] that a pair does not exceed at the beginning of a block; inf for one with a half-space."""
        ends = self._scene.pairs[row].solids
        if ends is None:
            return float(np.inf)
        first, second = (self._motion.centres[index][self._edges[block]] for index in ends)
        return float(np.linalg.norm(second - first) + self._scene.engine.radii[list(ends)].sum())

    def note_work(self) -> None:
        """Record the first and the last sample at which tools at work are at the part, whatever breaks there are."""
        begin, spans = int(self._survey.edges[self._first]), self._survey.at_surface
        for row in self._survey.at_work:
            pair = self._scene.pairs[row]
            span = _surface_span(self._scene.engine, (pair.first, pair.second), self._motion)
            if span is not None:
                spans[row] = spans.get(row, (begin + span[0], 0))[0], begin + span[1]

    def _low(self) -> Array:
        """The bounds of all pairs in the stretch, to be changed in place."""
        return self._survey.low[:, self._first : self._last]

    def _bound_solids(self) -> None:
        """Bounds of pairs of solids by their spheres: half of the gaps at both edges less the way of both centres."""
        engine, pairs, motion = self._scene.engine, self._scene.solid_pairs, self._motion
        if not len(pairs):
            return
        centres = np.array([motion.centres[index][self._edges].T for index in range(len(engine.bodies))])
        travels = np.empty((len(engine.bodies), self._last - self._first))
        for index in range(len(engine.bodies)):
            travel = np.linalg.norm(np.diff(motion.centres[index], axis=0), axis=1) + motion.bend[index] / 3.0
            travels[index] = np.add.reduceat(travel, self._edges[:-1])
        for first in range(0, len(pairs), step := max(1, PAIR_WORK // travels.shape[1])):
            a, b = pairs[first : first + step].T
            x, y, z = (centres[b, axis] - centres[a, axis] for axis in range(3))
            gaps = np.sqrt(x * x + (y * y + z * z)) - (engine.radii[a] + engine.radii[b])[:, None]
            low = 0.5 * (gaps[:, 1:] + gaps[:, :-1] - travels[a] - travels[b])
            self._low()[self._scene.solid_rows[first : first + step]] = low
        self._low()[self._survey.is_ignored[:, self._first : self._last]] = np.inf

    def _first_readings(self, kind: ClearanceClass, lowest: Array) -> Iterator[tuple[int, tuple[int, Reading]]]:
        """Measure the pairs of a class that seem nearest once, at an edge of the block where they do.

        The lowest bound of each pair in the stretch is in [m], shape (pairs,).
        """
        survey = self._survey
        rows = survey.rows(kind)
        rows = rows[np.isin(rows, self._scene.solid_rows, kind="table")]
        for row in rows[np.argsort(lowest[rows], kind="stable")][:FIRST_READINGS].tolist():
            if lowest[row] >= survey.best(kind):
                break
            block = int(np.argmin(self._low()[row]))
            sample = int(self._edges[block])
            reading = measure(self._scene.engine, _ends(self._scene.pairs[row]), self._motion.poses, sample=sample)
            if not reading.touches:
                survey.note_distance(row, reading.bound, float(survey.edges[self._first + block]))
            yield row, (sample, reading)

    def _search(self, row: int, known: tuple[int, Reading] | None) -> None:
        """Search one pair where it may matter; ``known`` is a sample that has been measured."""
        cutoff = self._survey.cutoff(row)
        begun = self._begin(row, cutoff)
        if begun is None:
            return
        search, block = begun
        sample = int(self._edges[block - self._first])
        if isinstance(search, SolidSearch) and known is not None and sample <= known[0] <= sample + len(search.low):
            search.take(known[0] - sample, known[1], cutoff)
        search.run(cutoff)
        self._survey.lift(row, search, block)

    def _begin(self, row: int, cutoff: float) -> tuple[Search, int] | None:
        """The search of a pair over the blocks with bounds below a cutoff, and the first of them; None without any."""
        open_ = np.flatnonzero(self._low()[row] < cutoff)
        if not open_.size:
            return None
        if row in self._grounds:
            return self._grounds[row], self._first
        block, ends = self._first + int(open_[0]), _ends(self._scene.pairs[row])
        motion = self._motion.part(ends, int(self._edges[open_[0]]), int(self._edges[open_[-1] + 1]))
        begin, state = float(self._survey.edges[block]), self._survey.states[row]
        return SolidSearch(self._scene.engine, ends, motion, state=state, begin=begin), block


def _ends(pair: ScenePair) -> Pair:
    """The engine's bodies of a pair of solids."""
    if pair.solids is None:
        raise ValueError("a pair without solids has no search by the engine")
    return pair.solids


def _surface_span(engine: Engine, pair: Pair, motion: BodyMotion) -> tuple[int, int] | None:
    """First and last sample at which two bodies touch, or very nearly so; None when there is none."""
    search = SolidSearch(engine, pair, motion)
    first = _at_surface(search, backwards=False)
    return None if first is None else (first, first if (last := _at_surface(search, backwards=True)) is None else last)


def _at_surface(search: SolidSearch, *, backwards: bool) -> int | None:
    """The first sample at the surface from one end; samples that are proved to be away from it are passed over."""
    away = np.zeros(len(search.low) + 1, dtype=bool)
    while True:
        is_step_away = search.low > SURFACE_TOL
        open_ = np.flatnonzero(~(away | np.append(False, is_step_away) | np.append(is_step_away, False)))
        if not open_.size:
            return None
        sample = int(open_[-1] if backwards else open_[0])
        reading = search.read(sample, 2.0 * SURFACE_TOL)
        if reading.touches or reading.bound <= SURFACE_TOL:
            return sample
        away[sample] = True


class CurveRefiner:
    """One class over a stretch of blocks."""

    def __init__(self, engine: Engine, motion: StraightMotion, edges: Indices) -> None:
        """Store the stretch; at ``edges`` blocks begin and end, from sample 0 to the last, shape (K + 1,)."""
        self._engine, self._motion, self._edges = engine, motion, edges
        self._middles = (edges[1:] + edges[:-1]) // 2

    def raise_bounds(self, low: Array, pairs: Sequence[Pair | None]) -> None:
        """Measure the pair with the lowest bound of a block in its middle until that is near what was measured.

        Certified lower bounds by pair and block in [m], shape (P, K), are raised in place; a pair that needs no
        measuring is None.
        """
        ceiling = np.full(low.shape[1], np.inf)  # [m] distance that is known to be reached in each block
        searches: dict[int, SolidSearch] = {}
        for block in range(low.shape[1]):
            measured: set[int] = set()
            while True:
                row = int(np.argmin(low[:, block]))
                pair = pairs[row]
                is_near = low[row, block] >= (1.0 - CURVE_FRACTION) * ceiling[block] - CURVE_TOL
                if is_near or pair is None or row in measured or low[row, block] == 0.0:
                    break
                measured.add(row)
                search = searches.get(row)
                if search is None:
                    search = searches[row] = SolidSearch(self._engine, pair, self._motion)
                self._measure(search, block, ceiling)
                bounds = np.minimum.reduceat(search.low, self._edges[:-1])
                np.maximum(low[row], bounds, out=low[row])

    def _measure(self, search: SolidSearch, block: int, ceiling: Array) -> None:
        """Measure in the middle of a block; what is reached there is nearly reached in the blocks around."""
        sample = int(self._middles[block])
        reading = search.read(sample, float(ceiling[block]))
        if reading.is_exact:
            moved = np.minimum(*search.relative.displacement(sample, self._middles))
            np.minimum(ceiling, reading.bound + 2.0 * TIGHT_TOL + moved, out=ceiling)
