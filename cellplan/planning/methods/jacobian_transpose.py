"""Jacobian transpose: the pose errors pull at the joints like forces, and no matrix is inverted."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

SHORTENED: Final = 0.9  # of the step after which the error would be smallest: a little less ends the zigzag
LEFT_OPEN: Final = 1e-3  # share of the desired correction below which it counts as made
LONGEST_PULL: Final = 1.0 / 0.02**2  # sum of all steps: what has a smaller singular value than 0.02 is not followed
MOST_STEPS: Final = 200  # of the law within one look; four robots need about ninety
LONGEST_MOVE: Final = 0.1  # [rad] or [m] of a joint between two evaluations: the first order holds to about a hundredth
MOST_LOOKS: Final = 8  # within one sample; what is left is left to the next


def jacobian_transpose(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    r"""Follow the errors alone, in steps that cannot overshoot ([Nicolato2007]_ Eq. 2.18, in the metric of W).

    .. math:: \dot q = W^{-1} J^T K e

    One step of that length per sample swings up where ``K dt`` times the largest eigenvalue of ``J W^-1 J^T`` is
    above 2, and does next to nothing where it is small. So each sample takes the step of the law again and again, each
    of its own length ``alpha``, until the error of the coming sample is smaller by the share ``K dt`` that the gain
    asks for, or all of it where ``K dt`` is above 1:

    .. math:: \Delta q \leftarrow \Delta q + \alpha W^{-1} J^T r, \qquad r \leftarrow r - \alpha J W^{-1} J^T r

    With the single step ``alpha = 1`` from ``r = K e dt`` this is the law as printed. The law knows no velocity of the
    path: a tool lags behind by about ``(1 / K - dt)`` times its speed. ``StepResult.iterations`` counts the steps.
    """

    def advance(k: int, q: Array) -> StepResult:
        tasks = problem.first_order(k + 1, q)
        goal = max(1.0 - problem.gain * problem.step(k), 0.0) * tasks.error
        steps = 0
        for look in range(MOST_LOOKS):
            if look:
                tasks = problem.first_order(k + 1, q)
            move, taken = pulled(tasks.J, tasks.error - goal, tasks.weights)
            steps += taken
            longest = float(np.max(np.abs(move), initial=0.0))
            q = q + move * min(1.0, LONGEST_MOVE / longest) if longest > 0.0 else q
            if longest <= LONGEST_MOVE:
                break
        return StepResult(q=q, iterations=steps)

    return advance


def pulled(J: Array, desired: Array, weights: Array) -> tuple[Array, int]:
    r"""Joint motion that repeated steps of the transpose make of a desired motion of the tools.

    The step that makes what is left smallest is ``alpha = <r, A r> / |A r|^2`` with ``A = J W^-1 J^T``; any step
    shorter than twice that makes it smaller. The sum of all steps is bounded, and so is the motion: it stays below
    about a hundred times what is desired, however near a singularity is.

    Args:
        J: Task rows, shape (m, nq).
        desired: Reference motion of the tools, shape (m,).
        weights: Diagonal of W, shape (nq,).

    Returns:
        Joint motion, shape (nq,), and the number of steps.
    """
    JW = (J / weights).T
    A = J @ JW
    r, pull, open_ = desired, np.zeros_like(desired), LONGEST_PULL
    enough = LEFT_OPEN * float(np.linalg.norm(desired))
    for step in range(MOST_STEPS):
        Ar = A @ r
        square = float(Ar @ Ar)
        if float(np.sqrt(r @ r)) <= enough or square == 0.0 or open_ <= 0.0:
            return JW @ pull, step
        alpha = min(SHORTENED * float(r @ Ar) / square, open_)
        pull, r, open_ = pull + alpha * r, r - alpha * Ar, open_ - alpha
    return JW @ pull, MOST_STEPS
