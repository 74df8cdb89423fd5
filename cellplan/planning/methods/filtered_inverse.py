"""Filtered inverse, law I: an inverse that follows the Jacobian as a filter does multiplies the desired twist."""

from collections.abc import Callable

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.support.filtered_jacobian import FilteredMotion
from cellplan.planning.tracking.problem import StepResult, TrackingProblem


def filtered_inverse(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Joint velocities ``u_I = Theta v`` ([Vargas2012]_ Eq. 35), with ``v`` the desired twist and its feedback."""

    def law(theta: Array, _J: Array) -> Array:
        return theta

    return FilteredMotion(problem, law).advance
