"""Recursive search: one joint after the other in a fixed sequence, each within its limits of position and speed."""

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.planning.methods.support.configuration_search import (
    STALLED,
    Bounds,
    ConfigurationSearch,
    Pass,
    speed_bounds,
)
from cellplan.planning.methods.support.search_cost import NO_EFFECT, Expansion, SearchCost
from cellplan.planning.tracking.problem import Advance, TrackingProblem

SMALL_ANGLE: Final = 0.1  # [rad] or [m]: farther from an expansion its first order is not trusted at first
ROUNDS_ON_A_LOOK: Final = 50  # before the cell is checked again: near a singularity all depends on where the joints are
SMALLEST_TRUST: Final = 1e-9  # [rad] or [m]: where even moves this small gain nothing there is nothing to gain
AIM: Final = 0.25  # share of the allowed cost that the rounds are to leave to first order

Indices = NDArray[np.intp]


def recursive_search(problem: TrackingProblem) -> Callable[[int, Array], Advance]:
    r"""Search joint by joint in a fixed sequence ([Nicolato2007]_ 3.4) over the joints of all robots and all tasks.

    For a small angle the cost along one joint is a parabola, and the joint goes to its lowest point (Eqs. 3.25-3.27):

    .. math:: h_i = k_0 \theta^2 + k_1 \theta + k_2, \quad k_0 = a_i \cdot a_i, \quad k_1 = -2 \, e \cdot a_i, \quad
              \theta^* = -k_1 / (2 k_0) = (e \cdot a_i) / (a_i \cdot a_i)

    (the paper's Eq. 3.26 lacks the factor 2). A joint that moves no tool stays (``k_0 = 0``). The sum of a joint's
    moves within a step stays inside its limits of position and speed (Eq. 3.28). Joints that are not in the sequence
    stand still.

    A joint of weight ``w_i`` makes ``min(w) / w_i`` of each move: the lightest joint its whole move, one of twice the
    weight half of it (5.4.2, where the share itself is given). With ``brakes`` each move towards the nearer limit is
    multiplied by ``4 (q_max - q)(q - q_min) / (q_max - q_min)^2`` (Eqs. 3.29, 3.30), moves away from it are not: the
    printed form holds a joint at a limit for ever.

    As all angles are small, rounds over the sequence are made on one expansion of the cost (``e`` follows each move to
    first order) until nothing is left of ``e``, nothing can be gained or many are made; then the cost is expanded anew.
    An expansion that turns out no better than the one before is forgotten and the same rounds are made with less room.
    Those that gain little are carried on (see `ConfigurationSearch`).
    """
    sequence = _sequence(problem.cell)

    def advance(k: int, q: Array) -> Advance:
        weights = problem.first_order(k, q).weights[sequence]  # refuses a lost path
        limits = speed_bounds(problem, k, q)
        bounds = Bounds(np.where(stands, q, limits.lowest), np.where(stands, q, limits.highest))
        return search.advance(k, q, bounds, rounds.on(search.cost, weights.min(initial=np.inf) / weights))

    stands = ~np.isin(np.arange(problem.cell.joint_count), sequence)
    rounds = _Rounds(problem.cell, sequence)
    search = ConfigurationSearch(problem)
    return advance


def _sequence(cell: Cell) -> Indices:
    """Joints in the order in which they move, as indices into the stacked joint vector."""
    named = cell.solver.search.sequence
    if named is None:
        return np.arange(cell.joint_count)
    return np.array(
        [cell.columns(robot).start + cell.robot(robot).model.joint_names.index(joint) for robot, joint in named],
        dtype=np.intp,
    )


