"""Rounding for controllers: the decimals a format has, and never beyond a joint limit."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.robot import Joint
from cellplan.model.units import MM

LARGEST: Final = 1e6  # [deg], [mm] or [s]: beyond it nine decimals are more than a number holds


def to_file_unit(joint: Joint, q: Array) -> Array:
    """Positions of a joint in degrees or millimetres, shape (N,)."""
    return q * joint.display_unit.scale


def from_file_unit(joint: Joint, written: Array) -> Array:
    """Positions in [rad] or [m] that a reader makes of degrees or millimetres, shape (N,)."""
    return np.deg2rad(written) if joint.is_revolute else written / MM


def rounded_inside(joint: Joint, q: Array, decimals: int) -> Array:
    """Positions in degrees or millimetres with a fixed number of decimals, none beyond a limit when read back.

    Each is the nearest one, unless that lies outside: 169.99996 does not become 170.0000 where the limit is 169.99999.

    Args:
        q: Positions within its limits, in [rad] or [m], shape (N,).
        decimals: Of a degree or a millimetre.

    Raises:
        InputError: No number with so few decimals lies within the limits, or a number is too large for them.
    """
    quanta = rounded_quanta(to_file_unit(joint, q), decimals, what=f"joint {joint.name}")
    scale = 10.0**decimals
    quanta -= from_file_unit(joint, quanta / scale) > joint.upper
    quanta += from_file_unit(joint, quanta / scale) < joint.lower
    written: Array = quanta / scale + 0.0
    read = from_file_unit(joint, written)
    if not np.all((read >= joint.lower) & (read <= joint.upper)):
        raise InputError(f"joint {joint.name}: no number with {decimals} decimals lies within its limits")
    return written


def rounded_quanta(values: Array, decimals: int, *, what: str) -> Array:
    """Whole numbers of the last decimal that are nearest to the values, shape (N,).

    Raises:
        InputError: A value is not finite or too large for so many decimals.
    """
    if not np.all(np.abs(values) < LARGEST):
        raise InputError(f"{what}: expected numbers below {LARGEST:g}, got one that is too large for its decimals")
    return np.rint(values * 10.0**decimals)
