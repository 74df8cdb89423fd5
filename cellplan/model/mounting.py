"""Mounting: pedestals, and bodies mounted on links, beside the bodies of the robot's own file."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.shapes import Box, Cylinder, Solid
from cellplan.geometry.transforms import Array, inverse, pose

PEDESTAL_TOL: Final = 1e-6  # [m] a base that stands nearer to the floor than this has no pedestal below it


@dataclass(frozen=True, slots=True, kw_only=True)
class Pedestal:
    """An upright column or box from the floor to a robot's base; it moves with the base.

    Attributes:
        radius: Radius in [m] of a column; None for a box.
        size: Edge lengths in [m] of a box along the base's x and y, seen from above; None for a column.
        floor: Height of the floor in the world in [m].
    """

    radius: float | None = None
    size: tuple[float, float] | None = None
    floor: float = 0.0

    def __post_init__(self) -> None:
        """Make sure that it is either a column or a box."""
        if (self.radius is None) == (self.size is None):
            raise ValueError("a pedestal has either a radius (column) or a size (box)")

    def solid(self, X_WB: Array) -> tuple[Solid, Array] | None:
        """The solid below a base and its pose in the base frame B; None below a base that stands on the floor.

        The pedestal stands upright in the world below the origin of the base, and a box turns with its heading; a base
        that leans a little leans on top of it.

        Args:
            X_WB: The base in the world, shape (4, 4).
        """
        x, y, top = (float(value) for value in X_WB[:3, 3])
        height = top - self.floor
        if height < PEDESTAL_TOL:
            return None
        heading = float(np.arctan2(X_WB[1, 0], X_WB[0, 0]))
        X_WS = pose((x, y, self.floor + 0.5 * height), (0.0, 0.0, heading))
        shape: Solid = (
            Box((*self.size, height)) if self.size is not None else Cylinder(float(self.radius or 0.0), height)
        )
        return shape, inverse(X_WB) @ X_WS
