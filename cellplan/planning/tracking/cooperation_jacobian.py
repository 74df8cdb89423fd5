"""Motion of every tool relative to the part, as one matrix over the joints of all robots."""

from collections.abc import Sequence

import numpy as np

from cellplan.geometry.transforms import Array, rotation_vector, skew
from cellplan.kinematics.pinocchio_model import CellState, CombinedModel
from cellplan.model.cell import Cell, Relation
from cellplan.model.task import Frame


def column_signs(cell: Cell, model: CombinedModel, tasks: Sequence[Relation], moving: Sequence[str]) -> Array:
    """Sign with which each joint enters each task: +1 in the operator, -1 in the positioner, 0 elsewhere.

    These are the arrow blocks of the cooperation Jacobian ([Ribeiro2010]_ Eq. 4.33). A robot that does not move has
    zeros: the part at rest, an operator that stands still and the single pair are not special cases. The grasp of a
    further holder has a row like a task's (4.5); a task in the world has no positioner.

    Args:
        cell: The cell.
        model: The combined model of its robots.
        tasks: The tasks and closures, one block row each.
        moving: Names of the robots that may move.

    Returns:
        Signs, shape (tasks, nq).
    """
    names = [robot.name for robot in cell.robots]
    carries = model.carries_flange.astype(float)
    may_move = np.zeros(cell.joint_count)
    for name in moving:
        may_move[cell.columns(name)] = 1.0
    signs = np.stack([carries[names.index(task.robot)] for task in tasks])
    for name in cell.positioners[:1]:
        signs -= np.outer([task.relative_to is Frame.PART for task in tasks], carries[names.index(name)])
    return signs * may_move


def reference_frames(state: CellState, tasks: Sequence[Relation]) -> Array:
    """Frame that each task's motion is relative to and expressed in: the part or the world, shape (tasks, 4, 4)."""
    return np.stack([state.X_WP if task.relative_to is Frame.PART else np.eye(4) for task in tasks])


def cooperation_jacobian(state: CellState, p_WT: Array, signs: Array, *, X_WR: Array | None = None) -> Array:
    r"""Stack the relative Jacobians of all operators ([Ribeiro2010]_ Eqs. 3.56, 4.33).

    .. math:: {}_P V_{PT_i} = \begin{bmatrix} R & -R S(p_i) \\ 0 & R \end{bmatrix}
              \left( \$_{T_i} \dot q_i - \$_P \dot q_p \right), \quad R = R_{WP}^T

    Both twists are taken at the world origin, so their difference is the relative twist; the matrix in front moves it
    to the tool tip ``p_i`` and expresses it in P. The thesis prints both robots with a plus sign: there the minus of
    the positioner hides in the orientation of its screws.

    Args:
        state: Kinematics of the cell.
        p_WT: Tool tips in the world, shape (tasks, 3), in [m].
        signs: Sign of each joint in each task, shape (tasks, nq).
        X_WR: Frame that stands for P in each task, shape (tasks, 4, 4), see `reference_frames`; P itself when None.

    Returns:
        Linear part in [m] before angular part in [rad], expressed in P, shape (tasks, 6, nq).
    """
    R = state.X_WP[:3, :3].T if X_WR is None else np.swapaxes(X_WR[:, :3, :3], 1, 2)
    to_tip = np.zeros((len(p_WT), 6, 6))
    to_tip[:, :3, :3] = to_tip[:, 3:, 3:] = R
    to_tip[:, :3, 3:] = -R @ skew(p_WT)
    jacobian: Array = to_tip @ (state.screws_W * signs[:, None, :])
    return jacobian


def constraint_rows(task: Relation, X_PT: Array) -> Array:
    """Rows that pick what a task constrains from a relative twist, shape (N, m, 6) for N desired poses.

    Components named by ``axes`` are taken in P. With free spin the two rotations across the desired tool axis are
    taken instead of the three about the axes of P.
    """
    rows = np.broadcast_to(np.eye(6)[list(task.axes)], (len(X_PT), len(task.axes), 6)).copy()
    if not task.is_spin_free:
        return rows
    linear = rows[:, [axis < 3 for axis in task.axes]]
    across = np.zeros((len(X_PT), 2, 6))
    across[:, :, 3:] = np.swapaxes(X_PT[:, :3, :2], 1, 2)
    return np.concatenate([linear, across], axis=1)


def pose_errors(X_PT_desired: Array, X_PT: Array, is_spin_free: Sequence[bool]) -> Array:
    """Errors of tool poses on the part, in P: desired minus actual position, then rotation vector of ``R_d R^T``.

    With free spin the rotation is the smallest one that lays the tool axis on the desired one.

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
