"""Seam line: the base line of a path with the walls beside it, and tool axes by working and travel angle.

Angles are those of AWS A3.0. With the travel t, the outward normal n of the wall that the work angle is measured from
and the open side s, all of length one and at right angles, a tool with the work angle w and the travel angle v has the
axis

.. math:: a = -(n cos w + s sin w) cos v + t sin v

into the part. The open side points away from the other wall. Where there is none, or where both face alike as in a butt
joint, it points to the left of travel, seen against the normal.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.curve import Interval
from cellplan.geometry.transforms import cross

FACE_ALIKE: Final = np.sin(np.deg2rad(1.0))  # [-] walls whose normals differ by less than 1 deg across the seam


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamLine:
    """Points of a seam with travel and walls; a corner stands twice, once as it is come to and once as it is left.

    Attributes:
        source: File or key that it comes from, for messages.
        points: Points in [m], shape (N, 3), expressed in P.
        tangents: Unit directions of travel, shape (N, 3), expressed in P.
        behind: Length in [m] along the seam behind each point, shape (N,); the same at both points of a corner.
        walls: Outward unit normals of the walls beside it by name, shape (N, 3) each, expressed in P.
        is_closed: Whether the last point is the first one again.
    """

    source: str
    points: Array
    tangents: Array
    behind: Array
    walls: Mapping[str, Array]
    is_closed: bool

    def __post_init__(self) -> None:
        """Check that all that is stated of a point is stated of each."""
        sizes = {np.shape(values) for values in (self.points, self.tangents, *self.walls.values())}
        if sizes != {(len(self.behind), 3)} or len(self.behind) < 2 or np.any(np.diff(self.behind) < 0.0):
            raise ValueError(
                f"seam line '{self.source}': expected vectors at lengths that do not decrease, got {sizes}"
            )


class SeamPlaces(Protocol):
    """A seam along a curve."""

    def line(self, u: Array, interval: Interval) -> SeamLine:
        """The seam at parameters of the curve, shape (N,), within an interval of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SeamAngles:
    """How a tool is held along a seam."""

    face: str  # name of the wall that the work angle is measured from
    # work angle in [rad] from the perpendicular to this wall towards the open side; None for halfway between two walls
    work: float | None = 0.0
    travel: float = 0.0  # travel angle in [rad] from the perpendicular to the seam: positive to push, negative to drag
    standoff: float = 0.0  # distance in [m] of the tip from the seam, against the axis of the tool
    side: float = 0.0  # distance in [m] of a pass from the seam across the weld face, towards a wall
    out: float = 0.0  # distance in [m] of a pass from the seam, out of the part between the walls
    toward: str | None = None  # name of that wall; None for the other one than ``face``
    is_mirrored: bool = False  # whether what is said of the left of travel holds for the right

    @property
    def is_offset(self) -> bool:
        """Whether the tip is beside the seam."""
        return any((self.standoff, self.side, self.out))


@dataclass(frozen=True, slots=True, eq=False)
class CrossSection:
    """Plane across a seam at each of its points: unit vectors of shape (N, 3), expressed in P."""

    normal: Array  # outward normal of a wall, made perpendicular to the seam
    open_side: Array  # along this wall, away from the other one


def cross_section(line: SeamLine, face: str, *, is_mirrored: bool = False) -> CrossSection:
    """Normal and open side of one of the walls at each point of a seam; see ``SeamAngles.is_mirrored``."""
    t = line.tangents
    normal = _across(line.walls[face], t)
    left = cross(t, normal) if is_mirrored else cross(normal, t)
    others = [_across(wall, t) for name, wall in line.walls.items() if name != face]
    lean = np.sum(others[0] * left, axis=1, keepdims=True) if others else np.zeros((len(t), 1))
    return CrossSection(normal, np.where(lean < -FACE_ALIKE, -left, left))


def tool_axes(line: SeamLine, angles: SeamAngles) -> Array:
    """Unit tool axes into the part at each point of a seam, shape (N, 3), expressed in P."""
    if angles.work is None:
        out, _ = weld_face(line, angles)
    else:
        section = cross_section(line, angles.face, is_mirrored=angles.is_mirrored)
        out = np.cos(angles.work) * section.normal + np.sin(angles.work) * section.open_side
    return -np.cos(angles.travel) * out + np.sin(angles.travel) * line.tangents


def tool_targets(line: SeamLine, angles: SeamAngles) -> tuple[Array, Array]:
    """Tool tips in [m] and unit tool axes into the part at each point of a seam, shape (N, 3) each, expressed in P."""
    axes = tool_axes(line, angles)
    out, lateral = weld_face(line, angles)
    return line.points - angles.standoff * axes + angles.out * out + angles.side * lateral, axes


def weld_face(line: SeamLine, angles: SeamAngles) -> tuple[Array, Array]:
    """Directions of passes at each point of a seam: out between the walls, and across the weld face.

    Across is towards the wall that the angles name; beside one wall, or two that face alike, it is to the left of
    travel, seen from outside. Between two walls that face each other, out is the normal of the wall that the work angle
    is measured from.

    Returns:
        Unit vectors, shape (N, 3) each, expressed in P.
    """
    t, names = line.tangents, [*line.walls]
    normals = [_across(line.walls[name], t) for name in names]
    middle = np.sum(normals, axis=0)
    is_open = np.linalg.norm(middle, axis=1, keepdims=True) > FACE_ALIKE
    out = _across(np.where(is_open, middle, normals[names.index(angles.face)]), t)
    left = cross(t, out) if angles.is_mirrored else cross(out, t)
    toward = angles.toward or next((name for name in names if name != angles.face), None)
    if toward is None:
        return out, left
    into = -np.sum(_across(line.walls[toward], t) * left, axis=1, keepdims=True)
    return out, np.where(into < -FACE_ALIKE, -left, left)


def _across(vectors: Array, t: Array) -> Array:
    """Unit vectors along the parts of others across unit vectors ``t``, shape (N, 3) each."""
    across = vectors - np.sum(vectors * t, axis=1, keepdims=True) * t
    return across / np.linalg.norm(across, axis=1, keepdims=True)
