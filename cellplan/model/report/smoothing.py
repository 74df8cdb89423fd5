"""How far a tool on a smoothed path is from the path that its file lists."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedErrors:
    """Largest errors in the rows of one task against the points and axes of its file, tracking errors included."""

    position: float  # distance in [m]
    position_at_s: float  # its time
    orientation: float  # angle in [rad], beyond the cone within which the tool may lean
    orientation_at_s: float  # its time
    into: float  # distance in [m] along the axis of the file, into the part; negative where it is always outside
    into_at_s: float  # its time
