"""Perturbations: points near a given one from which another local optimum may be reached."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.programs.problem import Point, Problem

DRAWS: Final = 40  # [-] until one has a motion


def perturbed(
    problem: Problem, x: Array, start: Array, rng: np.random.Generator, *, size: float = 1.0, draws: int = DRAWS
) -> Point | None:
    """A random point near a given one, drawn again until all tools can follow their paths; None where none can.

    Args:
        x: The variables, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).
        size: Standard deviation of each variable in its usual steps.
    """
    for _ in range(draws):
        candidate = x + size * problem.scale * rng.normal(size=len(x))
        point = problem.evaluate(np.clip(candidate, problem.lower, problem.upper), start)
        if point is not None:
            return point
    return None
