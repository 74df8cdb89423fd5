"""The work of a survey: stretch by stretch through the program, pair by pair, the nearest first."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.certify.curves import CurveRefiner
from cellplan.certify.ground import GroundSearch
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.survey import ROWS_AT_ONCE, Rows, Survey
from cellplan.collision.continuous.at_surface import surface_span
from cellplan.collision.continuous.interval_search import SolidSearch
from cellplan.collision.distance import Reading, measure
from cellplan.geometry.transforms import Array
from cellplan.model.progress import Progress, silent
from cellplan.model.report import ClearanceClass
from cellplan.scene.scene import Scene

CHUNK_WORK: Final = 400_000  # [-] bodies times samples worked on at once: 40 MB of poses
MOST_SAMPLES: Final = 16_384  # [-] samples worked on at once, however few bodies there are
PAIR_WORK: Final = 2_000_000  # [-] pairs times blocks bounded at once: 100 MB
FIRST_LOOKS: Final = 12  # [-] pairs of each class measured once before any search: a small distance saves much later


def survey(scene: Scene, q: Array, *, progress: Progress = silent, stage: str = "") -> Survey:
    """Search a program for contacts and for the smallest distances, at the samples and between them.

    Args:
        scene: The scene.
        q: Stacked joint positions in [rad] or [m], shape (N, nq), N at least 2.
        progress: Who wants to know how far it is.
        stage: What it is told.
    """
    found = Survey(scene, q)
    arms = LeverArms(scene, q)
    for first, last in _stretches(found):
        motion = StraightMotion.of_cell(scene, arms, q[found.edges[first] : found.edges[last] + 1])
        stretch = _Stretch(found, motion, first, last)
        stretch.search_all()
        for kind in ClearanceClass:
            stretch.raise_curve(kind)
        stretch.note_work()
        progress(stage, 0.9 * last / (len(found.edges) - 1))
    return found


def _stretches(found: Survey) -> Iterator[tuple[int, int]]:
    """Runs of blocks small enough to be worked on at once: the first block, and the first one after the last."""
    most = min(MOST_SAMPLES, max(512, CHUNK_WORK // max(1, len(found.scene.engine.bodies))))
    first = 0
    while first < len(found.edges) - 1:
        last = int(np.searchsorted(found.edges, found.edges[first] + most, side="right")) - 1
        last = max(last, first + 1)
        yield first, last
        first = last


class _Stretch:
    """Some blocks of the program."""

    def __init__(self, found: Survey, motion: StraightMotion, first: int, last: int) -> None:
        """Bound all pairs over the stretch by the cheapest means."""
        self._found, self._motion, self._first, self._last = found, motion, first, last
        self._scene, self._solid = found.scene, found.solid_ends
        self._edges = found.edges[first : last + 1] - found.edges[first]
        self._bound_solids()
        self._grounds: dict[int, GroundSearch] = {}
        for row in self._scene.ground_rows.tolist():
            begin = float(found.edges[first])
            search = GroundSearch(self._scene.pairs[row], motion, found=found.found[row], begin=begin)
            self._grounds[row] = search
            found.lift(row, search, first)

    def search_all(self) -> None:
        """Search every pair as far as it matters."""
        lowest = self._low().min(axis=1, initial=np.inf)
        looks = {row: look for kind in ClearanceClass for row, look in self._first_looks(kind, lowest)}
        for row in np.argsort(lowest, kind="stable").tolist():
            if lowest[row] >= self._found.largest_cutoff():
                break  # and so are all that follow
            self._search(row, looks.get(row))

    def raise_curve(self, kind: ClearanceClass) -> None:
        """Raise the bounds of a class in every block so far that the smallest of them says something."""
        rows = self._found.rows(kind)
        if not len(rows):
            return
        rows = self._may_be_nearest(rows)
        low = self._low()[rows]
        refiner = CurveRefiner(self._scene.engine, self._motion, self._edges)
        refiner.raise_bounds(low, [self._solid.get(row) for row in rows.tolist()])
        self._low()[rows] = low

    def _may_be_nearest(self, rows: Rows) -> Rows:
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
        chosen: Rows = rows[np.concatenate(near)]
        return chosen

    def _reached(self, row: int, block: int) -> float:
        """A distance in [m] that a pair does not exceed at the beginning of a block; inf for one with a half-space."""
        ends = self._solid.get(row)
        if ends is None:
            return float(np.inf)
        first, second = (self._motion.centres[index][self._edges[block]] for index in ends)
        return float(np.linalg.norm(second - first) + self._scene.engine.radii[list(ends)].sum())

    def note_work(self) -> None:
        """Write down from when to when tools at work are at the part, whatever breaks there are."""
        begin, spans = int(self._found.edges[self._first]), self._found.at_surface
        for row in self._found.at_work:
            pair = self._scene.pairs[row]
            span = surface_span(self._scene.engine, (pair.first, pair.second), self._motion)
            if span is not None:
                spans[row] = spans.get(row, (begin + span[0], 0))[0], begin + span[1]

    def _low(self) -> Array:
        """The bounds of all pairs in the stretch, to be changed in place."""
        return self._found.low[:, self._first : self._last]

    def _bound_solids(self) -> None:
        """Bounds of pairs of solids by their spheres: half of the gaps at both edges less the way of both centres."""
        engine, pairs, motion = self._scene.engine, self._scene.solid_pairs, self._motion
        if not len(pairs):
            return
        centres = np.array([motion.centres[index][self._edges].T for index in range(len(engine.bodies))])
        ways = np.empty((len(engine.bodies), self._last - self._first))
        for index in range(len(engine.bodies)):
            way = np.linalg.norm(np.diff(motion.centres[index], axis=0), axis=1) + motion.bend[index] / 3.0
            ways[index] = np.add.reduceat(way, self._edges[:-1])
        for first in range(0, len(pairs), step := max(1, PAIR_WORK // ways.shape[1])):
            a, b = pairs[first : first + step].T
            x, y, z = (centres[b, axis] - centres[a, axis] for axis in range(3))
            gaps = np.sqrt(x * x + (y * y + z * z)) - (engine.radii[a] + engine.radii[b])[:, None]
            low = 0.5 * (gaps[:, 1:] + gaps[:, :-1] - ways[a] - ways[b])
            self._low()[self._scene.solid_rows[first : first + step]] = low

    def _first_looks(self, kind: ClearanceClass, lowest: Array) -> Iterator[tuple[int, tuple[int, Reading]]]:
        """Measure the pairs of a class that seem nearest once, at an edge of the block where they do.

        Args:
            kind: The class.
            lowest: The lowest bound of each pair in the stretch in [m], shape (pairs,).
        """
        found = self._found
        rows = found.rows(kind)
        rows = rows[np.isin(rows, self._scene.solid_rows, kind="table")]
        for row in rows[np.argsort(lowest[rows], kind="stable")][:FIRST_LOOKS].tolist():
            if lowest[row] >= found.best(kind):
                break
            block = int(np.argmin(self._low()[row]))
            sample = int(self._edges[block])
            reading = measure(self._scene.engine, self._solid[row], self._motion.poses, sample=sample)
            if not reading.touches and reading.bound < found.found[row].distance:
                found.found[row].distance = reading.bound
                found.found[row].at = float(found.edges[self._first + block])
                found.remember(row)
            yield row, (sample, reading)

    def _search(self, row: int, look: tuple[int, Reading] | None) -> None:
        """Search one pair where it may matter."""
        found, cutoff = self._found, self._found.cutoff(row)
        open_ = np.flatnonzero(self._low()[row] < cutoff)
        if not open_.size:
            return
        ground = self._grounds.get(row)
        if ground is not None:
            ground.run(cutoff)
            found.lift(row, ground, self._first)
            return
        block, begin, end = self._first + int(open_[0]), int(self._edges[open_[0]]), int(self._edges[open_[-1] + 1])
        search = SolidSearch(
            self._scene.engine,
            self._solid[row],
            self._motion.part(self._solid[row], begin, end),
            found=found.found[row],
            begin=float(found.edges[block]),
        )
        if look is not None and begin <= look[0] <= end:
            search.take(look[0] - begin, look[1], cutoff)
        search.run(cutoff)
        found.lift(row, search, block)
