"""Manipulability of the tasks: how far the joints are from a configuration in which some tool motion is lost."""

from collections.abc import Sequence

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.kinematics.pinocchio_model import CellState, CombinedModel
from cellplan.planning.tracking.weighted_inverse import ROUNDING


class ManipulabilityGradient:
    """Gradient of the logarithm of the manipulability over the joints of one cell."""

    def __init__(
        self, model: CombinedModel, operators: Sequence[int], holder: int | None, *, on_part: Array | None = None
    ) -> None:
        """Note who carries what.

        Args:
            operators: Index of each task's robot.
            holder: Index of the robot that carries the part; None when it is fixed.
            on_part: 1 where a task's rows stand in the frame of the part, 0 where in the world, shape (tasks,); all 1
                when None.
        """
        self._model, self._operators = model, list(operators)
        carries = model.carries_flange.astype(float)
        self._moves_tool = carries[self._operators]
        self._on_part = np.ones(len(self._operators)) if on_part is None else on_part
        self._moves_part = np.zeros(carries.shape[1]) if holder is None else carries[holder]

    def at(self, screws_W: Array, state: CellState, *, J: Array, picks: Sequence[Array], signs: Array) -> Array:
        r"""Gradient of ``log w`` with ``w = sqrt(det(J J^T))`` ([Ribeiro2010]_ Eq. D.45), shape (..., nq), in [1/rad].

        .. math:: \partial \log w / \partial q_m = \mathrm{tr}(J^\# \, \partial J / \partial q_m)

        ``dJ`` has three parts: the screws move with the joints before them, by their Lie brackets; the tool tips move;
        the part, in whose frame the rows stand, turns. Where a row is lost, or there are more rows than joints, w is
        zero and has no gradient: the result is zero.

        Args:
            screws_W: Of all axes as ``LinkState`` has them, shape (..., 6, axes); the axes before are the batch.
            state: Kinematics there, each array with the same axes before.
            J: Task rows, shape (..., m, nq).
            picks: Rows that pick what each task constrains, shape (..., m_i, 6) each.
            signs: Sign of each joint in each task, 0 for joints that may not move, shape (tasks, nq).
        """
        s_squared, U = np.linalg.eigh(J @ np.swapaxes(J, -1, -2))
        is_regular = s_squared[..., 0] > ROUNDING * s_squared[..., -1]
        s_squared = np.where(is_regular[..., None], s_squared, 1.0)
        G = U @ ((np.swapaxes(U, -1, -2) @ J) / s_squared[..., None])  # derivative of log w by the entries of J
        parts = np.split(G, np.cumsum([pick.shape[-2] for pick in picks])[:-1], axis=-2)
        blocks = np.stack([np.swapaxes(pick, -1, -2) @ rows for pick, rows in zip(picks, parts, strict=True)], axis=-3)
        R = np.where(self._on_part[:, None, None] > 0.0, state.X_WP[..., None, :3, :3], np.eye(3))
        p = state.X_WT[..., self._operators, :, :][..., :3, 3, None]
        force, torque = R @ blocks[..., :3, :], R @ blocks[..., 3:, :]  # in W, at the tool tips, (..., tasks, 3, nq)
        linear, angular = state.screws_W[..., None, :3, :], state.screws_W[..., None, 3:, :]
        omega = angular * signs[:, None]
        at_tip = linear * signs[:, None] + np.cross(omega, p, axis=-2)
        turned = (np.cross(at_tip, force, axis=-2) + np.cross(omega, torque, axis=-2)).sum(axis=-1)
        turning = self._on_part @ turned
        shifting = np.cross(force, omega, axis=-2).sum(axis=-1)  # by the motion of each tool tip
        tips = linear + np.cross(angular, p, axis=-2)
        on_screws = np.concatenate([force, torque + np.cross(p, force, axis=-2)], axis=-2) * signs[:, None]
        by_tips = np.sum((shifting[..., None, :] @ tips)[..., 0, :] * self._moves_tool, axis=-2)
        by_part = self._moves_part * (turning[..., None, :] @ angular[..., 0, :, :])[..., 0, :]
        gradient = self._by_screws(screws_W, on_screws.sum(axis=-3)) + by_tips - by_part
        return np.where(is_regular[..., None], gradient, 0.0)

    def _by_screws(self, screws_W: Array, g: Array) -> Array:
        r"""What the motion of the screws adds: gradient of ``sum_j g_j . $_j`` for fixed ``g``, shape (..., nq).

        .. math:: \partial \$_a / \partial q_b = [\$_b, \$_a] = (\omega_b \times l_a + l_b \times \omega_a,
                  \; \omega_b \times \omega_a)

        for every axis b that carries the axis a.
        """
        linear, angular = screws_W[..., :3, :], screws_W[..., 3:, :]
        force, torque = np.split(self._model.to_flange(g), 2, axis=-2)
        by_turn = np.cross(linear, force, axis=-2) + np.cross(angular, torque, axis=-2)
        by_shift = np.cross(angular, force, axis=-2)
        carried = self._model.carries_link  # an axis carries itself too: its bracket with itself is zero
        change = np.sum(angular * (by_turn @ carried) + linear * (by_shift @ carried), axis=-2)
        return self._model.along_joints(change)
