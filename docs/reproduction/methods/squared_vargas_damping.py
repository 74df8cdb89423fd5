"""Damped least squares with ``lambda^2 I``: the other reading of Vargas, Leite and Costa 2012, Eqs. 9 and 10.

A resolution method of its own: the folder of this file is added to those of ``cellplan.planning.methods``.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cellplan.planning.tracking.problem import StepResult, TrackingProblem

Array = NDArray[np.float64]


def squared_vargas_damping(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    """Euler's steps of ``qdot = J^T (J J^T + lambda^2 I)^-1 (xdot_d + K e)``, with equal joint weights.

    lambda is ``lambda_0 (1 - w / w_0)^2`` below ``w_0`` and 0 above it, w the square root of ``det(J J^T)``.
    """
    solver = problem.cell.solver
    largest, region = problem.damping, solver.damped_least_squares.region
    if largest is None:
        raise ValueError("expected a stated damping")

    def advance(k: int, q: Array) -> StepResult:
        tasks = problem.first_order(k, q)
        product = tasks.J @ tasks.J.T
        w = np.sqrt(max(np.linalg.det(product), 0.0))
        damping = largest * max(1.0 - w / region, 0.0) ** 2
        desired = tasks.twist + problem.gain * tasks.error
        velocity = tasks.J.T @ np.linalg.solve(product + damping**2 * np.eye(len(product)), desired)
        return StepResult(q=q + velocity * problem.step(k))

    return advance
