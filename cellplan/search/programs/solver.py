"""The solver of linear programs: daqp with a small proximal term, which makes the answer unique."""

from dataclasses import dataclass
from typing import Final

import daqp
import numpy as np

from cellplan.geometry.arrays import Array

SOLVED: Final = 1  # exit flag of daqp
UNBOUNDED: Final = 1e30  # [-] no bound
PROVED: Final = 1e-6  # [-] by which an answer may miss a row of length 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSolution:
    """The least point of a program."""

    at: Array  # the point, shape (n,)
    multipliers: Array  # how fast the least value falls as a row's bound rises, shape (M,), none negative
    of_bounds: Array  # the same of the bounds of the variables, negative at lower ones, shape (n,)


def least(
    cost: Array, weights: Array, rows: Array, highest: Array, bounds: tuple[Array, Array]
) -> ProgramSolution | None:
    """Minimise ``cost x + 1/2 sum weights x^2`` under ``rows x <= highest`` and bounds.

    Args:
        cost: Shape (n,).
        weights: Positive, shape (n,).
        rows: Shape (M, n).
        highest: Shape (M,).
        bounds: Lower and upper ones, shape (n,) each.

    Returns:
        The point; None where the solver finds none.
    """
    lengths = np.linalg.norm(rows, axis=1)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    scaled, top = np.ascontiguousarray(rows / lengths[:, None]), highest / lengths
    lower, upper = bounds
    at, _, flag, info = daqp.solve(
        np.diag(weights),
        np.ascontiguousarray(cost),
        scaled,
        np.concatenate([upper, top]),
        np.concatenate([lower, np.full(len(top), -UNBOUNDED)]),
        np.zeros(len(cost) + len(top), dtype=np.intc),
    )
    solution = np.asarray(at)
    if flag != SOLVED or not np.all(scaled @ solution - top <= PROVED * (1.0 + np.linalg.norm(solution))):
        return None
    multipliers = np.asarray(info["lam"])
    return ProgramSolution(
        at=solution, multipliers=multipliers[len(cost) :] / lengths, of_bounds=multipliers[: len(cost)]
    )
