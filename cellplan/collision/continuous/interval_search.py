"""Whether two bodies stay apart at every instant of a motion, and how near they come: proved, not sampled.

Each step of the motion has a lower bound of the distance that holds at all its instants. Bounding spheres give the
first. A search then measures the pair at one sample after the other, where the bound is lowest; each reading raises the
bounds of its neighbours (``travel``). A step that stays open with both ends measured is cut into finer steps.

What must be known comes first: that the bodies do not touch, then that they keep the distance that is demanded. Where
the steps become as fine as ``RESOLUTION``, or too many have been cut, and this is still not proved, the answer is "not
certified", never "free". Then the bounds are raised, the lowest first, until the smallest distance is known exactly;
this ends earlier when it takes too much work, and what is proved by then remains true.
"""

from abc import ABC, abstractmethod
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.continuous.found import Flags, Found, StepBounds
from cellplan.collision.continuous.motion_bound import Motion, Pair, PairMotion
from cellplan.collision.continuous.pieces import PieceMotion, can_be_split, read_piece, split
from cellplan.collision.distance import SURELY_APART, TIGHT, Reading, look, sharpen
from cellplan.collision.engine import Engine
from cellplan.collision.overlap.containment import is_inside
from cellplan.geometry.transforms import Array

RESOLUTION: Final = 1e-6  # [m] steps in which nothing travels farther than this are not cut any more
PARTS: Final = 8  # [-] finer steps that an open step is cut into
MOST_LOOSE: Final = 4  # [-] distances beyond those of the hulls that are measured before a body is taken apart
MOST_LOOSE_BOTH: Final = 16  # [-] likewise where both bodies are not convex: pieces of the one meet those of the other
ROUGH: Final = 2e-4  # [m] a search for the smallest distance goes half the way to it at a time, until so near


