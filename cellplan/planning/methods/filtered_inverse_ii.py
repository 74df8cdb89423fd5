"""Filtered inverse, law II: the filtered inverse enters twice, so that the feedback never pushes the wrong way."""

from collections.abc import Callable

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.support.filtered_jacobian import FilteredMotion
from cellplan.planning.tracking.problem import StepResult, TrackingProblem


def filtered_inverse_ii(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Joint velocities ``u_II = Theta Theta^T J^T v`` ([Vargas2012]_ Eq. 36), ``v`` the desired twist with feedback.

    ``J u_II = P P^T v`` with ``P = J Theta`` (Eq. 37): however bad ``Theta`` is, the error is never driven up.
    """

    def law(theta: Array, J: Array) -> Array:
        return theta @ (theta.T @ J.T)

    return FilteredMotion(problem, law).advance
