"""The smallest distance over many pairs and samples, by branch and bound on proved lower bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.collision.bodies import BodyPoses
from cellplan.collision.engine import Engine
from cellplan.collision.measure import look, measure, sharpen
from cellplan.collision.relative import RelativeMotion
from cellplan.collision.sweep import Pair
from cellplan.geometry.transforms import Array

SEARCH_ROOM: Final = 5e-5  # [m] the search stops when nothing can be nearer than the nearest found by more than this


@dataclass(frozen=True, slots=True)
class Nearest:
    """The nearest two bodies.

    Attributes:
        proved: Nothing is nearer than this, in [m].
        measured: Distance of the pair at the sample in [m], not above the truth; inf when there is no pair.
        row: Which of the pairs; -1 when there is none.
        sample: At which sample.
    """

    proved: float
    measured: float
    row: int
    sample: int


NOTHING: Final = Nearest(np.inf, np.inf, -1, -1)


def find_nearest(
    engine: Engine, pairs: Sequence[Pair], poses: BodyPoses, *, lower: Array, best: float = np.inf
) -> Nearest:
    """Find the smallest distance, exact to 0.1 mm, of pairs that touch nowhere.

    Args:
        engine: The bodies.
        pairs: Which of them.
        poses: Where they are.
        lower: Proved lower bounds in [m], shape (P, n); raised in place.
        best: Distance known from elsewhere; anything farther is of no interest and comes back unmeasured.
    """
    found = Nearest(np.inf, best, -1, -1)
    nearest_first = np.argsort(lower.min(axis=1, initial=np.inf), kind="stable")
    for row in nearest_first:  # one look at each: a small distance found early saves much later
        sample = int(np.argmin(lower[row]))
        if lower[row, sample] >= found.measured - SEARCH_ROOM:
            break
        reading = measure(engine, pairs[row], poses, sample=sample)
        lower[row, sample] = max(lower[row, sample], reading.bound)
        if lower[row, sample] < found.measured:
            found = Nearest(np.inf, float(lower[row, sample]), int(row), sample)
    for row in nearest_first:
        found = _search_pair(engine, pairs[row], poses, lower=lower[row], found=found, row=int(row))
    return Nearest(float(lower.min(initial=np.inf)), found.measured, found.row, found.sample)


def _search_pair(engine: Engine, pair: Pair, poses: BodyPoses, *, lower: Array, found: Nearest, row: int) -> Nearest:
    """Measure one pair where it may be nearer than what is found, until it cannot be any more."""
    motion = None
    while True:
        sample = int(np.argmin(lower))
        threshold = found.measured - SEARCH_ROOM
        if lower[sample] >= threshold:
            return found
        motion = motion or RelativeMotion(engine, pair, poses)
        reading = look(engine, pair, poses, sample=sample)
        if reading.bound < threshold:
            reading = sharpen(engine, pair, poses, sample=sample, reading=reading)
        others = np.flatnonzero(lower < threshold)
        lower[sample] = max(lower[sample], reading.bound)
        motion.carry(reading, sample, others=others, lower=lower)
        if reading.is_exact and lower[sample] < found.measured:
            found = Nearest(np.inf, float(lower[sample]), row, sample)