class Search(ABC):
    """The steps of one pair; what is common to two solids and to a solid above a half-space.

    Attributes:
        bounds: What is proved of each step.
        found: What has been found.
    """

    def __init__(self, low: Array, found: Found, *, begin: float, width: float) -> None:
        """Start from the first bounds.

        Args:
            low: Lower bounds by the cheapest means in [m], shape (n - 1,).
            found: Where to write what is found.
            begin: Instant of the first sample.
            width: Length of a step, in samples of the program.
        """
        self.bounds, self.found = StepBounds(low), found
        self._begin, self._width = begin, width
        self._is_read: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._touches: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._fine: dict[int, Search] = {}

    @property
    def low(self) -> Array:
        """No distance in the step is below this, in [m], shape (n - 1,); zero where the bodies touch."""
        return self.bounds.low

    def run(self, cutoff: float) -> None:
        """Search until no step can be below a cutoff in [m] and nearer than the nearest found, or touches."""
        found = self.found
        found.is_needed = True
        for level in (SURELY_APART, found.demand):
            self.raise_to(level, cutoff)
        found.is_needed = False
        while not found.is_spent and (lowest := self.bounds.lowest()[1]) < (goal := found.goal(cutoff)):
            self.raise_to(goal if goal - lowest <= ROUGH else 0.5 * (lowest + goal), cutoff)
        self._finish()

    def raise_to(self, level: float, cutoff: float) -> None:
        """Raise all bounds to a level in [m], as far as they are below a cutoff and what may be nearest."""
        while not self.found.is_spent:
            step, lowest = self.bounds.lowest()
            if lowest >= min(level, self.found.goal(cutoff)):
                break
            if self._takes_apart(level, cutoff):
                continue
            unread = [sample for sample in (step, step + 1) if not self._is_read[sample]]
            if unread:
                self._read(unread[len(unread) // 2], self.found.goal(cutoff))
            else:
                self._cut(step, level, cutoff)

    def _instant(self, place: float) -> float:
        """Instant of a place among the samples."""
        return self._begin + self._width * place

    def _note(self, sample: int, distance: float, *, touches: bool, is_exact: bool) -> None:
        """Write down what was read at a sample."""
        self._is_read[sample] = True
        if touches:
            self._touches[sample] = True
            self.found.touches.append(self._instant(sample))
            self.bounds.close(slice(max(0, sample - 1), sample + 1))
        elif is_exact and distance < self.found.distance:
            self.found.distance, self.found.at = distance, self._instant(sample)

    def _cut(self, step: int, level: float, cutoff: float) -> None:
        """Look at one step in finer steps; give it up where it cannot be cut any more."""
        fine, bounds = self._fine.get(step), self.bounds
        if fine is None:
            if self._travel(step) <= RESOLUTION or not self.found.may_cut:
                bounds.is_given_up[step] = True
                if bounds.low[step] < self.found.needed:
                    self.found.unproved.append(self._instant(step))
                return
            self.found.count_cut()
            fine = self._fine[step] = self._finer(step)
        before = len(self.found.touches)
        fine.raise_to(level, cutoff)
        fine._finish()
        if len(self.found.touches) != before:
            bounds.close(slice(step, step + 1))
            return
        bounds.low[step] = max(bounds.low[step], float(fine.low.min()))
        bounds.is_given_up[step] = bool(bounds.low[step] < min(level, self.found.goal(cutoff)))

    def _takes_apart(self, level: float, cutoff: float) -> bool:  # noqa: ARG002 - for those that have pieces
        """Search piece by piece where that is quicker; say whether it was done."""
        return False

    @abstractmethod
    def _travel(self, step: int) -> float:
        """How far the bodies come nearer in a step at most, in [m]."""

    @abstractmethod
    def _finer(self, step: int) -> "Search":
        """The same search in one step."""

    @abstractmethod
    def _read(self, sample: int, goal: float) -> None:
        """Measure at a sample, finely enough to tell whether the distance reaches a goal."""

    @abstractmethod
    def _finish(self) -> None:
        """Look after what no distance tells."""


class SolidSearch(Search):
    """The search for two solids."""

    _finds_enclosures = True
    _patience = MOST_LOOSE

    def __init__(
        self,
        engine: Engine,
        pair: Pair,
        motion: Motion,
        *,
        found: Found | None = None,
        begin: float = 0.0,
        width: float = 1.0,
    ) -> None:
        """Start from the bounding spheres.

        Args:
            engine: The bodies.
            pair: Which two.
            motion: How they move.
            found: Where to write what is found; new when None.
            begin: Instant of the first sample.
            width: Length of a step, in samples of the program.
        """
        super().__init__(motion.sphere_bounds(pair), found or Found(), begin=begin, width=width)
        self._engine, self._pair, self._motion = engine, pair, motion
        self._are_spheres_apart = self.low > SURELY_APART
        self._relative: PairMotion | None = None
        self._readings: dict[int, Reading] = {}
        self._loose = 0
        self._split_bodies = sum(can_be_split(engine.bodies[index]) for index in pair)
        self._most_loose = MOST_LOOSE_BOTH if self._split_bodies == len(pair) else self._patience
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
            self.found.spare_readings += not self.found.is_needed
            self.take(sample, reading, goal)
        return reading

    def _measured(self, sample: int, goal: float) -> Reading:
        """What the engine says of a sample."""
        poses = self._motion.poses
        reading = look(self._engine, self._pair, poses, sample=sample)
        if reading.is_exact or reading.bound >= goal:
            return reading
        sharp = sharpen(self._engine, self._pair, poses, sample=sample, reading=reading)
        self._loose += sharp.bound > reading.bound + TIGHT
        return sharp

    def take(self, sample: int, reading: Reading, goal: float) -> None:
        """Make use of a reading."""
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
        bounds.is_given_up |= bounds.low < min(level, self.found.goal(cutoff))
        return True

    def _split(self) -> list["PieceSearch"]:
        """A search for each piece of a body that is not convex, the nearest first."""
        engine, is_first_split = split(self._engine, self._pair)
        motion = PieceMotion.of(self._motion, self._pair, engine, is_first_split=is_first_split)
        found, begin, width = self.found, self._begin, self._width
        pairs = [motion.piece_pair(piece) for piece in range(len(engine.bodies) - 1)]
        pieces = [PieceSearch(engine, pair, motion, found=found, begin=begin, width=width) for pair in pairs]
        pieces.sort(key=lambda piece: float(piece.low.min()))
        for piece in pieces:
            piece.bounds.is_closed |= self.bounds.is_closed
            piece.bounds.lift(self.low)
        return pieces

    def _finer(self, step: int) -> "Search":
        fine = type(self)(
            self._engine,
            self._pair,
            self._motion.finer(self._pair, step, parts=PARTS),
            found=self.found,
            begin=self._instant(step),
            width=self._width / PARTS,
        )
        for end, sample in ((0, step), (PARTS, step + 1)):
            fine.take(end, self._readings[sample], np.inf)
        return fine

    def _finish(self) -> None:
        """Read the samples between steps given up, and find where one body lies wholly inside the other."""
        is_left = np.append(True, self.bounds.is_closed) & np.append(self.bounds.is_closed, True) & ~self._is_read
        for sample in np.flatnonzero(is_left):
            self.read(int(sample), SURELY_APART)
        if self._finds_enclosures and self._width == 1.0:
            for stretch in _free_stretches(self._touches, self.bounds.is_closed):
                if self._is_enclosed(stretch):
                    self.found.touches += [self._instant(int(sample)) for sample in stretch]
                    self.bounds.close(slice(max(0, stretch[0] - 1), stretch[-1] + 1))

    def _is_enclosed(self, stretch: NDArray[np.intp]) -> bool:
        """Whether one body lies inside the other throughout a stretch: one proof that it does not is enough."""
        first, last = int(stretch[0]), int(stretch[-1])
        if self._are_spheres_apart[max(0, first - 1) : last + 1].any():
            return False
        known = [sample for sample in self._readings if first <= sample <= last]
        if any(self._readings[sample].direction is not None for sample in known):
            return False
        return is_inside(self._engine, self._pair, self._motion.poses, sample=known[0] if known else first)


class PieceSearch(SolidSearch):
    """The search for a piece of a body that is not convex, and another body."""

    _finds_enclosures = False
    _patience = 1

    def _measured(self, sample: int, goal: float) -> Reading:
        reading, is_proved = read_piece(self._engine, self._pair, self._motion.poses, sample=sample, goal=goal)
        self._loose += not is_proved
        return reading


def _free_stretches(touches: Flags, is_closed: Flags) -> list[NDArray[np.intp]]:
    """Runs of samples, shape (n,), that do not touch, with no step, shape (n - 1,), between them that was given up."""
    free = np.flatnonzero(~touches)
    ends = np.flatnonzero((np.diff(free) > 1) | is_closed[free[:-1]]) + 1
    return [stretch for stretch in np.split(free, ends) if stretch.size]
