"""What a picture of an instant shows, as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Solid


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownSolid:
    """A solid of the picture."""

    name: str
    shape: Solid
    X_WS: Array  # its pose in the world, shape (4, 4)
    material: str  # name of its colour
    robot: str | None = None  # name of the robot that moves it; None in the surroundings


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownLine:
    """A line through points in the world in [m], shape (N, 3), in the colour of a material; its width in pixels."""

    points: Array
    material: str
    width: float = 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownName:
    """A name at a point of the world in [m], shape (3,)."""

    text: str
    at: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Colour:
    """A colour where it is light, and where it is dark around."""

    light: str
    dark: str


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class StillPicture:
    """A picture of an instant."""

    title: str  # what it shows, in one line
    notes: tuple[str, ...]  # lines below the title
    is_bad: bool  # whether that failed
    solids: tuple[ShownSolid, ...]  # everything solid
    lines: tuple[ShownLine, ...]  # lines, hidden by what is in front of them
    names: tuple[ShownName, ...]  # names of the robots
    materials: Mapping[str, Colour]  # colours by name
    # the points that matter in the world in [m]: the nearest points of a pair, shape (2, 3), a place, shape (1, 3), or
    # none, shape (0, 3)
    mark: Array
    label: str = ""  # what is written beside it
    floor: float | None = None  # height of the floor in [m]; None without one
    marked: tuple[str, ...] = ()  # names of the solids that matter
