r"""All configurations of an arm with a spherical wrist that bring its flange to a pose, in closed form.

The last three axes meet in the wrist's centre, and the second and third axis are parallel. Each step solves one of the
equations of Paden and Kahan ([Murray1994]_ section 3.3) in the screw axes at the reference configuration:

1. The centre :math:`p = A_1 A_2 A_3 w` keeps its height along the second axis under the second and third joint, which
   leaves :math:`q_1`.
2. Its distance from the second axis depends on :math:`q_3` alone; :math:`q_2` turns it into place.
3. With these the rotation that is left is :math:`R_4 R_5 R_6`: the direction of the sixth axis gives :math:`q_5` and
   :math:`q_4`, and what is left is :math:`q_6`.

Every pair of signs in the steps 1 to 3 is a branch, so there are up to eight.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross, rotation_about
from cellplan.model.robot.robot import RobotModel

JOINTS: Final = 6
BRANCHES: Final = 8
MEETS: Final = 1e-5  # [m] within which axes meet, or [-] within which they are parallel: rounding in files


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SphericalWristArm:
    """An arm of six turning joints with a spherical wrist."""

    axes: Array  # directions of its axes at the reference configuration in the base frame, shape (6, 3)
    points: Array  # a point on each axis in [m], the centre of the wrist on the last three, shape (6, 3)

    @classmethod
    def of(cls, model: RobotModel) -> "SphericalWristArm | None":
        """The arm of a model; None where it is built otherwise."""
        joints = model.joints
        is_chain = list(model.links_to_flange) == list(range(JOINTS)) and len(joints) == JOINTS
        if not is_chain or not all(joint.is_revolute for joint in joints):
            return None
        axes = np.array([joint.axis_B for joint in joints])
        points = np.array([joint.point_B for joint in joints])
        across = np.eye(3) - axes[3:, :, None] * axes[3:, None, :]
        centre = np.linalg.lstsq(across.reshape(-1, 3), (across @ points[3:, :, None]).ravel(), rcond=None)[0]
        off_centre = np.linalg.norm(across @ (centre - points[3:])[:, :, None], axis=1).max()
        turns = np.abs(np.array([axes[1] @ axes[2], axes[0] @ axes[1], axes[3] @ axes[4], axes[4] @ axes[5]]))
        if off_centre > MEETS or turns[0] < 1.0 - MEETS or turns[1:].max() > 1.0 - MEETS:
            return None
        points[3:] = centre
        return cls(axes=axes, points=points)

    def configurations(self, D: Array) -> Array:
        """Configurations that give the last link some displacements; joint limits do not count.

        Args:
            D: Displacements of the last link from its place at the reference configuration, in the base frame, shape
                (N, 4, 4).

        Returns:
            Joint positions in [rad], each within half a turn, shape (N, 8, 6); NaN where a branch does not reach.
        """
        first, inner = self._first(D)
        q = np.concatenate([first, inner], axis=-1).reshape(len(D), BRANCHES // 2, 3)
        R_left = np.swapaxes(self._rotation(q, 0), -1, -2) @ D[:, None, :3, :3]
        wrist = self._wrist(R_left)
        both = np.repeat(q, 2, axis=1)
        q = np.concatenate([both, wrist.reshape(len(D), BRANCHES, 3)], axis=-1)
        q = np.remainder(q + np.pi, 2.0 * np.pi) - np.pi
        return np.where(np.isnan(q).any(axis=-1, keepdims=True), np.nan, q)

    def _first(self, D: Array) -> tuple[Array, Array]:
        """Positions of the first joint, shape (N, 2, 2, 1), and of the second and third, shape (N, 2, 2, 2)."""
        (s1, s2, s3), (o1, o2, o3), w = self.axes[:3], self.points[:3], self.points[3]
        v = (D[:, :3, :3] @ w + D[:, :3, 3]) - o1
        across = v - (v @ s1)[:, None] * s1
        height = s2 @ (w - o1) - (v @ s1) * (s1 @ s2)
        q1 = _turns(across @ s2, -(cross(s1, v) @ s2), height)
        p = (
            o1
            + (np.swapaxes(rotation_about(s1, q1.ravel()), 1, 2).reshape(*q1.shape, 3, 3) @ v[:, None, :, None])[..., 0]
        )
        y = _across(p - o2, s2)
        u, t = _across(w - o3, s2), _across(o3 - o2, s2)
        q3 = _turns(t @ u, t @ cross(s3, u), 0.5 * ((y**2).sum(axis=-1) - t @ t - u @ u))
        x = t + (_rotations(s3, q3) @ u[:, None])[..., 0]
        q2 = _turn(x, y[:, :, None], s2)
        return np.broadcast_to(q1[:, :, None, None], (*q3.shape, 1)), np.stack([q2, q3], axis=-1)

    def _wrist(self, R: Array) -> Array:
        """Positions of the last three joints for rotations of shape (N, M, 3, 3), shape (N, M, 2, 3)."""
        s4, s5, s6 = self.axes[3:]
        y = R @ s6
        along = (s6 @ s5) * s5
        q5 = _turns(s4 @ (s6 - along), s4 @ cross(s5, s6), y @ s4 - s4 @ along)
        x = (_rotations(s5, q5) @ s6[:, None])[..., 0]
        q4 = _turn(_across(x, s4), _across(y, s4)[..., None, :], s4)
        q45 = np.stack([q4, q5], axis=-1)
        R6 = np.swapaxes(self._rotation(q45, 3), -1, -2) @ R[..., None, :, :]
        v = _across(np.eye(3)[np.argmin(np.abs(s6))], s6)
        q6 = _turn(np.broadcast_to(v, R6.shape[:-1]), R6 @ v, s6)
        return np.concatenate([q45, q6[..., None]], axis=-1)

    def _rotation(self, q: Array, first: int) -> Array:
        """Rotation by some joints from the first of them on, from q of shape (..., k) to shape (..., 3, 3)."""
        R = np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3))
        for k in range(q.shape[-1]):
            R = R @ _rotations(self.axes[first + k], q[..., k])
        return R


def _rotations(axis: Array, angles: Array) -> Array:
    """Rotations about a unit axis, for angles of shape (...) in shape (..., 3, 3)."""
    return rotation_about(axis, angles.ravel()).reshape(*angles.shape, 3, 3)


def _turns(a: Array | float, b: Array | float, d: Array) -> Array:
    """Both angles with ``a cos q + b sin q = d``, from shape (...) to (..., 2); NaN where there is none."""
    size = np.hypot(a, b)
    with np.errstate(invalid="ignore", divide="ignore"):
        half = np.arccos(np.where(np.abs(d / size) < 1.0 + MEETS, np.clip(d / size, -1.0, 1.0), np.nan))
    middle = np.arctan2(b, a)
    return np.stack([middle + half, middle - half], axis=-1)


def _turn(x: Array, y: Array, axis: Array) -> Array:
    """Angle that turns x about an axis onto y, both across it, shape (..., 3) to (...)."""
    return np.arctan2(np.cross(x, y) @ axis, (x * y).sum(axis=-1))


def _across(v: Array, axis: Array) -> Array:
    """Part of vectors of shape (..., 3) across a unit axis."""
    return v - (v @ axis)[..., None] * axis
