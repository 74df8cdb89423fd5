"""Seam: walls beside a path as the user states them, how the tool is held to them, and how it weaves."""

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
        rod_clearance: Least distance in [m] of a rod from the walls, or of a whole tool without a rod; None for one
            that touches them at most, of a rod only.
    """

    walls: Mapping[str, Array | WallPlace]
    angles: SeamAngles
    rod_clearance: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """The part of a path that a task runs along: lengths in [m] along the path as it is drawn."""

    begin: float = 0.0  # length before it
    end: float | None = None  # length at its end; None for that of the path
    is_reversed: bool = False  # whether it is run along from its end to its begin
    overlap: float = 0.0  # length by which it goes on past the start of a closed path
    back: float = 0.0  # length by which the tool goes back at the end, held as it came


class WeaveForm(StrEnum):
    """Line of a weave."""

    SINE = "sine"
    ZIGZAG = "zigzag"  # straight from edge to edge
    TRIANGLE = "triangle"  # straight from the root over both edges, which are farther out
    CIRCLE = "circle"  # round a centre that travels along the seam


@dataclass(frozen=True, slots=True, kw_only=True)
class Weave:
    """How a tip swings about its seam: one wavelength, with lengths in [m]."""

    form: WeaveForm
    side: float  # from the seam to each edge, across travel and tool
    wavelength: float  # length of the seam for one whole period, dwells included
    dwells: tuple[float, float] = (0.0, 0.0)  # length for which it travels along the left and the right edge
    out: float = 0.0  # distance of the edges from the seam, out of the part: of a triangle
    stands: bool = False  # whether it stands at the edges meanwhile, and travels faster between them
