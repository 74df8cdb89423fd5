"""Search of one pair: whether two bodies stay apart throughout a motion, and how near they come, proved, not sampled.

Each step of the motion has a lower bound of the distance that holds throughout the step. Bounding spheres give the
first. A search then measures the pair at one sample after the other, where the bound is lowest; each reading raises the
bounds of its neighbours (``collision.continuous.motion_bound``). A step that stays open with both ends measured is cut
into finer steps.

The verdict comes first: that the bodies do not touch, then that they keep the distance that is demanded. Where the
steps become as fine as ``RESOLUTION``, or too many have been cut, and this is still not proved, the answer is "not
certified", never "free". Then the bounds are raised, the lowest first, until the smallest distance is known exactly;
this ends earlier when it takes too much work, and what is proved by then remains true.
"""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np

from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_state import PairState, StepBounds
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.scene.collision.continuous.motion_bound import BodyMotion, Pair, PairMotion
from cellplan.scene.collision.continuous.pieces import PieceMotion, can_be_split, read_piece, split
from cellplan.scene.collision.distance import APART_TOL, TIGHT_TOL, Reading, exact_reading, quick_reading
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.pairs import ScenePair

RESOLUTION: Final = 1e-6  # [m] steps in which nothing travels farther than this are not cut any more
PART_COUNT: Final = 8  # finer steps that an open step is cut into
MAX_LOOSE: Final = 4  # distances beyond those of the hulls that are measured before a body is taken apart
MAX_LOOSE_BOTH: Final = 16  # likewise where neither body is convex: pieces of the one meet those of the other
BISECTION_TOL: Final = 2e-4  # [m] a search for the smallest distance bisects its gap until it is this small


