"""State of the search for the smallest distance of one pair: what is found and proved, and the work still allowed."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.scene.collision.distance import APART_TOL

SEARCH_TOL: Final = 5e-5  # [m] a search stops when nothing can be nearer than the nearest found by more than this
MAX_CUTS: Final = 1000  # steps of one pair that are cut to prove the demand, finer ones included
MAX_READINGS: Final = 5000  # of one pair, whole or in pieces, for its smallest distance beyond the demand


@dataclass(slots=True, kw_only=True)
class PairState:
    """State of one search; times are counted in samples, with fractions between them."""

    distance: float = np.inf  # smallest measured in [m], never above the truth and within 0.05 mm of it; inf for none
    at: float = 0.0  # its time
    touches: list[float] = field(default_factory=list)  # times at which the bodies touch
    unproved: list[float] = field(default_factory=list)  # times of steps with too little proof
    demand: float = APART_TOL  # distance in [m] that is to be proved before the smallest one is searched for
    cuts: int = 0  # number of steps that have been cut
    max_cuts: int = MAX_CUTS  # number that may be cut for the necessary distance
    is_verdict_only: bool = False  # whether only the demand counts: the first reading below it is enough
    is_verdict_open: bool = True  # whether the demand is searched, not yet the smallest distance
    spare_cuts: int = 0  # number of the cuts that were made for the smallest distance
    spare_readings: int = 0  # number of readings likewise

    @property
    def needed(self) -> float:
        """Distance in [m] that has to be proved: once less than the demand was measured, only that nothing touches."""
        return self.demand if self.distance >= self.demand else APART_TOL

    def goal(self, cutoff: float) -> float:
        """Distance in [m] beyond which a step does not matter: a cutoff, or the nearest distance found."""
        return max(APART_TOL, min(cutoff, self.distance - SEARCH_TOL))

    @property
    def is_spent(self) -> bool:
        """Whether no more work is allowed, or needed for the verdict."""
        if self.is_verdict_only and (self.touches or self.distance < self.demand):
            return True
        return not self.is_verdict_open and self.spare_readings >= MAX_READINGS

    @property
    def may_cut(self) -> bool:
        """Whether one more step may be cut."""
        if self.is_verdict_open:
            return self.cuts - self.spare_cuts < self.max_cuts
        return self.spare_cuts < self.max_cuts and not self.is_spent

    def count_cut(self) -> None:
        """Count one more cut."""
        self.cuts += 1
        self.spare_cuts += not self.is_verdict_open

    def note_distance(self, distance: float, at: float) -> None:
        """Record a measured distance in [m] and its time."""
        if distance < self.distance:
            self.distance, self.at = distance, at

    def note_touches(self, times: Iterable[float]) -> None:
        """Record times at which the bodies touch."""
        self.touches.extend(times)


class StepBounds:
    """Lower bounds of the distance of a pair in each step."""

    def __init__(self, low: Array) -> None:
        """Start from the first bounds."""
        self.low = low  # no distance in the step is below this, in [m], shape (n - 1,); zero where the bodies touch
        self.is_closed: Flags = np.zeros(len(low), dtype=bool)  # steps in which the bodies touch, shape (n - 1,)
        self.is_given_up: Flags = np.zeros(len(low), dtype=bool)  # steps of which no more can be proved, shape (n - 1,)

    def lowest(self) -> tuple[int, float]:
        """The open step with the lowest bound, and that bound in [m]; inf when no step is open."""
        low = np.where(self.is_closed | self.is_given_up, np.inf, self.low)
        step = int(np.argmin(low))
        return step, float(low[step])

    def close(self, steps: slice | Flags) -> None:
        """Close steps in which the bodies touch."""
        self.is_closed[steps] = True
        self.low[steps] = 0.0

    def lift(self, low: Array) -> None:
        """Raise the bounds by others, shape (n - 1,)."""
        self.low = np.where(self.is_closed, 0.0, np.maximum(self.low, low))
