"""How far one program may be shifted in time against another until a pair of bodies no longer keeps its demand.

Branch and bound over all places of both programs that some shift up to the largest brings together. Boxes that are
proved are done, however large the shift in them. Of those that are not, the smallest shift counts: it is what is
proved, and it grows as these boxes are cut, until one is found in which the demand is not kept, or which is too small
to matter.

Boxes round the diagonal, where no shift brings the two apart, are the smallest: there each robot counts as if it moved
past the other, though a tool at work moves with the part. Of pairs that need many of them the distance d on one clock
is proved once, by ``certify``. A shift displaces either body by the way it makes within it, so that a pair with the
demand m keeps it up to the shift within which one of the two makes no way longer than d - m.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.free_clocks.free_boxes import BoxBounds, Boxes, is_below
from cellplan.certify.free_clocks.free_clocks import RESOLUTION, band, watched_pairs
from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.certify.run_pairs import scene_of_rows
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.scene.pairs import Rule

WIDE_SHARE: Final = 0.5  # [-] of the shift that is still possible: wider boxes are cut before the engine is asked
SHIFT_SHARE: Final = 0.1  # [-] a shift is known when what is proved is less than what is found by this share
SHIFT_TOL: Final = 1e-5  # [s] or by this
AT_ONCE: Final = 4096  # boxes cut at once
READ_AT_ONCE: Final = 128  # boxes of them in which the engine is asked
MAX_READINGS: Final = 6000  # of two robots; boxes that are open by then limit the shift
MAX_BOXES: Final = 400_000  # likewise
HOPE: Final = 0.5  # [-] share of what a box is too large by that is left after it is cut on both sides
COARSE: Final = 4  # rectangles of the band in one box at first
ON_ONE_CLOCK: Final = 64  # places without a shift that are tried first: a program that breaks a demand allows none
FIRST_READINGS: Final = 32  # at these
FLOOR_READINGS: Final = 2000  # after so many the distance on one clock is proved of pairs that are open there
FLOOR_BOXES: Final = 60_000  # or with so many open boxes
HALVINGS: Final = 24  # of a shift that is searched by halving


@dataclass(frozen=True, slots=True, kw_only=True)
class ShiftBound:
    """What is proved of two robots when the one is shifted against the other."""

    shift: float  # in [s]; all pairs of bodies keep their demand whenever the times of both differ by no more than this
    bodies: tuple[str, str] | None = None  # the pair that limits it; None where nothing does up to the largest shift
    at: tuple[float, float] | None = None  # row of each where it does


def free_shift(motion: FreeMotion, times: Array, first: str, second: str, *, most: float) -> ShiftBound:
    """The largest shift, up to ``most`` in [s], that is proved to keep all demands on pairs of bodies of two robots.

    ``times`` are those of the rows in [s], shape (N,).
    """
    return _ShiftSearch(motion, times, first, second, most).run()


class _ShiftSearch:
    """The search of two robots."""

    def __init__(self, motion: FreeMotion, times: Array, first: str, second: str, most: float) -> None:
        """Bound all pairs over the whole band."""
        self._motion, self._times = motion, times
        self._pairs = watched_pairs(motion.scene, first, second)
        self._bounds = BoxBounds(motion, self._pairs.ends)
        self._shift = most
        self._pair: int | None = None
        self._at: tuple[float, float] | None = None
        rows, count = _merged(band(times, -most, most)), len(self._pairs.rows)
        self._most, self._floors = most, np.zeros(count)  # [s] shifts up to which each pair is proved already
        self._has_floor: Flags = np.zeros(count, dtype=bool)
        self._boxes = self._bounds.start(np.repeat(np.arange(count), len(rows)), np.tile(rows, (count, 1)))

    def run(self) -> ShiftBound:
        """Cut boxes until all are proved that lie nearer than what limits the shift."""
        self._try_one_clock()
        while True:
            boxes, smallest = self._open()
            if not len(boxes):
                break
            order = np.argsort(smallest, kind="stable")
            if self._bounds.readings >= FLOOR_READINGS or len(boxes) > FLOOR_BOXES:
                waiting = np.unique(boxes.pair[(smallest == 0.0) & ~self._has_floor[boxes.pair]])
                if waiting.size:
                    self._raise_floors(waiting)
                    continue
            if self._bounds.readings >= MAX_READINGS or len(boxes) > MAX_BOXES:
                self._limit(boxes.some(order[:1]), float(smallest[order[0]]))
                break
            self._boxes = Boxes.joined(
                boxes.some(order[AT_ONCE:]), *self._advanced(boxes.some(order[:AT_ONCE]), smallest[order[:AT_ONCE]])
            )
        scene, pair = self._motion.scene, self._pair
        bodies = None if pair is None else scene.names(scene.pairs[int(self._pairs.rows[pair])])
        return ShiftBound(shift=self._shift, bodies=bodies, at=self._at)

    def _open(self) -> tuple[Boxes, Array]:
        """Boxes that are not proved and may limit the shift, and the smallest shift of each in [s], shape (M,)."""
        boxes, smallest = self._boxes, self._smallest(self._boxes)
        is_open = (boxes.low < self._pairs.demands[boxes.pair]) & (smallest < self._shift)
        is_open &= _largest(boxes.rows, self._times) > self._floors[boxes.pair]
        return boxes.some(is_open), smallest[is_open]

    def _try_one_clock(self) -> None:
        """Limit the shift to zero where a demand is not kept at some places of both programs without any shift."""
        count, places = len(self._pairs.rows), np.linspace(0.0, len(self._times) - 1, ON_ONE_CLOCK)
        rows = np.repeat(places[:, None], 4, axis=1)
        boxes = self._bounds.start(np.repeat(np.arange(count), len(rows)), np.tile(rows, (count, 1)))
        failing = np.flatnonzero(boxes.low < self._pairs.demands[boxes.pair])
        boxes = boxes.some(failing[np.argsort(boxes.low[failing], kind="stable")[:FIRST_READINGS]])
        read, readings = self._bounds.read(boxes, self._pairs.demands[boxes.pair])
        for place, reading in enumerate(readings):
            if is_below(reading, float(self._pairs.demands[read.pair[place]])):
                self._limit(read.some([place]), 0.0)

    def _raise_floors(self, pairs: Indices) -> None:
        """Prove what the distance on one clock allows, of some pairs."""
        motion, scene = self._motion, self._motion.scene
        rows = np.arange(len(self._times), dtype=float)
        q = np.concatenate([motion.positions(robot.name, rows) for robot in scene.cell.robots], axis=1)
        for place in pairs.tolist():
            alone = scene_of_rows(scene, [int(self._pairs.rows[place])])
            demand = float(self._pairs.demands[place])
            pair = replace(alone.pairs[0], rule=Rule.CLEARANCE, demand=demand)
            bound = certify(replace(alone, pairs=(pair,)), q, with_curves=False)
            self._has_floor[place] = True
            self._floors[place] = _shift_within(
                motion, self._times, self._pairs.ends[place], (bound.pairs[0].lowest - demand, self._most)
            )

    def _advanced(self, boxes: Boxes, smallest: Array) -> tuple[Boxes, ...]:
        """What becomes of some boxes, those of the smallest shift first."""
        boxes = self._bounds.sharpened(boxes)
        goals = self._pairs.demands[boxes.pair]
        is_open = boxes.low < goals
        boxes, smallest, goals = boxes.some(is_open), smallest[is_open], goals[is_open]
        is_cut = boxes.is_read | (boxes.gap - HOPE * (boxes.gap - boxes.low) >= goals)
        is_cut |= self._cut_widths(boxes) > 0.5 * WIDE_SHARE * self._shift
        queried = np.flatnonzero(~is_cut)
        queried, waiting = queried[:READ_AT_ONCE], queried[READ_AT_ONCE:]
        read, readings = self._bounds.read(boxes.some(queried), goals[queried])
        for place, reading in enumerate(readings):
            if is_below(reading, float(goals[queried[place]])):
                t_first, t_second = np.interp(read.middles[place], np.arange(len(self._times)), self._times)
                self._limit(read.some([place]), float(abs(t_second - t_first)))
        read = self._bounds.sharpened(read)
        cut = Boxes.joined(boxes.some(is_cut), read.some(read.low < goals[queried]))
        return boxes.some(waiting), self._bounds.halves(self._without_fine(cut))

    def _without_fine(self, boxes: Boxes) -> Boxes:
        """Boxes without those too small to matter, which limit the shift instead."""
        smallest = self._smallest(boxes)
        is_fine: Flags = self._widths(boxes.rows) <= np.maximum(SHIFT_TOL, SHIFT_SHARE * smallest)
        is_fine |= boxes.is_read & (boxes.reach.sum(axis=1) <= RESOLUTION)
        fine: Indices = np.flatnonzero(is_fine)
        if fine.size:
            nearest = int(fine[np.argmin(smallest[fine])])
            self._limit(boxes.some([nearest]), float(smallest[nearest]))
        return boxes.some(~is_fine)

    def _widths(self, rows: Array) -> Array:
        """Range of the differences of both times in each box in [s], shape (M,)."""
        t = np.interp(rows, np.arange(len(self._times)), self._times)
        return (t[:, 1] - t[:, 0]) + (t[:, 3] - t[:, 2])

    def _cut_widths(self, boxes: Boxes) -> Array:
        """Length in [s] of the stretch of each box that would be cut: not that of a robot that stands still."""
        t = np.interp(boxes.rows, np.arange(len(self._times)), self._times)
        return np.where(boxes.reach[:, 1] > boxes.reach[:, 0], t[:, 3] - t[:, 2], t[:, 1] - t[:, 0])

    def _smallest(self, boxes: Boxes) -> Array:
        """Smallest shift in each box that is not proved by the distance on one clock, in [s], shape (M,)."""
        t = np.interp(boxes.rows, np.arange(len(self._times)), self._times)
        return np.maximum(np.maximum(t[:, 2] - t[:, 1], t[:, 0] - t[:, 3]), self._floors[boxes.pair])

    def _limit(self, box: Boxes, shift: float) -> None:
        if shift < self._shift:
            first, second = box.middles[0].tolist()
            self._shift, self._pair, self._at = shift, int(box.pair[0]), (first, second)


def _merged(rectangles: Array) -> Array:
    """Fewer and larger rectangles round those of a band."""
    first = np.arange(0, len(rectangles), COARSE)
    sign = np.array([1.0, -1.0, 1.0, -1.0])
    return np.minimum.reduceat(rectangles * sign, first) * sign


def _largest(rows: Array, times: Array) -> Array:
    """Largest difference of both times in each box in [s], shape (M,)."""
    t = np.interp(rows, np.arange(len(times)), times)
    return np.maximum(t[:, 3] - t[:, 0], t[:, 1] - t[:, 2])


def _shift_within(motion: FreeMotion, times: Array, bodies: Indices, most: tuple[float, float]) -> float:
    """Largest shift in [s] within which one of two bodies makes no way longer than it may, anywhere.

    Args:
        times: Times of the rows in [s], shape (N,).
        bodies: The two bodies of the engine, shape (2,).
        most: Largest way in [m], and largest shift in [s].
    """
    margin, high = most
    low = 0.0
    for _ in range(HALVINGS if margin > 0.0 else 0):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _displaced(motion, times, bodies, middle) <= margin else (low, middle)
    return low


def _displaced(motion: FreeMotion, times: Array, bodies: Indices, shift: float) -> float:
    """Upper bound of the way in [m] of that one of two bodies which gets less far within a shift in [s].

    Ways are linear between rows, so those within a shift are between the times at which it begins or ends at a row.
    """
    begin = np.unique(np.clip(np.concatenate([times, times - shift]), times[0], times[-1]))
    rows = [np.interp(t, times, np.arange(len(times))) for t in (begin, np.minimum(begin + shift, times[-1]))]
    largest = []
    for body in bodies.tolist():
        at_begin, at_end = (motion.travel(np.full(len(end_rows), body), end_rows) for end_rows in rows)
        travel = at_end - at_begin
        largest.append(np.maximum(travel[:-1], travel[1:]))
    return float(np.minimum(*largest).max(initial=0.0))
