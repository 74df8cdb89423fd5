"""Heuristic search: always the one joint that brings all tools nearest to where they are to be."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.support.configuration_search import Bounds, ConfigurationSearch, Pass, position_bounds
from cellplan.planning.methods.support.joint_line import joint_lines
from cellplan.planning.methods.support.search_cost import NO_EFFECT, Expansion, SearchCost
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

NEGLIGIBLE: Final = 1e-12  # share of the cost that a move must gain: below it a joint would turn for rounding errors
HALVINGS: Final = 20  # of a move whose gain is only known to second order, before it is left out


def heuristic_search(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
    """Best-first search among the joints of all robots ([Nicolato2007]_ Algorithm 1); all tasks add to the cost.

    A round goes: of all open joints the one whose best move leaves the least cost makes that move and is closed; when
    all are closed, all are opened again. The search ends as soon as the root of the cost is within the tolerance.

    Besides the paper: joints stop dead at their position limits, and their speeds are not limited (`recursive_search`
    limits speeds and can brake). A search begins where the last step leads to, scaled so that it fits the goal best, if
    that costs less than the present posture: otherwise small changes of the goal change the order of the joints, and
    redundant cells shake. Rounds that gain little are carried on (see `ConfigurationSearch`). A joint that moves no
    tool stays: rounding alone would turn it by any angle.
    """
    tolerance = problem.cell.solver.search.tolerance_mm.si
    search = ConfigurationSearch(problem)
    improve = _best_first(search.cost, tolerance**2)
    before: dict[int, Array] = {}  # configuration at the time before the last one, by that one's number

    def advance(k: int, q: Array) -> StepResult:
        problem.weights(k, q)  # refuses a lost path
        last = before.pop(k, None)
        before.clear()
        before[k + 1] = q
        momentum = None if last is None else q - last
        return search.advance(k, q, position_bounds(problem, q), improve, momentum=momentum)

    return advance


def _best_first(cost: SearchCost, target: float) -> Pass:
    """One round of Algorithm 1 as a pass."""

    def improve(expansion: Expansion, bounds: Bounds, _rounds: int) -> tuple[Expansion, int]:
        return _round(cost, expansion, bounds, target), 1

    return improve


def _round(cost: SearchCost, expansion: Expansion, bounds: Bounds, target: float) -> Expansion:
    """Every joint moves once, the best one first (steps 6 to 12)."""
    is_open = np.ones(len(expansion.q), dtype=bool)
    while is_open.any() and expansion.cost > target:
        lines = joint_lines(expansion)
        effects = lines.aa + lines.nn
        acts = effects > NO_EFFECT * effects.max(initial=0.0)
        moves = lines.best(bounds.lowest - expansion.q, bounds.highest - expansion.q)
        gains = np.where(is_open & acts, lines.gain(moves), -np.inf)
        best = int(np.argmax(gains))
        if not gains[best] > NEGLIGIBLE * expansion.cost:
            break
        expansion = _moved(cost, expansion, best, float(moves[best]))
        is_open[best] = False
    return expansion


def _moved(cost: SearchCost, expansion: Expansion, joint: int, move: float) -> Expansion:
    """The expansion after one joint's move; a move that costs more, as a linkage may make it, is halved."""
    for _ in range(HALVINGS):
        q = expansion.q.copy()
        q[joint] += move
        moved = cost.expand(q)
        if moved.cost < expansion.cost:
            return moved
        move *= 0.5
    return expansion