class Search(ABC):
    """The steps of one pair; what is common to two solids and to a solid above a half-space.

    Attributes:
        bounds: What is proved of each step.
        state: What has been found; the finer searches of its steps write to the same one.
    """

    def __init__(self, low: Array, state: PairState, *, begin: float, width: float) -> None:
        """Start from the first bounds, lower ones by the cheapest means in [m], shape (n - 1,).

        ``begin`` is the time of the first sample, ``width`` the length of a step, in samples of the program; so below.
        """
        self.bounds, self.state = StepBounds(low), state
        self._begin, self._width = begin, width
        self._is_read: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._touches: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._fine: dict[int, Search] = {}

    @property
    def low(self) -> Array:
        """No distance in the step is below this, in [m], shape (n - 1,); zero where the bodies touch."""
        return self.bounds.low

    def run(self, cutoff: float, *, with_minimum: bool = True) -> None:
        """Search until no step can be below a cutoff in [m] and nearer than the nearest found, or touches.

        That nothing touches is proved first, then that the demand is kept; without the minimum the search ends there.
        """
        state = self.state
        state.is_verdict_open = True
        for level in (APART_TOL, state.demand):
            self.raise_to(level, cutoff)
        state.is_verdict_open = False
        while (
            with_minimum and not state.is_spent and (lowest := self.bounds.lowest()[1]) < (goal := state.goal(cutoff))
        ):
            self.raise_to(goal if goal - lowest <= BISECTION_TOL else 0.5 * (lowest + goal), cutoff)
        self._finish()

    def raise_to(self, level: float, cutoff: float) -> None:
        """Raise all bounds to a level in [m], as far as they are below a cutoff and what may be nearest."""
        while not self.state.is_spent:
            step, lowest = self.bounds.lowest()
            if lowest >= min(level, self.state.goal(cutoff)):
                break
            if self._takes_apart(level, cutoff):
                continue
            unread = [sample for sample in (step, step + 1) if not self._is_read[sample]]
            if unread:
                self._read(unread[len(unread) // 2], self.state.goal(cutoff))
            else:
                self._cut(step, level, cutoff)

    def _time(self, place: float) -> float:
        """Time of a place among the samples, in samples of the program."""
        return self._begin + self._width * place

    def _note(self, sample: int, distance: float, *, touches: bool, is_exact: bool) -> None:
        """Record what was read at a sample."""
        self._is_read[sample] = True
        if touches:
            self._touches[sample] = True
            self.state.note_touches([self._time(sample)])
            self.bounds.close(slice(max(0, sample - 1), sample + 1))
        elif is_exact:
            self.state.note_distance(distance, self._time(sample))

    def _cut(self, step: int, level: float, cutoff: float) -> None:
        """Search one step in finer steps; mark it as unresolved where it cannot be cut any more."""
        fine, bounds = self._fine.get(step), self.bounds
        if fine is None:
            if self._travel(step) <= RESOLUTION or not self.state.may_cut:
                bounds.is_given_up[step] = True
                if bounds.low[step] < self.state.needed:
                    self.state.unproved.append(self._time(step))
                return
            self.state.count_cut()
            fine = self._fine[step] = self._finer(step)
        before = len(self.state.touches)
        fine.raise_to(level, cutoff)
        fine._finish()
        if len(self.state.touches) != before:
            bounds.close(slice(step, step + 1))
            return
        bounds.low[step] = max(bounds.low[step], float(fine.low.min()))
        bounds.is_given_up[step] = bool(bounds.low[step] < min(level, self.state.goal(cutoff)))

    def _takes_apart(self, level: float, cutoff: float) -> bool:  # noqa: ARG002 - for those that have pieces
        """Search piece by piece where that is quicker; returns whether it was done."""
        return False

    @abstractmethod
    def _travel(self, step: int) -> float:
        """How far the bodies come nearer in a step at most, in [m]."""

    @abstractmethod
    def _finer(self, step: int) -> "Search":
        """The same search in one step."""

    @abstractmethod
    def _read(self, sample: int, goal: float) -> None:
        """Measure at a sample, finely enough to decide whether the distance reaches a goal."""

    @abstractmethod
    def _finish(self) -> None:
        """Find contacts that distances do not show."""


class SolidSearch(Search):
    """The search for two solids."""

    _finds_enclosures = True
    _patience = MAX_LOOSE

    def __init__(
        self,
        engine: Engine,
        pair: Pair,
        motion: BodyMotion,
        *,
        state: PairState | None = None,
        begin: float = 0.0,
        width: float = 1.0,
    ) -> None:
        """Start from the bounding spheres, with a new state when there is None."""
        super().__init__(motion.sphere_bounds(pair), state or PairState(), begin=begin, width=width)
        self._engine, self._pair, self._motion = engine, pair, motion
        self._are_spheres_apart = self.low > APART_TOL
        self._relative: PairMotion | None = None
        self._readings: dict[int, Reading] = {}
        self._loose = 0
        self._split_bodies = sum(can_be_split(engine.bodies[index]) for index in pair)
        self._most_loose = MAX_LOOSE_BOTH if self._split_bodies == len(pair) else self._patience
        self._pieces: list[PieceSearch] = []

    @property
    def relative(self) -> PairMotion:
        """The two bodies seen from each other, worked out when it is first needed."""
        if self._relative is None:
            self._relative = PairMotion(self._engine, self._pair, self._motion)
        return self._relative

    def read(self, sample: int, goal: float) -> Reading:
        """Measure at a sample, finely when the distance seems less than a goal, and raise bounds below the goal."""
        reading = self._readings.get(sample)
        if reading is None:
            reading = self._measured(sample, goal)
            self.state.spare_readings += not self.state.is_verdict_open
            self.take(sample, reading, goal)
        return reading

    def _measured(self, sample: int, goal: float) -> Reading:
        poses = self._motion.poses
        reading = quick_reading(self._engine, self._pair, poses, sample=sample)
        if reading.is_exact or reading.bound >= goal:
            return reading
        sharp = exact_reading(self._engine, self._pair, poses, sample=sample, reading=reading)
        self._loose += sharp.bound > reading.bound + TIGHT_TOL
        return sharp

    def take(self, sample: int, reading: Reading, goal: float) -> None:
        """Use a reading."""
        self._readings[sample] = reading
        self._note(sample, reading.bound, touches=reading.touches, is_exact=reading.is_exact)
        if reading.touches:
            return
        open_ = np.flatnonzero((self.low < goal) & ~self.bounds.is_closed)
        if open_.size:
            first, last = min(int(open_[0]), sample), max(int(open_[-1]) + 1, sample)
            self.relative.carry(reading, sample, first=first, last=last, low=self.low)
        for step in (sample - 1, sample):
            ends = self._readings.get(step), self._readings.get(step + 1)
            if ends[0] is not None and ends[1] is not None:
                proved = 0.5 * (ends[0].bound + ends[1].bound - self.relative.step_travel(step))
                self.low[step] = max(self.low[step], proved)
        self.low[self.bounds.is_closed] = 0.0

    def _read(self, sample: int, goal: float) -> None:
        self.read(sample, goal)

    def _travel(self, step: int) -> float:
        return self.relative.step_travel(step)

    def _takes_apart(self, level: float, cutoff: float) -> bool:
        if not self._pieces:
            if self._loose < self._most_loose or not self._split_bodies:
                return False
            self._pieces = self._split()
        bounds, lowest = self.bounds, np.full(len(self.low), np.inf)
        for piece in self._pieces:
            piece.raise_to(level, cutoff)
            piece._finish()
            lowest = np.minimum(lowest, piece.low)
            self._touches |= piece._touches
            bounds.close(bounds.is_closed | piece.bounds.is_closed)
        bounds.lift(lowest)
        bounds.is_given_up |= bounds.low < min(level, self.state.goal(cutoff))
        return True

    def _split(self) -> list["PieceSearch"]:
        """A search for each piece of a body that is not convex, the nearest first."""
        engine, is_first_split = split(self._engine, self._pair)
        motion = PieceMotion.of(self._motion, self._pair, engine, is_first_split=is_first_split)
        state, begin, width = self.state, self._begin, self._width
        pairs = [motion.piece_pair(piece) for piece in range(len(engine.bodies) - 1)]
        pieces = [PieceSearch(engine, pair, motion, state=state, begin=begin, width=width) for pair in pairs]
        pieces.sort(key=lambda piece: float(piece.low.min()))
        for piece in pieces:
            piece.bounds.is_closed |= self.bounds.is_closed
            piece.bounds.lift(self.low)
        return pieces

    def _finer(self, step: int) -> "Search":
        fine = type(self)(
            self._engine,
            self._pair,
            self._motion.finer(self._pair, step, parts=PART_COUNT),
            state=self.state,
            begin=self._time(step),
            width=self._width / PART_COUNT,
        )
        for end, sample in ((0, step), (PART_COUNT, step + 1)):
            fine.take(end, self._readings[sample], np.inf)
        return fine

    def _finish(self) -> None:
        """Read the samples between steps given up, and find where one body lies wholly inside the other."""
        is_left = np.append(True, self.bounds.is_closed) & np.append(self.bounds.is_closed, True) & ~self._is_read
        for sample in np.flatnonzero(is_left):
            self.read(int(sample), APART_TOL)
        if self._finds_enclosures and self._width == 1.0:
            for stretch in _free_stretches(self._touches, self.bounds.is_closed):
                if self._is_enclosed(stretch):
                    self.state.note_touches(self._time(int(sample)) for sample in stretch)
                    self.bounds.close(slice(max(0, stretch[0] - 1), stretch[-1] + 1))

    def _is_enclosed(self, stretch: Indices) -> bool:
        """Whether one body lies inside the other throughout a stretch: one proof that it does not is enough."""
        first, last = int(stretch[0]), int(stretch[-1])
        if self._are_spheres_apart[max(0, first - 1) : last + 1].any():
            return False
        known = [sample for sample in self._readings if first <= sample <= last]
        if any(self._readings[sample].direction is not None for sample in known):
            return False
        return is_inside(self._engine, self._pair, self._motion.poses, sample=known[0] if known else first)


class GroundSearch(Search):
    """The search for a solid and a half-space: by arithmetic, without the engine.

    The height is the smallest over the points of the solid, each of which stays within M/8 of its chords; so the height
    in a step is no less than the smaller one of its ends less M/8.
    """

    def __init__(
        self, pair: ScenePair, motion: StraightMotion, *, state: PairState, begin: float = 0.0, width: float = 1.0
    ) -> None:
        """Work out the heights of the solid above the half-space at all samples."""
        self._pair, self._motion = pair, motion
        heights = motion.scene.ground_heights(pair, motion.poses)
        self._strays: Array = motion.bend[pair.first] / 8.0
        super().__init__(np.minimum(heights[1:], heights[:-1]) - self._strays, state, begin=begin, width=width)
        self._is_read[:] = True
        self._touches[:] = heights <= 0.0
        for sample in np.flatnonzero(self._touches):
            self._note(int(sample), 0.0, touches=True, is_exact=True)
        lowest = int(np.argmin(np.where(self._touches, np.inf, heights)))
        if not self._touches[lowest]:
            self._note(lowest, float(heights[lowest]), touches=False, is_exact=True)

    def _travel(self, step: int) -> float:
        return float(self._strays[step])

    def _finer(self, step: int) -> Search:
        solid = self._pair.first
        fine = self._motion.finer((solid, solid), step, parts=PART_COUNT)
        width = self._width / PART_COUNT
        return GroundSearch(self._pair, fine, state=self.state, begin=self._time(step), width=width)

    def _read(self, sample: int, goal: float) -> None:
        """All samples are read from the start."""

    def _finish(self) -> None:
        """A height shows every contact."""


class PieceSearch(SolidSearch):
    """The search for a piece of a body that is not convex, and another body."""

    _finds_enclosures = False
    _patience = 1

    def _measured(self, sample: int, goal: float) -> Reading:
        reading, is_proved = read_piece(self._engine, self._pair, self._motion.poses, sample=sample, goal=goal)
        self._loose += not is_proved
        return reading


def _free_stretches(touches: Flags, is_closed: Flags) -> list[Indices]:
    """Runs of samples, shape (n,), that do not touch, with no step, shape (n - 1,), between them that was given up."""
    free = np.flatnonzero(~touches)
    ends = np.flatnonzero((np.diff(free) > 1) | is_closed[free[:-1]]) + 1
    return [stretch for stretch in np.split(free, ends) if stretch.size]
