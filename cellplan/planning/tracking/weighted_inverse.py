"""Weighted inverse of the task rows: smallest weighted joint speeds, and the motion in the null space of the tasks."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array

LARGEST_DAMPING: Final = 0.02  # [-] damping factor at a singularity where the cell states none
ROUNDING: Final = 1e-12  # eigenvalues of J W^-1 J^T below this share of the largest are rounding: rank is lost


class WeightedInverse:
    r"""Inverse of ``J`` in the metric of the joint weights, from the eigenvalues of ``J W^-1 J^T``.

    Attributes:
        smallest: Smallest singular value of ``J W^-1/2``.
        largest: Largest singular value of ``J W^-1/2``.
        manipulability: Product of these singular values: ``sqrt(det(J W^-1 J^T))``.
        is_singular: Whether a row is lost to rounding.
    """

    def __init__(self, J: Array, weights: Array) -> None:
        """Decompose once, with rows of shape (m, nq) and positive weights, the diagonal of W, shape (nq,)."""
        self._J = J
        self._JW = J / weights
        self._s_squared, self._U = np.linalg.eigh(self._JW @ J.T)
        self.smallest = float(np.sqrt(max(self._s_squared[0], 0.0)))
        self.largest = float(np.sqrt(max(self._s_squared[-1], 0.0)))
        self.manipulability = float(np.prod(np.sqrt(np.maximum(self._s_squared, 0.0))))
        self.is_singular = bool(self._s_squared[0] <= ROUNDING * self._s_squared[-1])

    def velocities(self, xdot: Array, lambda_squared: float) -> Array:
        r"""Joint velocities ([Ribeiro2010]_ Eqs. D.28-D.30, damped as in [Nicolato2007]_ Eq. 2.11).

        .. math:: \dot q = W^{-1} J^T (J W^{-1} J^T + \lambda^2 I)^{-1} \dot x

        Args:
            xdot: Reference twist components, shape (m,).
            lambda_squared: Square of the damping factor; above 0 where a row is lost.

        Returns:
            Velocities in [rad/s] or [m/s], shape (nq,).
        """
        return self._JW.T @ (self._U @ ((self._U.T @ xdot) / (self._s_squared + lambda_squared)))

    def null_space_projection(self, velocities: Array) -> Array:
        r"""What of given joint velocities moves no task ([Ribeiro2010]_ Eq. D.43), projected in the metric of W.

        .. math:: (I - J^\# J) \dot q_0

        Damping has no place here: it would let the speeds leak into the tasks. Lost rows count as no task.

        Args:
            velocities: Any joint velocities, shape (nq,).
        """
        significant = self._s_squared > ROUNDING * self._s_squared[-1]
        U = self._U[:, significant]
        return velocities - self._JW.T @ (U @ ((U.T @ (self._J @ velocities)) / self._s_squared[significant]))