class _Rounds:
    """Rounds over the sequence."""

    def __init__(self, cell: Cell, sequence: Indices) -> None:
        """Take limits for the brakes and the tolerance."""
        self._sequence = sequence
        self._lower = cell.joint_limits.lower[sequence]
        self._upper = cell.joint_limits.upper[sequence]
        self._has_range = np.isfinite(self._upper - self._lower)
        self._has_brakes = cell.solver.search.brakes
        self._target = AIM * cell.solver.search.tolerance**2

    def on(self, cost: SearchCost, shares: Array) -> Pass:
        """Rounds on one expansion after another.

        Args:
            cost: The cost that is expanded.
            shares: Share of each joint's best move that it makes, in the order of the sequence.
        """

        def improve(expansion: Expansion, bounds: Bounds, rounds: int) -> tuple[Expansion, int]:
            trust, used = SMALL_ANGLE, 0
            while used < rounds and trust > SMALLEST_TRUST:
                near = Bounds(
                    np.maximum(bounds.lowest, expansion.q - trust), np.minimum(bounds.highest, expansion.q + trust)
                )
                q, spent = self._to_first_order(expansion, near, shares, min(rounds - used, ROUNDS_ON_A_LOOK))
                used += spent
                found = cost.expand(q)
                if found.cost < expansion.cost:
                    return found, used
                trust = 0.25 * float(np.max(np.abs(q - expansion.q)))
            return expansion, max(used, 1)

        return improve

    def _to_first_order(self, expansion: Expansion, bounds: Bounds, shares: Array, rounds: int) -> tuple[Array, int]:
        """Rounds over the sequence on one expansion: the configuration they lead to and how many they were."""
        chosen = self._sequence
        a, e, q = expansion.a[:, chosen], expansion.e, expansion.q[chosen]
        k0 = np.einsum("ij,ij->j", a, a)
        moves = k0 > NO_EFFECT * k0.max(initial=0.0)
        chosen, a, q, k0 = chosen[moves], a[:, moves], q[moves], k0[moves]
        lowest, highest = bounds.lowest[chosen], bounds.highest[chosen]
        shares = shares[moves]
        at_once = np.linalg.inv(np.tril(a.T @ a, -1) + np.diag(k0 / shares))
        cost, used = float(e @ e), 0
        while used < rounds and cost > self._target:
            reached = q + at_once @ (e @ a)
            if self._has_brakes or np.any((reached < lowest) | (reached > highest)):
                factors = shares / k0 * self._brakes(q, moves)
                reached = _one_by_one(q, a, e=e, factors=factors, bounds=Bounds(lowest, highest))
            e = e - a @ (reached - q)
            q, before, cost, used = reached, cost, float(e @ e), used + 1
            if not cost < (1.0 - STALLED) * before:
                break
        configuration = expansion.q.copy()
        configuration[chosen] = q
        return configuration, used

    def _brakes(self, q: Array, moves: NDArray[np.bool_]) -> Array:
        """Factors of moves down and up from a configuration, shape (2, n): Eq. 3.29 towards the nearer limit."""
        factors = np.ones((2, len(q)))
        lower, upper, braked = self._lower[moves], self._upper[moves], self._has_range[moves] & self._has_brakes
        lower, upper, here = lower[braked], upper[braked], q[braked]
        width = np.maximum(upper - lower, SMALLEST_TRUST)
        factor = np.maximum(4.0 * (upper - here) * (here - lower) / width**2, 0.0)
        rises = here > 0.5 * (lower + upper)
        factors[0, braked] = np.where(rises, 1.0, factor)
        factors[1, braked] = np.where(rises, factor, 1.0)
        return factors


def _one_by_one(q: Array, a: Array, *, e: Array, factors: Array, bounds: Bounds) -> Array:
    """One round in which every joint heeds its bounds and brakes before the next one moves.

    Args:
        q: Positions in the order of the sequence, shape (n,).
        a: Derivatives of the actual by them, shape (m, n).
        e: Reference minus actual, shape (m,).
        factors: What ``e . a_i`` is multiplied by for a move downwards and upwards, shape (2, n).
        bounds: Lowest and highest positions, shape (n,).
    """
    reached = q.copy()
    ways = np.ascontiguousarray(a.T)
    for i, way in enumerate(ways):
        slope = float(e @ way)
        move = slope * factors[int(slope > 0.0), i]
        reached[i] = min(max(q[i] + move, bounds.lowest[i]), bounds.highest[i])
        e = e - way * (reached[i] - q[i])
    return reached
