"""What a picture of an instant shows, as plain data."""

from collections.abc import Mapping
from dataclasses import dataclass

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Solid


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ShownSolid:
    """A solid of the picture.

    Attributes:
        name: Its name.
        shape: The solid.
        X_WS: Its pose in the world, shape (4, 4).
        material: Name of its colour.
        robot: Name of the robot that moves it; None in the surroundings.
    """

    name: str
    shape: Solid
    X_WS: Array
    material: str
    robot: str | None = None


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
    """A picture of an instant.

    Attributes:
        title: What it shows, in one line.
        notes: Lines below the title.
        is_bad: Whether that failed.
        solids: Everything solid.
        lines: Lines, hidden by what is in front of them.
        names: Names of the robots.
        materials: Colours by name.
        mark: The points that matter in the world in [m]: the nearest points of a pair, shape (2, 3), a place, shape
            (1, 3), or none, shape (0, 3).
        label: What is written beside it.
        floor: Height of the floor in [m]; None without one.
        marked: Names of the solids that matter.
    """

    title: str
    notes: tuple[str, ...]
    is_bad: bool
    solids: tuple[ShownSolid, ...]
    lines: tuple[ShownLine, ...]
    names: tuple[ShownName, ...]
    materials: Mapping[str, Colour]
    mark: Array
    label: str = ""
    floor: float | None = None
    marked: tuple[str, ...] = ()
