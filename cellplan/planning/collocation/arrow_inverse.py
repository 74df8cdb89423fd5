"""Inverse of the arrow-shaped cooperation Jacobian, at thousands of configurations at once.

Only the columns of the positioner couple the operators, so that the work grows linearly with their number. As in
`kinematics.batched` the last axis of every array is that of the configurations.
"""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags

REGULAR: Final = 1e-10  # share of the largest diagonal entry that keeps a block invertible where its rank is lost
REFINEMENTS: Final = 2  # [-] of the multipliers: each leaves about 1e-6 of their error, rounding over ``REGULAR``


class ArrowInverse:
    r"""Weighted pseudo-inverse of ``J = [diag(A_i), C]`` without ever forming it ([Ribeiro2010]_ Eqs. 4.33, D.28).

    With ``D_i = A_i W_i^{-1} A_i^T`` and ``S = W_c + \sum C_i^T D_i^{-1} C_i`` (Woodbury)

    .. math:: \dot q_c = S^{-1} \sum_i C_i^T D_i^{-1} b_i, \qquad
              \dot q_i = W_i^{-1} A_i^T D_i^{-1} (b_i - C_i \dot q_c)

    is ``J^# b`` for ``J^# = W^{-1} J^T (J W^{-1} J^T)^{-1}``. A trace of damping keeps the blocks of operators
    invertible that cannot do their task alone; whoever calls corrects what it costs, as Newton's method does.
    """

    def __init__(
        self,
        A: Array,
        C: Array,
        *,
        mobility: Array,
        coupling_weights: Array,
        idle: Array,
        is_given: Flags | None = None,
    ) -> None:
        """Factorise.

        Args:
            A: Columns of each task's own robot, shape (6, n, tasks, batch).
            C: Columns of the joints that all tasks share, shape (6, m, tasks, batch).
            mobility: Inverse weights of the own joints, 0 for those that may not move, shape (n, tasks, 1 or batch).
            coupling_weights: Weights of the shared joints, shape (m, 1 or batch); columns of those that may not move
                are 0.
            idle: What is added to the diagonal of each block: 1 for components that a task leaves open, whose rows are
                0, and the square of a damping factor for the others, shape (6, tasks, 1).
            is_given: Which shared joints have a given motion, shape (m,); they move the tools but never follow them.
        """
        self._A, self._C = A, C
        if is_given is not None and is_given.any():
            C = np.where(is_given[:, None, None], 0.0, C)
        self._following_C, self._coupling_weights = C, coupling_weights
        self._mobile_A = A * mobility
        D = np.einsum("intb,jntb->ijtb", self._mobile_A, A)
        scale = np.einsum("iitb->tb", D) + np.einsum("imtb,imtb,mb->tb", C, C, 1.0 / coupling_weights)
        diagonal = np.einsum("iitb->itb", D)
        diagonal += REGULAR * scale + idle
        self._D_factor, self._Y = eliminated(D, C)
        S = np.einsum("ijtb,iktb->jkb", self._Y, self._Y)
        np.einsum("jjb->jb", S)[:] += coupling_weights
        self._S_factor, _ = eliminated(S, S[:, :0])

    def velocities(self, b: Array) -> tuple[Array, Array]:
        """Smallest weighted joint velocities for twists, shape (6, tasks, batch).

        Returns:
            Velocities of the own joints, shape (n, tasks, batch), and of the shared ones, shape (m, batch).
        """
        y, shared = self._multipliers(b)
        return np.einsum("intb,itb->ntb", self._mobile_A, y), shared

    def refined_velocities(self, b: Array) -> tuple[Array, Array]:
        r"""`speeds` to the last digits, even where blocks are singular: what is lost there differs by processor.

        The multipliers ``y`` of :math:`\dot q = W^{-1} J^T y` are refined by the twists that these very speeds leave.
        """
        y, _ = self._multipliers(b)
        for _ in range(REFINEMENTS):
            y += self._multipliers(b - self.twists(*self._moved_by(y)))[0]
        return self._moved_by(y)

    def _moved_by(self, y: Array) -> tuple[Array, Array]:
        """Velocities ``W^-1 J^T y`` of the own joints and of the shared ones, for multipliers (6, tasks, batch)."""
        shared = np.einsum("imtb,itb->mb", self._following_C, y) / self._coupling_weights
        return np.einsum("intb,itb->ntb", self._mobile_A, y), shared

    def _multipliers(self, b: Array) -> tuple[Array, Array]:
        """``(J W^-1 J^T)^-1 b``, shape (6, tasks, batch), and the speeds of the shared joints, shape (m, batch)."""
        u = np.einsum("ijtb,jtb->itb", self._D_factor, b)
        g = np.einsum("ijb,jb->ib", self._S_factor, np.einsum("imtb,itb->mb", self._Y, u))
        shared = np.einsum("jib,jb->ib", self._S_factor, g)
        u -= np.einsum("imtb,mb->itb", self._Y, shared)
        return np.einsum("jitb,jtb->itb", self._D_factor, u), shared

    def twists(self, local: Array, shared: Array) -> Array:
        """Tool twists that joint velocities give, ``J q_dot``, shape (6, tasks, batch)."""
        return np.einsum("intb,ntb->itb", self._A, local) + np.einsum("imtb,mb->itb", self._C, shared)


def eliminated(M: Array, B: Array) -> tuple[Array, Array]:
    """Inverse ``F`` of the lower Cholesky factors of symmetric positive matrices, and ``F B``.

    Gauss's elimination on ``[M, B, I]`` with the pivots shared between both sides: ``M^-1 = F^T F``. Of the unit matrix
    row ``j`` has come to the columns up to ``j`` only. Matrices that are not positive definite give NaN.

    Args:
        M: The matrices, shape (k, k, ...).
        B: Further columns, shape (k, m, ...).

    Returns:
        ``F``, shape (k, k, ...), and ``F B``, shape (k, m, ...).
    """
    size, width = len(M), B.shape[1]
    unit = np.broadcast_to(np.eye(size).reshape(size, size, *[1] * (M.ndim - 2)), M.shape)
    rows = np.concatenate([M, B, unit], axis=1)
    for j in range(size):
        filled = slice(j + 1, size + width + j + 1)
        rows[j, j : filled.stop] /= np.sqrt(rows[j, j])
        rows[j + 1 :, filled] -= rows[j, j + 1 : size, None] * rows[j, None, filled]
    return rows[:, size + width :], rows[:, size : size + width]
