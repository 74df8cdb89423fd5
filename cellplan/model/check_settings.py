"""Requirements of the checks, as a cell states them."""

import math
from dataclasses import dataclass

from cellplan.model.controllers import StopDemand


@dataclass(frozen=True, slots=True, kw_only=True)
class Exclusion:
    """A pair of bodies the user wants left out of the collision check, and why."""

    bodies: tuple[str, str]
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckSettings:
    """Requirements of the checks.

    Attributes:
        clearance: Smallest allowed distance in [m] between things that must not touch.
        adds_accuracy: Whether the accuracy of both bodies is added to the demanded clearance of a pair.
        contact_zone: Radius in [m] round the tool tip within which tool and part may touch.
        exclusions: Pairs left out at the user's word.
        closure_position: Largest distance in [m] of a further holder's tool from its grasp.
        closure_orientation: Largest angle in [rad] between the two.
        standing_depth: By how much in [m] bodies that never move may overlap where one stands on the other.
        part_acceleration: Largest allowed acceleration of the part in [m/s^2]; None: it is only reported.
        tool_speed: Largest allowed speed of any tool tip in the world in [m/s]; None: it is only reported.
        stop: What is demanded when one robot stops; None: it is only reported.
    """

    clearance: float
    contact_zone: float
    exclusions: tuple[Exclusion, ...] = ()
    closure_position: float = 3e-6
    closure_orientation: float = 1e-3 * math.pi / 180.0
    standing_depth: float = 0.005
    part_acceleration: float | None = None
    tool_speed: float | None = None
    adds_accuracy: bool = False
    stop: StopDemand | None = None
