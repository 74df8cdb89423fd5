"""Algorithm 1 of Nicolato 2007 as printed: best-first moves of single joints, without momentum and extrapolation.

A resolution method of its own: the folder of this file is added to those of ``cellplan.planning.methods``.
"""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.planning.methods.support.joint_line import joint_lines
from cellplan.planning.methods.support.search_cost import SearchCost
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

Array = NDArray[np.float64]

MOST_MOVES: Final = 20_000  # [-] of one sample


def printed_best_first(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    """Of all open joints the one whose best move leaves the least cost makes that move and is closed.

    When all joints are closed, all are opened again; the search ends when the root of the cost is within the tolerance.
    Its ``iterations`` are the moves.
    """
    target = problem.cell.solver.search.tolerance_mm.si**2
    cost = SearchCost(problem)
    unbounded = np.full(problem.cell.joint_count, np.inf)

    def advance(k: int, q: Array) -> StepResult:
        problem.first_order(k, q)  # refuses a lost path
        cost.aim(k + 1, q)
        expansion = cost.expand(q)
        is_open, moves = np.ones(len(q), dtype=bool), 0
        while expansion.cost > target and moves < MOST_MOVES:
            lines = joint_lines(expansion)
            best = lines.best(-unbounded, unbounded)
            joint = int(np.argmax(np.where(is_open, lines.gain(best), -np.inf)))
            moved = expansion.q.copy()
            moved[joint] += best[joint]
            expansion = cost.expand(moved)
            is_open[joint] = False
            is_open |= not is_open.any()
            moves += 1
        left = np.sqrt(expansion.cost) / problem.step(k) if expansion.cost > target else 0.0
        return StepResult(q=expansion.q, iterations=moves, slack=float(left))

    return advance
