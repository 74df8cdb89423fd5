"""Seam: walls beside a path as the user states them, and how the tool is held to them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamAngles


class WallPlace(StrEnum):
    """Where a wall is that has no direction of its own."""

    SURFACE = "surface"  # the part under a projected path
    LEFT = "left"  # upright on the other wall, on the left of travel
    RIGHT = "right"  # likewise on the right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Seam:
    """Walls beside a path, and how the tool is held to them.

    Attributes:
        walls: Outward unit normals in P by name, shape (3,) each, or where a wall is; none for a seam line, which has
            its own.
        angles: How the tool is held.
    """

    walls: Mapping[str, Array | WallPlace]
    angles: SeamAngles
