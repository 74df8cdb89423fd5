"""What a cell adds to a file of CAM."""

from dataclasses import dataclass

from cellplan.geometry.arrays import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CamSettings:
    """How the statements of a file become a path on the part."""

    source: str  # name of the file for messages
    X_PF: Array  # pose of the frame of the file in P, in [m], shape (4, 4)
    transfer: float  # speed of rapids in [m/s]
    rounding: float  # largest distance in [m] of a rounded corner from the sides
    stop_angle: float  # change of direction in [rad] from which on the tool stops at a corner
    chord: float = 0.0  # largest distance in [m] of an arc from the sides that stand for it
