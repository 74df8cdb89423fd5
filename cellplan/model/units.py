"""Units of what is printed; within the program all quantities are in SI units."""

import math
from typing import Final, NamedTuple

MM: Final = 1e3  # [mm/m]
DEG: Final = math.degrees(1.0)  # [deg/rad]
ROUNDING_TOL: Final = 1e-5  # [-] of a tenth, which processors differ by: 36.99999999999 is printed as 37.0


class DisplayUnit(NamedTuple):
    """Unit in which a quantity is printed."""

    name: str  # the unit as printed
    scale: float  # printed value per value in SI units


DEGREES: Final = DisplayUnit("deg", DEG)
MILLIMETRES: Final = DisplayUnit("mm", MM)


def joint_unit(*, is_revolute: bool) -> DisplayUnit:
    """Unit of joint positions: degrees of a revolute joint, millimetres of a prismatic one."""
    return DEGREES if is_revolute else MILLIMETRES


def rounded_down(value: float) -> float:
    """The value with one decimal, rounded down, so that no clearance or margin is overstated."""
    return math.floor(10.0 * value + ROUNDING_TOL) / 10.0
