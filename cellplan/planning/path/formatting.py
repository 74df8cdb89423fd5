"""How points and directions of the part read in messages."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array

MM: Final = 1000.0  # [mm/m]
AXIS_NAMES: Final = ("x", "y", "z")
NAMED: Final = 1e-9  # [-] a direction this near to an axis is called by the axis


def in_mm(point: Array) -> str:
    """Coordinates in mm: ``(100, 0, 250) mm``."""
    return f"({', '.join(length(value) for value in point)}) mm"


def length(value: float) -> str:
    """A length in mm without its unit, to a tenth of a micron at most."""
    return f"{round(value * MM, 4) + 0.0:.10g}"


def direction_name(direction: Array) -> str:
    """``+z`` for an axis, else the components: ``[0.6, 0, 0.8]``."""
    axis = int(np.argmax(np.abs(direction)))
    sign = "+" if direction[axis] > 0.0 else "-"
    if np.linalg.norm(np.delete(direction, axis)) <= NAMED * np.linalg.norm(direction):
        return sign + AXIS_NAMES[axis]
    return f"[{', '.join(f'{round(value, 4) + 0.0:g}' for value in direction)}]"
