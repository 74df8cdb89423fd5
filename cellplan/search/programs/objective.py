"""What a local optimisation improves, what it must keep, and how much work it may do."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from cellplan.geometry.arrays import Array


class Objective(StrEnum):
    """What is improved while all demands are kept."""

    CONFORMING = "conforming"  # nothing else: the first point at which all demands are kept
    CYCLE = "cycle"  # shortest cycle
    CLEARANCE = "clearance"  # largest smallest distance at a given duration
    CHANGE = "change"  # least change from the given values at a given duration


class CycleTiming(StrEnum):
    """How the motion is made as fast as the limits allow."""

    LAWS = "laws"  # the cell's time laws, slower or faster as a whole
    RETIMED = "retimed"  # the speed along the common path, as fast as possible everywhere


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Demands:
    """What is demanded of a point.

    Attributes:
        duration: Time of all motions in [s] that the limits of speed and acceleration must allow; None where any will
            do. The objectives clearance and change need one; with one the transfers alone make the cycle shorter.
    """

    objective: Objective  # what is improved
    margin: Array  # smallest distances of the joints from their limits in [rad] or [m], shape (nq,)
    duration: float | None = None
    timing: CycleTiming = CycleTiming.LAWS  # how the motion is timed
    clearance: float = 0.0  # added to what the cell demands of every pair but those of one robot's own bodies, in [m]
    singular: Array | None = None  # least singular values of the arms in [m] and [rad], shape (A,); None for any
    beyond: Array | None = None  # further distances in [m] for uncertainties, shape (pairs,); None for none

    def __post_init__(self) -> None:
        """Check at the door what the objective needs."""
        if self.objective in (Objective.CLEARANCE, Objective.CHANGE) and self.duration is None:
            raise ValueError(f"demands: the objective '{self.objective}' needs a duration")
        if not np.all(self.margin >= 0.0):
            raise ValueError(f"demands: expected margins of at least 0, got {self.margin}")

    @property
    def is_shorter_work(self) -> bool:
        """Whether the motions themselves are to become shorter."""
        return self.objective is Objective.CYCLE and self.duration is None


@dataclass(frozen=True, slots=True, kw_only=True)
class Reserve:
    """Reserves that the rows of a program add to the demands, so that the curvature along a step breaks none.

    Half of a reserve counts as met at a point.
    """

    margin: float = float(np.radians(0.15))  # in [rad] or [m]
    distance: float = 0.0025  # in [m]
    within_robot: float = 0.0001  # likewise of a robot's own bodies: little, as their distances are often its design
    time: float = 0.002  # share of the duration
    singular: float = 0.02  # share of the singular values that are demanded


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much work a local optimisation may do: counts only, so that equal inputs give equal answers.

    Attributes:
        give_up_above: Objective above which it is given up after ``GIVE_UP_AFTER`` programs; None for never.
    """

    iterations: int = 60  # linear programs at most
    keys: int = 9  # configurations at which distances are asked, evenly over the motion
    also_at: tuple[float, ...] = ()  # times in [s] along the nodes at which they are asked as well
    within: float = 0.06  # distance in [m] above what is demanded, within which pairs become rows
    trust: float = 0.5  # first radius of the trust region, in usual steps of the variables
    reserve: Reserve = field(default_factory=Reserve)  # what the rows ask for beyond the demands
    least_gain: float = 3e-3  # share of the objective that ``LOOKS_BACK`` programs must gain to go on
    give_up_above: float | None = None
