"""Smooth patches of a part's surface: where a ray meets them, which way they face and how that changes along a path."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.curves.curve import Curve, Interval
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import Array, cross

BORDER_TOL: Final = 1e-9  # [m] a point this far beyond the border of a patch still lies on it: rounding of the input
PARALLEL_TOL: Final = 1e-12  # [-] squared share of a direction across an axis below which it runs along it


class Patch(Protocol):
    """A smooth piece of surface; it is continued beyond its border where the mathematics can."""

    def hits(self, points: Array, direction: Array) -> Array:
        """Where the lines through the points meet the patch on the side facing ``direction``; not finite if never."""

    def covers(self, hits: Array) -> NDArray[np.bool_]:
        """Whether hits lie within the border of the patch, shape (N,)."""

    def normals(self, p: Array) -> Array:
        """Outward unit normals at points of the patch, shape (N, 3)."""

    def normal_rates(self, p: Array, dp: Array) -> Array:
        """Change of the outward normals when the points move by ``dp`` within the patch, shape (N, 3)."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Flat:
    """Part of a plane: its centre and outward normal, shape (3,) each."""

    centre: Array
    normal: Array

    def hits(self, points: Array, direction: Array) -> Array:
        """Where lines meet the plane, see `Patch`."""
        height = ((self.centre - points) @ self.normal) / (direction @ self.normal)
        return points + height[:, None] * direction

    def normals(self, p: Array) -> Array:
        """The one normal, see `Patch`."""
        return np.broadcast_to(self.normal, p.shape)

    def normal_rates(self, p: Array, dp: Array) -> Array:
        """Zero, see `Patch`."""
        return np.zeros(np.broadcast_shapes(p.shape, dp.shape))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Face(_Flat):
    """Flat face of a box; ``half_edges`` are half its two edges as vectors, shape (2, 3)."""

    half_edges: Array

    def covers(self, hits: Array) -> NDArray[np.bool_]:
        """Whether hits lie within the four edges, see `Patch`."""
        half = np.linalg.norm(self.half_edges, axis=1)
        along = (hits - self.centre) @ (self.half_edges / half[:, None]).T
        return np.all(np.abs(along) <= half + BORDER_TOL, axis=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Cap(_Flat):
    """Flat end of a cylinder of the given radius."""

    radius: float

    def covers(self, hits: Array) -> NDArray[np.bool_]:
        """Whether hits lie within the rim, see `Patch`."""
        return np.linalg.norm(hits - self.centre, axis=1) <= self.radius + BORDER_TOL


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Wall:
    """Round wall of a cylinder: its centre, unit axis, radius and half length."""

    centre: Array
    axis: Array
    radius: float
    half_length: float

    def hits(self, points: Array, direction: Array) -> Array:
        """Where lines meet the endless wall on the side they come from, see `Patch`."""
        across = direction - (direction @ self.axis) * self.axis
        return _round_hits(points, direction, across=across, offset=self._across(points), radius=self.radius)

    def covers(self, hits: Array) -> NDArray[np.bool_]:
        """Whether hits lie between the two rims, see `Patch`."""
        return np.abs((hits - self.centre) @ self.axis) <= self.half_length + BORDER_TOL

    def normals(self, p: Array) -> Array:
        """Directions straight away from the axis, see `Patch`."""
        across = self._across(p)
        return across / np.linalg.norm(across, axis=-1, keepdims=True)

    def normal_rates(self, p: Array, dp: Array) -> Array:  # noqa: ARG002
        """The part of the motion across the axis, over the radius, see `Patch`."""
        return (dp - (dp @ self.axis)[..., None] * self.axis) / self.radius

    def _across(self, points: Array) -> Array:
        """Parts of the points' position across the axis."""
        offset = points - self.centre
        return offset - (offset @ self.axis)[..., None] * self.axis


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ball:
    """Surface of a sphere: its centre and radius."""

    centre: Array
    radius: float

    def hits(self, points: Array, direction: Array) -> Array:
        """Where lines meet the sphere on the side they come from, see `Patch`."""
        return _round_hits(points, direction, across=direction, offset=points - self.centre, radius=self.radius)

    def covers(self, hits: Array) -> NDArray[np.bool_]:
        """Every line that does not pass by, see `Patch`."""
        return np.all(np.isfinite(hits), axis=1)

    def normals(self, p: Array) -> Array:
        """Directions straight away from the centre, see `Patch`."""
        offset = p - self.centre
        return offset / np.linalg.norm(offset, axis=-1, keepdims=True)

    def normal_rates(self, p: Array, dp: Array) -> Array:  # noqa: ARG002
        """The motion over the radius, see `Patch`."""
        return dp / self.radius


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProjectedCurve:
    """A curve projected onto a patch along a direction.

    With the height h along the direction d, ``p = c + h d`` stays on the patch when ``n . (dc + dh d) = 0``.
    """

    curve: Curve  # the curve before projection
    patch: Patch  # where it comes to lie
    direction: Array  # unit direction towards the side it comes from, shape (3,)

    @property
    def knots(self) -> Array:
        """The knots of the projected curve."""
        return self.curve.knots

    def evaluate(self, u: Array, interval: Interval) -> tuple[Array, Array]:
        """Points and derivatives, see `cellplan.geometry.curves.curve.Curve`."""
        c, dc = self.curve.evaluate(u, interval)
        p = self.patch.hits(c, self.direction)
        n = self.patch.normals(p)
        dh = -np.sum(n * dc, axis=1) / (n @ self.direction)
        return p, dc + dh[:, None] * self.direction


def patches_facing(shape: Box | Cylinder | Sphere, X: Array, direction: Array) -> tuple[Patch, ...]:
    """Patches of a solid that can be seen from a unit direction, shape (3,).

    ``X`` is the pose of the solid in the frame of the points, shape (4, 4).

    A line meets a convex solid on one facing patch only, so a hit that lies within a patch's border is the first one.
    """
    R, centre = X[:3, :3], X[:3, 3]
    match shape:
        case Sphere(radius):
            return (Ball(centre=centre, radius=radius),)
        case Cylinder(radius, length):
            axis = R[:, 2]
            caps = [Cap(centre=centre + 0.5 * length * n, normal=n, radius=radius) for n in (axis, -axis)]
            wall = Wall(centre=centre, axis=axis, radius=radius, half_length=0.5 * length)
            sides: tuple[Patch, ...] = () if _runs_along(direction, axis) else (wall,)
            return (*sides, *(cap for cap in caps if cap.normal @ direction > PARALLEL_TOL**0.5))
        case Box(size):
            half_edges = 0.5 * np.asarray(size) * R  # column i is the half edge along axis i
            return tuple(
                Face(
                    centre=centre + sign * half_edges[:, i],
                    normal=sign * R[:, i],
                    half_edges=np.delete(half_edges, i, axis=1).T,
                )
                for i in range(3)
                for sign in (1.0, -1.0)
                if sign * (R[:, i] @ direction) > PARALLEL_TOL**0.5
            )


def _runs_along(direction: Array, axis: Array) -> bool:
    """Say whether a direction runs along an axis, so that it never meets the wall round it."""
    across = direction - (direction @ axis) * axis
    return bool(across @ across <= PARALLEL_TOL)


def _round_hits(points: Array, direction: Array, *, across: Array, offset: Array, radius: float) -> Array:
    """Where lines meet a circular section on the side of ``direction``; not a number where they pass by.

    ``offset`` and ``across`` are position and direction in the section's plane (for a ball: in space).
    """
    square = across @ across
    normal = cross(offset, across)
    rest = radius**2 * square - np.sum(normal * normal, axis=-1)
    root = np.sqrt(np.where(rest >= 0.0, rest, np.nan))
    height = (root - offset @ across) / square
    return points + height[..., None] * direction
