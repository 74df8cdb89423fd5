"""Damped least squares: near a singularity, part of the desired twist is given up for moderate joint velocities."""

from collections.abc import Callable
from typing import Final

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.settings.solver import DampedLeastSquaresEntry
from cellplan.planning.tracking.problem import StepResult, TrackingProblem
from cellplan.planning.tracking.weighted_inverse import LARGEST_DAMPING, ROUNDING, WeightedInverse

FULL_GAIN: Final = 4.0  # times the region: from here on the feedback has its whole gain (Nicolato Eq. 2.14)


def damped_least_squares(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Integrate damped least-squares speeds by Euler's method ([Nicolato2007]_ Eqs. 2.10-2.14).

    .. math:: \min_{\dot q} \; |J \dot q - v|^2 + \lambda^2 \dot q^T W \dot q,
              \qquad v = \dot x_d + \varrho K e

    that is ``qdot = W^-1 J^T (J W^-1 J^T + lambda^2 I)^-1 v``: Eq. 2.11 in the metric of the joint weights. Secondary
    goals follow in the null space of the undamped rows, in which they move no tool.
    """
    settings = problem.cell.solver.damped_least_squares

    def advance(k: int, q: Array) -> StepResult:
        tasks = problem.first_order(k, q)
        inverse = WeightedInverse(tasks.J, tasks.weights)
        measure = nearness(inverse, settings)
        lambda_squared = squared_damping(measure, settings, largest=problem.damping)
        _refuse_undamped(inverse, lambda_squared)
        share = gain_share(measure, settings.region) if settings.shape_gain else 1.0
        velocities = inverse.velocities(tasks.twist + share * problem.gain * tasks.error, lambda_squared)
        if tasks.secondary is not None:
            velocities += tasks.bounded(inverse.null_space_projection(tasks.secondary), velocities=velocities)
        return StepResult(q=q + velocities * problem.step(k))

    return advance


def nearness(inverse: WeightedInverse, settings: DampedLeastSquaresEntry) -> float:
    """What tells how near a singularity is: smallest singular value or manipulability, both of ``J W^-1/2``."""
    return inverse.smallest if settings.measure == "singular_value" else inverse.manipulability


def squared_damping(measure: float, settings: DampedLeastSquaresEntry, *, largest: float | None) -> float:
    r"""What is added to ``J W^-1 J^T``, the squared damping factor ([Nicolato2007]_ Eq. 2.12, [Vargas2012]_ Eq. 9).

    .. math:: \lambda^2 = (1 - (\sigma / \varepsilon)^2) \lambda_{max}^2 \quad (\sigma < \varepsilon), \qquad
              \lambda^2 = \lambda_0 (1 - w / w_0)^2 \quad (w < w_0)

    and 0 beyond. Vargas adds ``lambda I``: his lambda is the square of the factor that it is elsewhere. He prints ``w``
    as ``det(J J^T)``; his figures fit the usual square root of it.

    Args:
        measure: ``sigma`` or ``w``, at least 0.
        settings: Which of the two it is, and its region ``epsilon`` or ``w0``.
        largest: ``lambda_max`` or ``lambda_0``. None stands for ``epsilon`` with the singular value, so that no
            direction is ever driven harder than at the border of the region; for the square of ``LARGEST_DAMPING``
            with ``w``.
    """
    ratio = measure / settings.region
    if ratio >= 1.0:
        return 0.0
    if settings.measure == "singular_value":
        return (1.0 - ratio**2) * (settings.region if largest is None else largest) ** 2
    return (1.0 - ratio) ** 2 * (LARGEST_DAMPING**2 if largest is None else largest)


def gain_share(measure: float, region: float) -> float:
    r"""Share of the feedback gain that is left near a singularity ([Nicolato2007]_ Eq. 2.14).

    .. math:: \varrho = (\sigma - \varepsilon)^2 / (3 \varepsilon)^2 \quad (\varepsilon < \sigma < 4 \varepsilon)

    0 inside the region and 1 beyond four times the region.
    """
    ratio = min(max(measure / region, 1.0), FULL_GAIN)
    return ((ratio - 1.0) / (FULL_GAIN - 1.0)) ** 2


def _refuse_undamped(inverse: WeightedInverse, lambda_squared: float) -> None:
    """Stop where a row is lost and the damping is too small to make up for it."""
    if inverse.is_singular and lambda_squared <= ROUNDING * inverse.largest**2:
        raise NoSolutionError(
            "the cooperation Jacobian is singular and not damped: raise solver.damping (or auto) or "
            "solver.damped_least_squares.region"
        )
