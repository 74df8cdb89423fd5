"""Perturbations of a path: smooth and small, so that the operators can still follow."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.programs.perturb import DRAWS
from cellplan.search.programs.problem import Point
from cellplan.search.spline_path.problem import PathProblem

WAVES: Final = 4  # cosines along the path, from the constant to one and a half periods
SHARE: Final = 0.5  # of a usual step, of the constant; of each further wave less
SMALLER: Final = 0.9  # factor of the next draw where a tool could not follow


def perturbed_path(
    problem: PathProblem, x: Array, start: Array, rng: np.random.Generator, *, size: float
) -> Point | None:
    """A random point near a given one, drawn again and smaller until all tools can follow their paths, or None.

    Args:
        x: The variables, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).
        size: Standard deviation in usual steps.
    """
    origin = problem.evaluate(x, start)
    if origin is None:
        return None
    rows, columns = problem.path.given.coefficients.shape
    order = np.arange(WAVES)
    waves = np.cos(np.pi * np.linspace(0.0, 1.0, rows)[:, None] * order) * SHARE / (1.0 + order)
    for _ in range(DRAWS):
        path = (waves @ rng.normal(size=(WAVES, columns))).ravel()
        step = np.concatenate([path, rng.normal(size=len(x) - len(path))])
        point = problem.evaluate(np.clip(x + size * problem.scale * step, problem.lower, problem.upper), start, origin)
        if point is not None:
            return point
        size *= SMALLER
    return None
