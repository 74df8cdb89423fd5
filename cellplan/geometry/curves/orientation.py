"""Orientation of a tool along a curve, with its angular velocity: fixed, leaning on a surface, or given at points."""

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.curves.curve import Curve, Interval, spans_at, tangents
from cellplan.geometry.curves.surface_patch import Patch
from cellplan.geometry.transforms import Array, cross, frame_from_axes, rotation_about, rotation_exp, rotation_vector

THIRD: Final = 1.0 / 3.0  # [-] share of an end slope in the first and last factor of a cubic


class Orientation(Protocol):
    """Tool frames along a curve: smooth between its knots where the curve is."""

    @property
    def knots(self) -> Array:
        """Increasing parameters at which the frames' dependence on parameter and tip changes, shape (M,)."""

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:
        """Tool frames and their turning rate.

        Args:
            u: Parameters, shape (N,).
            p: Tool tip at these parameters in [m], shape (N, 3).
            dp: Its derivative by the parameter, shape (N, 3).

        Returns:
            Rotations, shape (N, 3, 3), and angular velocities per parameter ``vee(dR/du R^T)``, shape (N, 3), both
            expressed in the frame of the curve.
        """


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FixedFrame:
    """The same orientation ``R``, shape (3, 3), all along."""

    R: Array

    @property
    def knots(self) -> Array:
        """None, see `Orientation`."""
        return np.zeros(0)

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:  # noqa: ARG002
        """Tool frames and their turning rate, see `Orientation`."""
        return np.broadcast_to(self.R, (len(u), 3, 3)), np.zeros((len(u), 3))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpunFrame:
    """Another orientation, turned by a constant ``angle`` in [rad] about its own z axis."""

    frame: Orientation
    angle: float

    @property
    def knots(self) -> Array:
        """Those of the other one, see `Orientation`."""
        return self.frame.knots

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:
        """Tool frames and their turning rate, see `Orientation`."""
        R, w = self.frame.frames(u, interval, p=p, dp=dp)
        return R @ rotation_about(np.array([0.0, 0.0, 1.0]), self.angle), w


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NormalFrame:
    """Tool z along the inward normal of a surface patch, tool x leaning to ``x_hint``, shape (3,)."""

    patch: Patch
    x_hint: Array

    @property
    def knots(self) -> Array:
        """None: a patch is smooth, see `Orientation`."""
        return np.zeros(0)

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:  # noqa: ARG002
        """Tool frames and their turning rate, see `Orientation`."""
        return leaning_frames(-self.patch.normals(p), -self.patch.normal_rates(p, dp), self.x_hint)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AxisFrame:
    """Tool z along an interpolated axis, normalised; tool x leaning to ``x_hint``, shape (3,)."""

    axes: Curve
    x_hint: Array

    @property
    def knots(self) -> Array:
        """Those of the axis, see `Orientation`."""
        return self.axes.knots

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:  # noqa: ARG002
        """Tool frames and their turning rate, see `Orientation`."""
        axis, rate = self.axes.evaluate(u, interval)
        norm = np.linalg.norm(axis, axis=1, keepdims=True)
        z = axis / norm
        dz = (rate - np.sum(rate * z, axis=1, keepdims=True) * z) / norm
        return leaning_frames(z, dz, self.x_hint)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RotationCurve:
    r"""Cubic through given orientations, the counterpart of a Bezier curve on the rotations.

    .. math:: R(x) = R_k \exp(b_1 v_1) \exp(b_2 v_2) \exp(b_3 v_3),
              \quad b_1 = 1 - (1 - x)^3, \; b_2 = 3 x^2 - 2 x^3, \; b_3 = x^3
    """

    knots: Array  # increasing parameters, shape (M + 1,)
    starts: Array  # orientation at the start of each span, shape (M, 3, 3)
    factors: Array  # rotation vectors v1, v2, v3 of each span in [rad], shape (M, 3, 3), in the tool frame

    def frames(self, u: Array, interval: Interval, *, p: Array, dp: Array) -> tuple[Array, Array]:  # noqa: ARG002
        """Tool frames and their turning rate, see `Orientation`."""
        k = spans_at(self.knots, u, interval)
        width = (self.knots[k + 1] - self.knots[k])[:, None]
        x = (u - self.knots[k])[:, None] / width
        v1, v2, v3 = np.moveaxis(self.factors[k], 1, 0)
        R = self.starts[k]
        rate = _turned(R, v1 * 3.0 * (1.0 - x) ** 2)
        R = R @ rotation_exp(v1 * (1.0 - (1.0 - x) ** 3))
        rate = rate + _turned(R, v2 * 6.0 * x * (1.0 - x))
        R = R @ rotation_exp(v2 * x * x * (3.0 - 2.0 * x))
        rate = rate + _turned(R, v3 * 3.0 * x * x)
        R = R @ rotation_exp(v3 * x**3)
        return R, rate / width


def rotations_through(knots: Array, rotations: Array, *, breaks: NDArray[np.bool_]) -> RotationCurve:
    """Smooth orientations through given ones; a span between two breaks rotates uniformly about one axis.

    Knots increase, shape (N,); rotations have the shape (N, 3, 3); ``breaks`` says where the angular velocity may jump,
    shape (N,), see `cellplan.geometry.curves.curve.tangents`.
    """
    width = np.diff(knots)[:, None]
    between = np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]
    leaving, arriving = tangents(rotation_vector(between) / width, width, breaks)
    v1, v3 = THIRD * width * leaving, THIRD * width * arriving
    v2 = rotation_vector(rotation_exp(-v1) @ between @ rotation_exp(-v3))
    return RotationCurve(knots=knots, starts=rotations[:-1], factors=np.stack([v1, v2, v3], axis=1))


def leaning_frames(z: Array, dz: Array, x_hint: Array) -> tuple[Array, Array]:
    r"""Frames with axis ``z`` whose x leans to a fixed direction, and their angular velocity.

    With x the unit vector along ``h - (h . z) z``, the angular velocity follows from the rates of the three axes:
    ``w = (x * dx + y * dy + z * dz) / 2`` with ``*`` the cross product.

    The unit axes, shape (N, 3), are nowhere parallel to h, shape (3,).
    """
    R = frame_from_axes(z, np.broadcast_to(x_hint, z.shape))
    x, y = R[:, :, 0], R[:, :, 1]
    along = np.sum(x_hint * z, axis=1, keepdims=True)
    lean_rate = -np.sum(x_hint * dz, axis=1, keepdims=True) * z - along * dz
    lean = np.sum(x_hint * x, axis=1, keepdims=True)
    dx = (lean_rate - np.sum(lean_rate * x, axis=1, keepdims=True) * x) / lean
    dy = cross(dz, x) + cross(z, dx)
    return R, 0.5 * (cross(x, dx) + cross(y, dy) + cross(z, dz))


def _turned(R: Array, v: Array) -> Array:
    """Vectors ``R v``, shapes (N, 3, 3) and (N, 3)."""
    return (R @ v[..., None])[..., 0]
