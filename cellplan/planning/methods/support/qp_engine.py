"""The door to daqp, an exact active-set solver: the point nearest to the origin between bounds."""

from typing import Final

import daqp
import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array

BOUND_TOLERANCE: Final = 1e-12  # [-] by which the engine may miss a bound, for rows of length 1
NOTHING: Final = 1e-14  # [-] below which a pivot is taken for zero: rows may differ by 1e-10 of their squared length
PROOF_TOLERANCE: Final = 1e-7  # [-] of row times point, beyond which the answer is not believed
SOLVED: Final = 1  # exit flag of daqp
TROUBLES: Final = {-1: "contradictory bounds", -2: "cycling", -3: "no bounded solution", -4: "too many iterations"}


def nearest_to_origin(A: Array, *, lower: Array, upper: Array) -> Array:
    r"""The ``y`` nearest to the origin, the least of ``1/2 |y|^2``, under ``lower <= A y <= upper``.

    A strictly convex program has one solution only, so the answer does not depend on how the engine goes about it.

    Args:
        A: Rows, shape (k, n).
        lower: Lower bounds, shape (k,); may be -inf.
        upper: Upper bounds, shape (k,); may be +inf.

    Returns:
        The nearest point, shape (n,).

    Raises:
        NoSolutionError: The engine gave up, or its answer breaks the bounds.
    """
    n = A.shape[1]
    y, _, flag, _ = daqp.solve(
        np.eye(n),
        np.zeros(n),
        np.ascontiguousarray(A),
        np.ascontiguousarray(upper),
        np.ascontiguousarray(lower),
        np.zeros(len(A), dtype=np.intc),
        primal_tol=BOUND_TOLERANCE,
        sing_tol=NOTHING,
        zero_tol=NOTHING,
    )
    if flag != SOLVED:
        raise NoSolutionError(f"the quadratic program has no solution ({TROUBLES.get(flag, f'exit flag {flag}')})")
    rows = A @ y
    excess = np.maximum(lower - rows, rows - upper)
    size = np.linalg.norm(A, axis=1) * (1.0 + np.linalg.norm(y))
    if not np.all(excess <= PROOF_TOLERANCE * size):  # also for what is not a number
        raise NoSolutionError("the quadratic program was not solved: its answer breaks the bounds")
    return np.asarray(y)
