"""Poses as homogeneous matrices of shape (..., 4, 4), rotation vectors and the shift of a twist to another point."""

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cellplan.geometry import arrays

Array = arrays.Array

SMALL_ANGLE: Final = 1e-6  # [rad] below this the series of sin and cos are exact to double precision
HALF_TURN_TOL: Final = 1e-4  # [rad] nearer to pi than this the skew part of R is too small to give the axis

_NEXT: Final = np.array([1, 2, 0])
_AFTER: Final = np.array([2, 0, 1])


def pose(xyz: ArrayLike = (0.0, 0.0, 0.0), rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Array:
    """Pose from a position in [m] and fixed-axis roll, pitch, yaw in [rad] (``R = Rz Ry Rx``, as in URDF)."""
    X = np.eye(4)
    X[:3, :3] = rotation_from_rpy(rpy)
    X[:3, 3] = xyz
    return X


def pose_from(R: Array, p: Array) -> Array:
    """Poses from rotations, shape (..., 3, 3), and positions, shape (..., 3)."""
    X = np.zeros((*np.broadcast_shapes(R.shape[:-2], p.shape[:-1]), 4, 4))
    X[..., :3, :3] = R
    X[..., :3, 3] = p
    X[..., 3, 3] = 1.0
    return X


def inverse(X: Array) -> Array:
    """Inverse of rigid poses, shape (..., 4, 4)."""
    R_T = np.swapaxes(X[..., :3, :3], -1, -2)
    return pose_from(R_T, -(R_T @ X[..., :3, 3, None])[..., 0])


def transform_points(X_AB: Array, p_B: Array) -> Array:
    """Points given in B, shape (..., N, 3), expressed in A."""
    return p_B @ np.swapaxes(X_AB[..., :3, :3], -1, -2) + X_AB[..., None, :3, 3]


def rotation_from_rpy(rpy: ArrayLike) -> Array:
    """Rotation matrix of fixed-axis roll, pitch, yaw in [rad]."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def rpy_from_rotation(R: Array) -> Array:
    """Roll, pitch, yaw in [rad] of one rotation matrix; roll is zero where pitch is a quarter turn."""
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.hypot(R[0, 0], R[1, 0]) < SMALL_ANGLE:
        return np.array([0.0, pitch, np.arctan2(-R[0, 1], R[1, 1])])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def roll_pitch_yaw(R: Array) -> Array:
    """Roll, pitch, yaw in [rad] of many rotation matrices, shape (N, 3, 3) to (N, 3); see ``rpy_from_rotation``."""
    across = np.hypot(R[:, 0, 0], R[:, 1, 0])
    is_plain = across >= SMALL_ANGLE
    roll = np.where(is_plain, np.arctan2(R[:, 2, 1], R[:, 2, 2]), 0.0)
    yaw = np.where(is_plain, np.arctan2(R[:, 1, 0], R[:, 0, 0]), np.arctan2(-R[:, 0, 1], R[:, 1, 1]))
    return np.stack([roll, np.arctan2(-R[:, 2, 0], across), yaw], axis=1)


def skew(v: Array) -> Array:
    """Cross-product matrices ``S(v)``, shape (..., 3, 3), with ``S(v) w = v x w``."""
    S = np.zeros((*v.shape[:-1], 3, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = v[..., 2], -v[..., 1], v[..., 0]
    return S


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors, shape (..., 3): to the last bit those of NumPy, in a third of its time for a few."""
    return a[..., _NEXT] * b[..., _AFTER] - a[..., _AFTER] * b[..., _NEXT]


def rotation_about(axis: Array, angle: ArrayLike) -> Array:
    """Rotations by angles in [rad], shape (...), about one unit axis (Rodrigues' formula), shape (..., 3, 3)."""
    S = skew(np.asarray(axis, dtype=float))
    angle = np.asarray(angle, dtype=float)[..., None, None]
    return np.eye(3) + np.sin(angle) * S + (1.0 - np.cos(angle)) * (S @ S)


def rotated(R: Array, vector: Array) -> Array:
    """One vector, shape (3,), turned by many rotations, shape (n, 3, 3), in one product, shape (n, 3)."""
    return (np.ascontiguousarray(R).reshape(-1, 3) @ vector).reshape(-1, 3)


def rotated_back(R: Array, vector: Array) -> Array:
    """One vector, shape (3,), turned by the inverses of many rotations, shape (n, 3, 3), to shape (n, 3)."""
    return np.einsum("i,nij->nj", vector, R)


def rotation_vector(R: Array) -> Array:
    """Rotation vectors (axis times angle in [rad], angle in 0..pi) of rotation matrices, shape (..., 3).

    Accurate near the identity, where the skew part carries the axis, and near a half turn, where the symmetric part
    does.
    """
    R = np.asarray(R)
    sine_axis = 0.5 * np.stack(
        [R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]], axis=-1
    )
    sine = np.linalg.norm(sine_axis, axis=-1)
    cosine = 0.5 * (np.trace(R, axis1=-2, axis2=-1) - 1.0)
    angle = np.arctan2(sine, cosine)
    scale = np.where(sine > SMALL_ANGLE, angle / np.where(sine > SMALL_ANGLE, sine, 1.0), 1.0)
    vector: Array = sine_axis * scale[..., None]
    half_turn = (np.pi - angle) < HALF_TURN_TOL
    if np.any(half_turn):
        vector[half_turn] = _half_turn_vectors(R[half_turn], angle[half_turn], sine_axis[half_turn])
    return vector


