"""Whether two bodies stay apart at every instant of a motion, and how near they come: proved, not sampled.

Each step of the motion has a lower bound of the distance that holds at all its instants. Bounding spheres give the
first. A search then measures the pair at one sample after the other, where the bound is lowest; each reading raises the
bounds of its neighbours (``travel``). A step that stays open with both ends measured is cut into finer steps. Where the
steps become as fine as ``RESOLUTION`` and still nothing is proved, the answer is "not certified", never "free".
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.engine import Engine
from cellplan.collision.inside import is_inside
from cellplan.collision.measure import SURELY_APART, TIGHT, Reading, look, sharpen
from cellplan.collision.pieces import PieceMotion, can_be_split, read_piece, split
from cellplan.collision.travel import Motion, Pair, PairMotion
from cellplan.geometry.transforms import Array

Flags = NDArray[np.bool_]

SEARCH_ROOM: Final = 5e-5  # [m] a search stops when nothing can be nearer than the nearest found by more than this
RESOLUTION: Final = 1e-6  # [m] steps in which nothing travels farther than this are not cut any more
PARTS: Final = 8  # [-] finer steps that an open step is cut into
MOST_LOOSE: Final = 16  # [-] distances beyond those of the hulls that are measured before a body is taken apart
MOST_CUTS: Final = 1000  # [-] steps of one pair that are cut, finer ones included; beyond that nothing is certified


@dataclass(slots=True, kw_only=True)
class Found:
    """What a search has found; instants are counted in samples, with fractions between them.

    Attributes:
        distance: Smallest distance measured in [m], never above the truth and within 0.05 mm of it; inf where none was.
        at: Its instant.
        touches: Instants at which the bodies touch.
        unproved: Instants at which steps begin that could not be certified.
        cuts: How many steps have been cut.
        most_cuts: How many may be.
    """

    distance: float = np.inf
    at: float = 0.0
    touches: list[float] = field(default_factory=list)
    unproved: list[float] = field(default_factory=list)
    cuts: int = 0
    most_cuts: int = MOST_CUTS


class Search(ABC):
    """The steps of one pair; what is common to two solids and to a solid above a half-space.

    Attributes:
        low: No distance in the step is below this, in [m], shape (n - 1,); zero where the bodies touch and where
            nothing is proved.
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
        self.low, self.found = low, found
        self._begin, self._width = begin, width
        self._is_read: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._touches: Flags = np.zeros(len(low) + 1, dtype=bool)
        self._is_closed: Flags = np.zeros(len(low), dtype=bool)

    def run(self, cutoff: float) -> None:
        """Search until no step can be below a cutoff in [m] and nearer than the nearest found, or touches."""
        while True:
            goal = max(SURELY_APART, min(cutoff, self.found.distance - SEARCH_ROOM))
            step = int(np.argmin(np.where(self._is_closed, np.inf, self.low)))
            if self._is_closed[step] or self.low[step] >= goal:
                break
            unread = [sample for sample in (step, step + 1) if not self._is_read[sample]]
            if self._takes_apart(cutoff):
                continue
            if unread:
                self._read(unread[len(unread) // 2], goal)
            else:
                self._cut(step, cutoff)
        self._finish()

    def _instant(self, place: float) -> float:
        """Instant of a place among the samples."""
        return self._begin + self._width * place

    def _note(self, sample: int, distance: float, *, touches: bool, is_exact: bool) -> None:
        """Write down what was read at a sample."""
        self._is_read[sample] = True
        if touches:
            self._touches[sample] = True
            self.found.touches.append(self._instant(sample))
            self._close(slice(max(0, sample - 1), sample + 1))
        elif is_exact and distance < self.found.distance:
            self.found.distance, self.found.at = distance, self._instant(sample)

    def _close(self, steps: slice | Flags) -> None:
        """Give up steps: nothing but zero can be said of them."""
        self._is_closed[steps] = True
        self.low[steps] = 0.0

    def _cut(self, step: int, cutoff: float) -> None:
        """Look at one step in finer steps."""
        before = len(self.found.touches), len(self.found.unproved)
        if self._travel(step) <= RESOLUTION or self.found.cuts >= self.found.most_cuts:
            self.found.unproved.append(self._instant(step))
            self._close(slice(step, step + 1))
            return
        self.found.cuts += 1
        fine = self._finer(step)
        fine.run(cutoff)
        if (len(self.found.touches), len(self.found.unproved)) != before:
            self._close(slice(step, step + 1))
        else:
            self.low[step] = max(self.low[step], float(fine.low.min()))

    def _takes_apart(self, cutoff: float) -> bool:  # noqa: ARG002 - for those that have pieces
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
        self._was_split = not any(can_be_split(engine.bodies[index]) for index in pair)

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
        open_ = np.flatnonzero((self.low < goal) & ~self._is_closed)
        if open_.size:
            first, last = min(int(open_[0]), sample), max(int(open_[-1]) + 1, sample)
            self.relative.carry(reading, sample, first=first, last=last, low=self.low)
        for step in (sample - 1, sample):
            ends = self._readings.get(step), self._readings.get(step + 1)
            if ends[0] is not None and ends[1] is not None:
                proved = 0.5 * (ends[0].bound + ends[1].bound - self.relative.step_travel(step))
                self.low[step] = max(self.low[step], proved)
        self.low[self._is_closed] = 0.0

    def _read(self, sample: int, goal: float) -> None:
        self.read(sample, goal)

    def _travel(self, step: int) -> float:
        return self.relative.step_travel(step)

    def _takes_apart(self, cutoff: float) -> bool:
        if self._loose < MOST_LOOSE or self._was_split:
            return False
        self._was_split = True
        engine, is_first_split = split(self._engine, self._pair)
        motion = PieceMotion.of(self._motion, self._pair, engine, is_first_split=is_first_split)
        lowest = np.full(len(self.low), np.inf)
        for piece in range(len(engine.bodies) - 1):
            search = PieceSearch(
                engine, motion.piece_pair(piece), motion, found=self.found, begin=self._begin, width=self._width
            )
            search.go_on_from(self)
            search.run(cutoff)
            lowest = np.minimum(lowest, search.low)
            self._touches |= search._touches
            self._close(self._is_closed | search._is_closed)
        self.low = np.where(self._is_closed, 0.0, np.maximum(self.low, lowest))
        self._engine.distance_queries += engine.distance_queries
        self._engine.contact_queries += engine.contact_queries
        return True

    def go_on_from(self, whole: "SolidSearch") -> None:
        """Take over what is known of the bodies of which these are pieces."""
        self._is_closed |= whole._is_closed
        self.low = np.where(self._is_closed, 0.0, np.maximum(self.low, whole.low))

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
        is_left = np.append(True, self._is_closed) & np.append(self._is_closed, True) & ~self._is_read
        for sample in np.flatnonzero(is_left):
            self.read(int(sample), SURELY_APART)
        if self._finds_enclosures and self._width == 1.0:
            for stretch in _free_stretches(self._touches, self._is_closed):
                if self._is_enclosed(stretch):
                    self.found.touches += [self._instant(int(sample)) for sample in stretch]
                    self._close(slice(max(0, stretch[0] - 1), stretch[-1] + 1))

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

    def _measured(self, sample: int, goal: float) -> Reading:  # noqa: ARG002 - always exact
        reading, is_proved = read_piece(self._engine, self._pair, self._motion.poses, sample=sample)
        self._loose += not is_proved
        return reading


def _free_stretches(touches: Flags, is_closed: Flags) -> list[NDArray[np.intp]]:
    """Runs of samples, shape (n,), that do not touch, with no step, shape (n - 1,), between them that was given up."""
    free = np.flatnonzero(~touches)
    ends = np.flatnonzero((np.diff(free) > 1) | is_closed[free[:-1]]) + 1
    return [stretch for stretch in np.split(free, ends) if stretch.size]
