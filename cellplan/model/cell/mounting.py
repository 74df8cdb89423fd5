"""Mounting: what a robot stands on, hangs from or is fixed to; it moves with the base."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.shapes import Box, Cylinder, Mesh, Solid
from cellplan.geometry.transforms import Array, inverse, pose

PEDESTAL_TOL: Final = 1e-6  # [m] a base nearer to the floor than this has no pedestal below it
SIDE_COUNT: Final = 48  # [-] sides of the prism round a column with a slanting top: 0.2 % of its radius wider


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column or a box between a robot's base and what carries it."""

    radius: float | None = None  # radius in [m] of a column; None for a box
    # edge lengths in [m] of a box along the base's x and y, seen along its z; None for a column
    size: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Make sure that it is either a column or a box."""
        if (self.radius is None) == (self.size is None):
            raise ValueError("a pedestal has either a radius (column) or a size (box)")

    @property
    def name(self) -> str:
        """Name of the body in reports, after that of the robot."""
        return "mount"

    def prism(self, length: float) -> Solid:
        """The column or box of a length in [m], along z and centred."""
        return Box((*self.size, length)) if self.size is not None else Cylinder(float(self.radius or 0.0), length)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pedestal(Column):
    """An upright column or box from the floor to a robot's base.

    It stands upright in the world below the origin of the base, and a box turns with its heading; a base that leans a
    little leans on top of it.
    """

    floor: float = 0.0  # height of the floor in the world in [m]

    @property
    def name(self) -> str:
        """Name of the body in reports, after that of the robot."""
        return "pedestal"

    def solid(self, X_WB: Array) -> tuple[Solid, Array] | None:
        """The solid below a base and its pose in the base frame B; None below a base that stands on the floor.

        ``X_WB`` is the base in the world, shape (4, 4).
        """
        height = float(X_WB[2, 3]) - self.floor
        return None if height < PEDESTAL_TOL else _upright(self, X_WB, bottom=self.floor, height=height)


@dataclass(frozen=True, slots=True, kw_only=True)
class Hanger(Column):
    """An upright column or box from a robot's base, which hangs upside down, to the ceiling."""

    ceiling: float  # height of the ceiling in the world in [m]

    def solid(self, X_WB: Array) -> tuple[Solid, Array] | None:
        """The solid above a base and its pose in B; None for a base at the ceiling; see `Pedestal.solid`."""
        bottom = float(X_WB[2, 3])
        height = self.ceiling - bottom
        return None if height < PEDESTAL_TOL else _upright(self, X_WB, bottom=bottom, height=height)


@dataclass(frozen=True, slots=True, kw_only=True)
class Bracket(Column):
    """A column or box behind a robot's base, along its -z axis: to a wall, or to whatever carries it."""

    length: float  # length in [m]

    def solid(self, X_WB: Array) -> tuple[Solid, Array] | None:  # noqa: ARG002 (it is fixed to the base)
        """The solid behind a base and its pose in B; see `Pedestal.solid`."""
        return self.prism(self.length), pose((0.0, 0.0, -0.5 * self.length))


@dataclass(frozen=True, slots=True, kw_only=True)
class Wedge(Column):
    """An upright column or box from the floor to a robot's tilted base, cut off along the plane of the base."""

    floor: float = 0.0  # height of the floor in the world in [m]

    def solid(self, X_WB: Array) -> tuple[Solid, Array] | None:
        """The solid below a base and its pose in B; None where it would have no height; see `Pedestal.solid`."""
        x, y = self.outline()
        heading = _heading(X_WB)
        X_WS = pose((float(X_WB[0, 3]), float(X_WB[1, 3]), self.floor), (0.0, 0.0, heading))
        normal = X_WS[:3, :3].T @ X_WB[:3, 2]
        top = float(X_WB[2, 3]) - self.floor - (normal[0] * x + normal[1] * y) / normal[2]
        if np.min(top) < PEDESTAL_TOL:
            return None
        corners = np.concatenate([np.stack([x, y, np.zeros_like(x)], axis=1), np.stack([x, y, top], axis=1)])
        return Mesh(corners, _prism_faces(len(x)), self.name, is_closed=True), inverse(X_WB) @ X_WS

    def outline(self) -> tuple[Array, Array]:
        """Corners of the base area in [m], counter-clockwise, x and y in the frame below the base, shape (n,) each."""
        if self.size is not None:
            return 0.5 * self.size[0] * np.array([1.0, -1, -1, 1]), 0.5 * self.size[1] * np.array([1.0, 1, -1, -1])
        angles = np.arange(SIDE_COUNT) * (2.0 * np.pi / SIDE_COUNT)
        outside = float(self.radius or 0.0) / np.cos(np.pi / SIDE_COUNT)
        return outside * np.cos(angles), outside * np.sin(angles)


Mount = Pedestal | Hanger | Bracket | Wedge


def _upright(column: Column, X_WB: Array, *, bottom: float, height: float) -> tuple[Solid, Array]:
    """An upright solid on the vertical through a base, and its pose in B."""
    X_WS = pose((float(X_WB[0, 3]), float(X_WB[1, 3]), bottom + 0.5 * height), (0.0, 0.0, _heading(X_WB)))
    return column.prism(height), inverse(X_WB) @ X_WS


def _heading(X_WB: Array) -> float:
    """Direction of the base's x axis seen from above in [rad]."""
    return float(np.arctan2(X_WB[1, 0], X_WB[0, 0]))


def _prism_faces(n: int) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """Triangles of a prism over n corners, counter-clockwise from outside: its lower corners first, then the upper."""
    lower, after = np.arange(n), (np.arange(n) + 1) % n
    sides = [np.stack([lower, after, after + n], axis=1), np.stack([lower, after + n, lower + n], axis=1)]
    fan = np.stack([np.zeros(n - 2, dtype=int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    return np.concatenate([*sides, fan[:, ::-1], fan + n])
