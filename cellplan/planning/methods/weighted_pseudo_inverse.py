"""Weighted, damped pseudo-inverse: the smallest weighted joint velocities that give the desired tool twists."""

from collections.abc import Callable
from typing import Final

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.planning.tracking.problem import StepResult, TrackingProblem
from cellplan.planning.tracking.weighted_inverse import LARGEST_DAMPING, WeightedInverse

SINGULAR_REGION: Final = 0.02  # smallest singular value below which damping sets in when it is left to the program


def weighted_pseudo_inverse(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Integrate by Euler's method with pose-error feedback ([Ribeiro2010]_ Fig. 23, Eq. D.1).

    .. math:: \dot q = J^\# (\dot x_d + K e) + (I - J^\# J) \dot q_0, \qquad q(t + dt) = q(t) + \dot q \, dt

    so that the error obeys ``e_dot + K e = 0`` (Eq. D.7).
    """

    def advance(k: int, q: Array) -> StepResult:
        tasks = problem.first_order(k, q)
        inverse = WeightedInverse(tasks.J, tasks.weights)
        velocities = damped_velocities(inverse, tasks.twist + problem.gain * tasks.error, problem.damping)
        if tasks.secondary is not None:
            velocities += tasks.bounded(inverse.null_space_projection(tasks.secondary), velocities=velocities)
        return StepResult(q=q + velocities * problem.step(k))

    return advance


def damped_velocities(inverse: WeightedInverse, xdot: Array, damping: float | None) -> Array:
    """Joint velocities with the damping of [Nicolato2007]_ Eq. 2.12.

    With ``s`` the smallest singular value of ``J W^-1/2`` and ``eps`` the singular region,
    ``lambda^2 = (1 - (s / eps)^2) lambda_max^2`` below ``eps`` and 0 above it, so damping is nil away from
    singularities.

    Args:
        xdot: Reference twist components with error feedback, shape (m,).
        damping: Largest damping factor; None for the program's choice, 0 for none.

    Returns:
        Joint velocities in [rad/s] or [m/s], shape (nq,).
    """
    if damping == 0.0 and inverse.is_singular:
        raise NoSolutionError("the cooperation Jacobian is singular and solver.damping is 0: allow damping (auto)")
    largest = LARGEST_DAMPING if damping is None else damping
    shortfall = 1.0 - inverse.smallest**2 / SINGULAR_REGION**2
    return inverse.velocities(xdot, max(shortfall, 0.0) * largest**2)
