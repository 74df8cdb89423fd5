"""Dense linearisation: the motion of every tool relative to the part, as one matrix over the joints of all robots."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, rotation_vector, skew
from cellplan.scene.kinematics.pinocchio_model import CellState


def cooperation_jacobian(state: CellState, p_WT: Array, signs: Array, *, X_WR: Array | None = None) -> Array:
    r"""Stack the relative Jacobians of all operators ([Ribeiro2010]_ Eqs. 3.56, 4.33).

    .. math:: {}_P V_{PT_i} = \begin{bmatrix} R & -R S(p_i) \\ 0 & R \end{bmatrix}
              \left( \$_{T_i} \dot q_i - \$_P \dot q_p \right), \quad R = R_{WP}^T

    Both twists are taken at the world origin, so their difference is the relative twist; the matrix in front moves it
    to the tool tip ``p_i`` and expresses it in P. The thesis prints both robots with a plus sign: there the minus of
    the positioner hides in the orientation of its screws.

    Args:
        p_WT: Tool tips in the world, shape (tasks, 3), in [m].
        signs: Sign of each joint in each task, see `TaskConstraints.column_signs`, shape (tasks, nq).
        X_WR: Reference frame of each task, see `TaskConstraints.reference_frames`, shape (tasks, 4, 4); P when None.

    Returns:
        Linear part in [m] before angular part in [rad], expressed in P, shape (tasks, 6, nq). Where state, tips and
        frames have further axes before these, so has the result.
    """
    R = state.X_WP[:3, :3].T if X_WR is None else np.swapaxes(X_WR[..., :3, :3], -1, -2)
    to_tip = np.zeros((*p_WT.shape[:-1], 6, 6))
    to_tip[..., :3, :3] = to_tip[..., 3:, 3:] = R
    to_tip[..., :3, 3:] = -R @ skew(p_WT)
    return to_tip @ (state.screws_W[..., None, :, :] * signs[:, None, :])


def pose_errors(X_PT_desired: Array, X_PT: Array, is_spin_free: Sequence[bool] | NDArray[np.bool_]) -> Array:
    """Errors of tool poses on the part, in P: desired minus actual position, then rotation vector of ``R_d R^T``.

    With free spin the rotation is the smallest one that takes the tool axis to the desired one.

    Args:
        X_PT_desired: Reference poses, one per task, shape (n, 4, 4).
        X_PT: Actual poses, shape (n, 4, 4).
        is_spin_free: Whether rotation about the tool axis is left open, per task.

    Returns:
        Errors in [m] and [rad], shape (n, 6).
    """
    errors = np.empty((len(X_PT), 6))
    errors[:, :3] = X_PT_desired[:, :3, 3] - X_PT[:, :3, 3]
    errors[:, 3:] = rotation_vector(X_PT_desired[:, :3, :3] @ np.swapaxes(X_PT[:, :3, :3], 1, 2))
    free = np.asarray(is_spin_free)
    if free.any():
        errors[free, 3:] = _tilts(X_PT[free, :3, 2], X_PT_desired[free, :3, 2])
    return errors


def _tilts(z: Array, z_desired: Array) -> Array:
    """Smallest rotation vectors that turn unit vectors ``z`` onto ``z_desired``, shape (n, 3).

    Opposite vectors are a half turn apart about any axis across them.
    """
    across = np.cross(z, z_desired)
    sine = np.linalg.norm(across, axis=1, keepdims=True)
    cosine = np.sum(z * z_desired, axis=1, keepdims=True)
    angle = np.arctan2(sine, cosine)
    tilts: Array = across * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 1.0)
    opposite = ((sine == 0.0) & (cosine < 0.0))[:, 0]
    any_across = np.cross(z[opposite], np.eye(3)[np.argmin(np.abs(z[opposite]), axis=1)])
    tilts[opposite] = np.pi * any_across / np.linalg.norm(any_across, axis=1, keepdims=True)
    return tilts
