"""What a search for the smallest distance of a pair has found and proved, and how much work it may still do."""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.collision.distance import SURELY_APART
from cellplan.geometry.transforms import Array

Flags = NDArray[np.bool_]

SEARCH_ROOM: Final = 5e-5  # [m] a search stops when nothing can be nearer than the nearest found by more than this
MOST_CUTS: Final = 1000  # [-] steps of one pair that are cut to prove what is demanded, finer ones included
MOST_READINGS: Final = 5000  # [-] of one pair, whole or in pieces, for its smallest distance beyond what is demanded


@dataclass(slots=True, kw_only=True)
class Found:
    """What a search has found; instants are counted in samples, with fractions between them.

    Attributes:
        distance: Smallest distance measured in [m], never above the truth and within 0.05 mm of it; inf where none was.
        at: Its instant.
        touches: Instants at which the bodies touch.
        unproved: Instants at which steps begin of which what is needed could not be proved.
        demand: Distance in [m] that is to be proved before the smallest one is looked for.
        cuts: How many steps have been cut.
        most_cuts: How many may be for what is needed.
        is_needed: Whether the search is at what is needed, and not at the smallest distance.
        spare_cuts: How many of the cuts were made for the smallest distance.
        spare_readings: How many readings were.
    """

    distance: float = np.inf
    at: float = 0.0
    touches: list[float] = field(default_factory=list)
    unproved: list[float] = field(default_factory=list)
    demand: float = SURELY_APART
    cuts: int = 0
    most_cuts: int = MOST_CUTS
    is_needed: bool = True
    spare_cuts: int = 0
    spare_readings: int = 0

    @property
    def needed(self) -> float:
        """Distance in [m] that has to be proved: once less than the demand was measured, only that nothing touches."""
        return self.demand if self.distance >= self.demand else SURELY_APART

    def goal(self, cutoff: float) -> float:
        """Distance in [m] from which on a step does not matter: what is beyond a cutoff or the nearest found."""
        return max(SURELY_APART, min(cutoff, self.distance - SEARCH_ROOM))

    @property
    def is_spent(self) -> bool:
        """Whether nothing more may be done for the smallest distance."""
        return not self.is_needed and self.spare_readings >= MOST_READINGS

    @property
    def may_cut(self) -> bool:
        """Whether one more step may be cut."""
        if self.is_needed:
            return self.cuts - self.spare_cuts < self.most_cuts
        return self.spare_cuts < self.most_cuts and not self.is_spent

    def count_cut(self) -> None:
        """Write down that a step is cut."""
        self.cuts += 1
        self.spare_cuts += not self.is_needed


class StepBounds:
    """Lower bounds of the distance of a pair in each step.

    Attributes:
        low: No distance in the step is below this, in [m], shape (n - 1,); zero where the bodies touch.
        is_closed: Steps in which the bodies touch, shape (n - 1,).
        is_given_up: Steps of which no more can be proved, shape (n - 1,).
    """

    def __init__(self, low: Array) -> None:
        """Start from the first bounds."""
        self.low = low
        self.is_closed: Flags = np.zeros(len(low), dtype=bool)
        self.is_given_up: Flags = np.zeros(len(low), dtype=bool)

    def lowest(self) -> tuple[int, float]:
        """The step with the lowest bound that is still looked at, and that bound in [m]; inf when there is none."""
        low = np.where(self.is_closed | self.is_given_up, np.inf, self.low)
        step = int(np.argmin(low))
        return step, float(low[step])

    def close(self, steps: slice | Flags) -> None:
        """Have done with steps in which the bodies touch."""
        self.is_closed[steps] = True
        self.low[steps] = 0.0

    def lift(self, low: Array) -> None:
        """Raise the bounds by others, shape (n - 1,)."""
        self.low = np.where(self.is_closed, 0.0, np.maximum(self.low, low))