def _half_turn_vectors(R: Array, angle: Array, sine_axis: Array) -> Array:
    """Rotation vectors near a half turn, from the largest column of ``(R + R^T)/2 - cos(angle) I``."""
    outer = 0.5 * (R + np.swapaxes(R, -1, -2)) - np.cos(angle)[..., None, None] * np.eye(3)
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    axis = np.take_along_axis(outer, largest[..., None, None], axis=-1)[..., 0]
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    sign = np.where(np.sum(axis * sine_axis, axis=-1) < 0.0, -1.0, 1.0)
    return axis * (sign * angle)[..., None]


def rotation_exp(vector: Array) -> Array:
    """Rotation matrices of rotation vectors in [rad], shape (..., 3) to (..., 3, 3)."""
    angle = np.linalg.norm(vector, axis=-1)[..., None, None]
    S = skew(vector)
    small = angle < SMALL_ANGLE
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0 - angle**2 / 6.0, np.sin(safe) / safe)
    b = np.where(small, 0.5 - angle**2 / 24.0, (1.0 - np.cos(safe)) / safe**2)
    return np.eye(3) + a * S + b * (S @ S)


def quaternion_to_rotation(wxyz: Array) -> Array:
    """Rotation matrices of quaternions ``w, x, y, z``, shape (..., 4), normalised first."""
    w, x, y, z = np.moveaxis(wxyz / np.linalg.norm(wxyz, axis=-1, keepdims=True), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def frame_from_axes(z: Array, x_hint: Array) -> Array:
    """Rotations whose z axis is ``z`` and whose x axis leans to ``x_hint``; both shape (..., 3), z of unit length.

    Where the hint is parallel to z the result is not finite; the caller knows the words to say it.
    """
    x = x_hint - np.sum(x_hint * z, axis=-1, keepdims=True) * z
    with np.errstate(invalid="ignore", divide="ignore"):
        x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    return np.stack([x, cross(z, x), z], axis=-1)


def is_rigid(X: Array, tolerance: float = 1e-9) -> bool:
    """Say whether all poses, shape (..., 4, 4), are finite, orthogonal and right-handed."""
    if not np.all(np.isfinite(X)):
        return False
    R = X[..., :3, :3]
    orthogonal = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(initial=0.0) <= tolerance
    return bool(orthogonal and np.all(np.linalg.det(R) > 0.0))
