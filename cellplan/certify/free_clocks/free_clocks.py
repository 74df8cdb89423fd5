"""Distances of robots whose clocks are independent: proved for all places of one program against all of another.

Two robots on one clock are at one place of a motion at a time, and ``certify`` bounds their distance there. Where they
share no clock, any place of the one program may meet any place of the other within some region of both. Branch and
bound over that region proves what is demanded of every pair of bodies in it: never on a grid of shifts, but in boxes
that cover the region (``free_boxes``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.certify.free_clocks.free_boxes import BoxBounds, Boxes, is_below
from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.scene.collision.distance import Reading
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

RESOLUTION: Final = 1e-6  # [m] boxes in which nothing gets farther than this are not cut any more
MINIMUM_TOL: Final = 5e-4  # [m] a smallest distance is searched until nothing can be nearer by more than this
AT_ONCE: Final = 8192  # boxes cut at once
READ_AT_ONCE: Final = 192  # boxes of them in which the engine is asked
MAX_READINGS: Final = 40_000  # of one region
MAX_BOXES: Final = 1_500_000  # likewise; those that are not proved by then stay unproved
HOPE: Final = 0.5  # [-] share of what a box is too large by that is left after it is cut on both sides
BAND_PARTS: Final = 8  # rectangles across a band: each reaches beyond it by so small a share
MAX_BAND: Final = 2000  # rectangles along a band
GROUP: Final = 16  # rectangles that are bounded together at first
CORNERS: Final = np.array([1.0, -1.0, 1.0, -1.0])  # the smallest of these multiples is the box round rectangles


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ClockRegion:
    """Places of the programs of two robots that may meet."""

    first: str  # the one robot
    second: str  # the other one
    # rows of the first robot from a0 to a1 with those of the second from b0 to b1, as (a0, a1, b0, b1), fractions
    # between rows allowed, shape (R, 4)
    rectangles: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class RegionBound:
    """What is proved of all pairs of bodies of two robots in a region."""

    first: str  # the one robot
    second: str  # the other one
    # the pair that does not keep what is demanded of it, or of which too little is proved, or else the nearest; None
    # when none is known
    bodies: tuple[str, str] | None
    # smallest distance measured in [m], that of these two, never above the truth; zero where they touch; inf where none
    # was measured
    distance: float
    proved: float  # distance in [m] that all pairs with the rule ``clearance`` keep for certain; inf without such pairs
    at: tuple[float, float] | None  # row of the first robot and of the second where they are; None for none
    is_met: bool  # whether every pair is proved to keep its demand, and not to touch where no more is demanded
    demand: float = 0.0  # distance in [m] that is demanded of the two bodies


def certify_regions(
    scene: Scene, q: Array | Mapping[str, Array], regions: Sequence[ClockRegion], *, with_minimum: bool = False
) -> tuple[RegionBound, ...]:
    """Bound the distance of all pairs of bodies of two robots in regions of their programs, one result a region.

    A pair counts where the one body moves with the first robot and the other with the second: links, tool, what is
    mounted on it, and the part with its first holder. Between two rows every joint moves linearly.

    Args:
        scene: The scene; the rules of its pairs may depend on the run, see ``scene_of_run``.
        q: Stacked joint positions in [rad] or [m], shape (N, nq); or rows by robot, shape (N, n), not necessarily as
            many for each. Two rows at least.
        with_minimum: Whether the smallest distance of each region is searched for too, to half a millimetre. Otherwise
            the search of a region ends with the first pair that does not keep its demand.

    Raises:
        ValueError: A region names one robot twice, or rows that are not there.
    """
    motion = FreeMotion(scene, q)
    for region in regions:
        _refuse(motion, region)
    return tuple(_RegionSearch(motion, region).run(with_minimum=with_minimum) for region in regions)


def band(times: Array, low: float, high: float, *, parts: int = BAND_PARTS) -> Array:
    """Rectangles that cover all places of two programs of the same rows with low <= t_B - t_A <= high.

    Args:
        times: Times of the rows in [s], shape (N,).
        low: Smallest difference in [s].

    Returns:
        Rectangles, see ``ClockRegion``, shape (R, 4). They reach beyond the band by less than one of ``parts`` of its
        width or a two-thousandth of the program, whichever is more.
    """
    if not low <= high:
        raise ValueError(f"band: expected low <= high, got {low} and {high}")
    begin, end = max(0.0, float(times[0])), float(times[-1])
    begin_A, end_A = max(begin, begin - high), min(end, end - low)
    if begin_A > end_A:
        return np.zeros((0, 4))
    widest = max((high - low) / parts, (end - begin) / MAX_BAND)
    edges = np.linspace(begin_A, end_A, 1 + max(1, int(np.ceil((end_A - begin_A) / max(widest, 1e-12)))))
    t_A = np.column_stack([edges[:-1], edges[1:]])
    t_B = np.clip(t_A + np.array([low, high]), begin, end)
    return np.interp(np.column_stack([t_A, t_B]), times, np.arange(len(times)))


@dataclass(frozen=True, slots=True, eq=False)
class RobotPairs:
    """The pairs of the bodies of two robots."""

    rows: Indices  # their places in ``Scene.pairs``, shape (P,)
    ends: Indices  # the engine's body of the first robot and that of the second, shape (P, 2)
    demands: Array  # what is to be proved in [m], shape (P,)
    keeps: Flags  # whether the clearance is demanded, not only that nothing touches, shape (P,)


def watched_pairs(scene: Scene, first: str, second: str) -> RobotPairs:
    """All pairs of which the one body is carried by the first robot and the other by the second."""
    rows, ends, demands = list[int](), list[tuple[int, int]](), list[float]()
    robots = [scene.carrier(index).robot for index in range(len(scene.engine.bodies))]
    for row in scene.solid_rows.tolist():
        pair = scene.pairs[row]
        u, v = pair.solids or (0, 0)
        carriers = robots[u], robots[v]
        if set(carriers) == {first, second}:
            rows.append(row)
            ends.append((u, v) if carriers[0] == first else (v, u))
            demands.append(pair.least_distance)
    return RobotPairs(
        np.array(rows, dtype=np.intp),
        np.array(ends, dtype=np.intp).reshape(-1, 2),
        np.array(demands),
        np.array([scene.pairs[row].rule is Rule.CLEARANCE for row in rows], dtype=bool),
    )


class _RegionSearch:
    """The search of one region.

    It starts from groups of rectangles, each in one box round all of them; those of which too little is proved are
    searched rectangle by rectangle.
    """

    def __init__(self, motion: FreeMotion, region: ClockRegion) -> None:
        """Bound all pairs in the rectangles of the region."""
        self._motion, self._region = motion, region
        self._pairs = watched_pairs(motion.scene, region.first, region.second)
        self._bounds = BoxBounds(motion, self._pairs.ends)
        self._rectangles = np.asarray(region.rectangles, dtype=float).reshape(-1, 4)
        first = np.arange(0, len(self._rectangles), GROUP)
        hulls = np.minimum.reduceat(self._rectangles * CORNERS, first) * CORNERS if len(first) else np.zeros((0, 4))
        count = len(self._pairs.rows)
        self._group = np.tile(first, count)
        self._groups = self._bounds.start(np.repeat(np.arange(count), len(first)), np.tile(hulls, (count, 1)))
        self._boxes = self._groups.some(np.zeros(0, dtype=np.intp))
        self._is_broken: Flags = np.zeros(count, dtype=bool)
        self._given_up = np.inf  # [m] lowest bound of boxes that were given up
        self._nearest = np.inf
        self._at: tuple[float, float] | None = None
        self._bodies: int | None = None  # the pair, by its place

    def run(self, *, with_minimum: bool) -> RegionBound:
        """Prove the demands, and find the smallest distance where it is asked for."""
        pairs = self._pairs
        is_proved = self._raise(lambda: pairs.demands, stops=True)
        if with_minimum and pairs.keeps.any():
            self._measure_first()
            self._raise(self._below_nearest, stops=False)
        return self._result(is_met=is_proved)

    def _below_nearest(self) -> Array:
        """What is left to prove in [m] of a smallest distance, shape (P,); nothing where bodies touch."""
        level = self._nearest - MINIMUM_TOL
        return np.where(self._pairs.keeps & (level > 0.0), level, -np.inf)

    def _raise(self, goals: Callable[[], Array], *, stops: bool) -> bool:
        """Cut and read boxes until all bounds reach the goals of their pairs in [m], shape (P,); whether they do."""
        while self._bounds.readings < MAX_READINGS and len(self._boxes) < MAX_BOXES:
            levels = goals()
            self._ungroup(levels)
            boxes = self._boxes
            open_ = np.flatnonzero(boxes.low < levels[boxes.pair])
            if stops and np.any(self._is_broken):
                break
            if not open_.size:
                return True
            if open_.size > AT_ONCE:
                open_ = open_[np.argpartition(boxes.low[open_], AT_ONCE)[:AT_ONCE]]
            open_ = open_[np.argsort(boxes.low[open_], kind="stable")]
            rest = np.ones(len(boxes), dtype=bool)
            rest[open_] = False
            self._boxes = Boxes.joined(boxes.some(rest), *self._advanced(boxes.some(open_), levels))
        return False

    def _ungroup(self, levels: Array) -> None:
        """Put the rectangles of groups of which too little is proved in the place of these."""
        is_open = self._groups.low < levels[self._groups.pair]
        if not np.any(is_open):
            return
        places = self._group[is_open][:, None] + np.arange(GROUP)
        pair = np.broadcast_to(self._groups.pair[is_open][:, None], places.shape)
        is_there = places < len(self._rectangles)
        new = self._bounds.start(pair[is_there], self._rectangles[places[is_there]])
        self._boxes = Boxes.joined(self._boxes, new)
        self._group, self._groups = self._group[~is_open], self._groups.some(~is_open)

    def _advanced(self, boxes: Boxes, levels: Array) -> tuple[Boxes, ...]:
        """What becomes of some boxes, the lowest first: cut where that promises to be enough, or read and cut."""
        boxes = self._bounds.sharpened(boxes)
        goals = levels[boxes.pair]
        is_closed = boxes.low >= goals
        is_hopeful = boxes.gap - HOPE * (boxes.gap - boxes.low) >= goals
        is_large = boxes.reach.sum(axis=1) > RESOLUTION  # in smaller ones rounding is what the bound is too low by
        is_cut = ~is_closed & (boxes.is_read | (is_hopeful & is_large))
        queried = np.flatnonzero(~is_cut & ~is_closed)
        queried, waiting = queried[:READ_AT_ONCE], queried[READ_AT_ONCE:]
        read, readings = self._bounds.read(boxes.some(queried), goals[queried])
        for place, reading in enumerate(readings):
            self._note(read, place, reading)
        read = self._bounds.sharpened(read)
        is_open = read.low < levels[read.pair]
        is_fine = is_open & (read.reach.sum(axis=1) <= RESOLUTION)
        fine = read.some(is_fine)
        self._is_broken[fine.pair[fine.low < self._pairs.demands[fine.pair]]] = True
        self._given_up = min(self._given_up, float(fine.low[self._pairs.keeps[fine.pair]].min(initial=np.inf)))
        cut = Boxes.joined(boxes.some(is_cut), read.some(is_open & ~is_fine))
        return boxes.some(waiting), boxes.some(is_closed), read.some(~is_open), self._bounds.halves(cut)

    def _note(self, boxes: Boxes, place: int, reading: Reading) -> None:
        """Record what was read in the middle of a box."""
        pair = int(boxes.pair[place])
        breaks, keeps = is_below(reading, float(self._pairs.demands[pair])), bool(self._pairs.keeps[pair])
        distance = 0.0 if reading.touches else reading.bound
        if (breaks or (reading.is_exact and keeps)) and distance < self._nearest:
            row_first, row_second = boxes.middles[place].tolist()
            self._nearest, self._bodies, self._at = distance, pair, (row_first, row_second)
        self._is_broken[pair] |= breaks

    def _measure_first(self) -> None:
        """Measure where a pair that is to keep the clearance seems nearest, if no distance is known yet."""
        if np.isfinite(self._nearest) or not len(self._rectangles):
            return
        boxes = Boxes.joined(self._boxes, self._groups)
        measured = np.flatnonzero(self._pairs.keeps[boxes.pair])
        pair = boxes.pair[measured[[int(np.argmin(boxes.low[measured]))]]]
        some = self._rectangles[:: max(1, len(self._rectangles) // READ_AT_ONCE)]
        box = self._bounds.start(np.repeat(pair, len(some)), some)
        read, readings = self._bounds.read(box.some([int(np.argmin(box.low))]), np.full(1, np.inf))
        self._note(read, 0, readings[0])

    def _result(self, *, is_met: bool) -> RegionBound:
        pairs, scene, boxes = self._pairs, self._motion.scene, Boxes.joined(self._boxes, self._groups)
        low = min(float(boxes.low[pairs.keeps[boxes.pair]].min(initial=np.inf)), self._given_up, self._nearest)
        pair = self._bodies
        if pair is None and not is_met and len(boxes):
            pair = int(boxes.pair[int(np.argmin(boxes.low - pairs.demands[boxes.pair]))])
        return RegionBound(
            first=self._region.first,
            second=self._region.second,
            bodies=None if pair is None else scene.names(scene.pairs[int(pairs.rows[pair])]),
            distance=self._nearest,
            proved=max(0.0, low),
            at=self._at,
            is_met=is_met,
            demand=0.0 if pair is None else float(pairs.demands[pair]),
        )


def _refuse(motion: FreeMotion, region: ClockRegion) -> None:
    """Refuse a region that is none."""
    if region.first == region.second:
        raise ValueError(f"certify: expected two robots, got '{region.first}' twice")
    rectangles = np.asarray(region.rectangles, dtype=float).reshape(-1, 4)
    most = np.array([motion.last[region.first]] * 2 + [motion.last[region.second]] * 2)
    is_right = np.all((rectangles >= 0.0) & (rectangles <= most)) and np.all(rectangles[:, 0::2] <= rectangles[:, 1::2])
    if not is_right:
        raise ValueError(f"certify: rectangles of '{region.first}' and '{region.second}' are not within their rows")
