"""Weighted, damped pseudo-inverse: the smallest weighted joint speeds that give the wanted tool twists."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.planning.tracking_problem import TrackingProblem

SINGULAR_REGION: Final = 0.02  # smallest singular value below which damping sets in when it is left to the program
LARGEST_DAMPING: Final = 0.02  # damping factor at the singularity when it is left to the program
ROUNDING: Final = 1e-12  # eigenvalues of J W^-1 J^T below this share of the largest are rounding: rank is lost


def weighted_pseudo_inverse(problem: TrackingProblem) -> Callable[[int, Array], Array]:
    r"""Integrate by Euler's method with pose-error feedback ([Ribeiro2010]_ Fig. 23, Eq. D.1).

    .. math:: \dot q = J^\# (\dot x_d + K e), \qquad q(t + dt) = q(t) + \dot q \, dt

    so that the error obeys ``e_dot + K e = 0`` (Eq. D.7).
    """

    def advance(k: int, q: Array) -> Array:
        tasks = problem.first_order(k, q)
        wanted = tasks.twist + problem.gain * tasks.error
        return q + weighted_speeds(tasks.J, wanted, problem.weights, problem.damping) * problem.step(k)

    return advance


def weighted_speeds(J: Array, xdot: Array, weights: Array, damping: float | None) -> Array:
    r"""Joint speeds ([Ribeiro2010]_ Eqs. D.28-D.30 with the damping of [Nicolato2007]_ Eq. 2.12).

    .. math:: \dot q = W^{-1} J^T (J W^{-1} J^T + \lambda^2 I)^{-1} \dot x

    With ``s`` the smallest singular value of ``J W^-1/2`` and ``eps`` the singular region,
    ``lambda^2 = (1 - (s / eps)^2) lambda_max^2`` below ``eps`` and 0 above it, so damping is nil away from
    singularities.

    Args:
        J: Constrained rows of the cooperation Jacobian, shape (m, nq).
        xdot: Wanted twist components with error feedback, shape (m,).
        weights: Positive joint weights, the diagonal of W, shape (nq,).
        damping: Largest damping factor; None for the program's choice, 0 for none.

    Returns:
        Joint speeds in [rad/s] or [m/s], shape (nq,).

    Raises:
        NoSolutionError: Without damping, at a singularity.
    """
    JW = J / weights
    s_squared, U = np.linalg.eigh(JW @ J.T)
    if damping == 0.0 and s_squared[0] <= ROUNDING * s_squared[-1]:
        raise NoSolutionError("the cooperation Jacobian is singular and solver.damping is 0: allow damping (auto)")
    largest = LARGEST_DAMPING if damping is None else damping
    shortfall = 1.0 - max(s_squared[0], 0.0) / SINGULAR_REGION**2
    lambda_squared = max(shortfall, 0.0) * largest**2
    speeds: Array = JW.T @ (U @ ((U.T @ xdot) / (s_squared + lambda_squared)))
    return speeds
