"""Recursive search: one joint after the other in a fixed sequence, each within its limits of position and speed."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell.cell import Cell
from cellplan.planning.methods.support.configuration_search import (
    STALLED,
    Bounds,
    ConfigurationSearch,
    Pass,
    speed_bounds,
)
from cellplan.planning.methods.support.search_cost import NO_EFFECT, Expansion, SearchCost
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

SMALL_ANGLE: Final = 0.1  # [rad] or [m]: farther from an expansion its first order is not trusted at first
ROUNDS_ON_A_LOOK: Final = 50  # before the cell is checked again: near a singularity all depends on where the joints are
SMALLEST_TRUST: Final = 1e-9  # [rad] or [m]: where even moves this small gain nothing there is nothing to gain
AIM: Final = 0.25  # share of the allowed cost that the rounds are to leave to first order


def recursive_search(problem: TrackingProblem) -> Callable[[int, Array], StepResult]:
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

    def advance(k: int, q: Array) -> StepResult:
        weights = problem.weights(k, q)[sequence]  # refuses a lost path
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
        [cell.columns(it.robot).start + cell.robot(it.robot).model.joint_names.index(it.joint) for it in named],
        dtype=np.intp,
    )


class _Rounds:
    """Rounds over the sequence."""

    def __init__(self, cell: Cell, sequence: Indices) -> None:
        """Take limits for the brakes and the tolerance."""
        self._sequence = sequence
        lower, upper = cell.joint_limits.lower[sequence], cell.joint_limits.upper[sequence]
        self._limits = [
            _Brake.of(float(low), float(high)) if cell.solver.search.brakes and np.isfinite(high - low) else None
            for low, high in zip(lower, upper, strict=True)
        ]
        self._target = AIM * cell.solver.search.tolerance_mm.si**2

    def on(self, cost: SearchCost, shares: Array) -> Pass:
        """Rounds on one expansion after another; each joint makes a share of its best move, in their order."""

        def improve(expansion: Expansion, bounds: Bounds, rounds: int) -> tuple[Expansion, int]:
            trust, used = SMALL_ANGLE, 0
            while used < rounds and trust > SMALLEST_TRUST:
                near = Bounds(
                    np.maximum(bounds.lowest, expansion.q - trust), np.minimum(bounds.highest, expansion.q + trust)
                )
                q, spent = self._to_first_order(expansion, near, shares, min(rounds - used, ROUNDS_ON_A_LOOK))
                used += spent
                expanded = cost.expand(q)
                if expanded.cost < expansion.cost:
                    return expanded, used
                trust = 0.25 * float(np.max(np.abs(q - expansion.q)))
            return expansion, max(used, 1)

        return improve

    def _to_first_order(self, expansion: Expansion, bounds: Bounds, shares: Array, rounds: int) -> tuple[Array, int]:
        """Rounds over the sequence on one expansion: the configuration they lead to and how many they were."""
        chosen = self._sequence
        a, e = expansion.a[:, chosen], expansion.e
        gram = a.T @ a
        k0 = gram.diagonal()
        moves = np.flatnonzero(k0 > NO_EFFECT * k0.max(initial=0.0))
        chosen = chosen[moves]
        line = _Line(
            expansion.q[chosen],
            (e @ a)[moves],
            gram[np.ix_(moves, moves)],
            shares=shares[moves],
            bounds=Bounds(bounds.lowest[chosen], bounds.highest[chosen]),
        )
        brakes = [self._limits[place] for place in moves.tolist()]
        cost, used = expansion.cost, 0
        while used < rounds and cost > self._target:
            before, cost, used = cost, cost - line.round(brakes), used + 1
            if not cost < (1.0 - STALLED) * before:
                break
        configuration = expansion.q.copy()
        configuration[chosen] = line.q
        return configuration, used


class _Brake(NamedTuple):
    """What slows a joint down towards its nearer limit: the limits, the middle between them, and ``4 / width^2``."""

    lower: float
    upper: float
    middle: float
    scale: float

    @classmethod
    def of(cls, lower: float, upper: float) -> "_Brake":
        """The brake of a joint with limits on both sides."""
        return cls(lower, upper, 0.5 * (lower + upper), 4.0 / max(upper - lower, SMALLEST_TRUST) ** 2)


class _Line:
    """The joints of a sequence on one expansion of the cost, which each round moves.

    Attributes:
        q: Positions in the order of the sequence, shape (n,).
    """

    def __init__(self, q: Array, slopes: Array, gram: Array, *, shares: Array, bounds: Bounds) -> None:
        """Take the cost along all joints.

        Args:
            q: Positions in the order of the sequence, shape (n,).
            slopes: ``e . a_i`` there: half the slope of the cost along each joint, downwards, shape (n,).
            gram: ``a_i . a_j`` of all pairs, shape (n, n).
            shares: Share of each joint's best move that it makes without brakes, shape (n,).
            bounds: Lowest and highest positions, shape (n,) each.
        """
        self.q, self._slopes, self._gram, self._bounds = q, slopes, gram, bounds
        self._factors = shares / gram.diagonal()

    def round(self, brakes: Sequence["_Brake | None"]) -> float:
        """Move every joint once; by how much the cost falls.

        Joints that reach no bound and have no brakes move at once: a round is one triangular system.
        """
        if any(brakes):
            return self._one_by_one(brakes)
        move: Array = self._at_once @ self._slopes
        reached = self.q + move
        if np.any((reached < self._bounds.lowest) | (reached > self._bounds.highest)):
            return self._one_by_one(brakes)
        before, self.q = self._slopes, reached
        self._slopes = before - self._gram @ move
        gained: Array = before + self._slopes
        return float(move @ gained)

    @cached_property
    def _at_once(self) -> Array:
        """Moves of one round for the slopes at its beginning, where nothing is in the way, shape (n, n)."""
        return np.asarray(np.linalg.inv(np.tril(self._gram, -1) + np.diag(1.0 / self._factors)), dtype=np.float64)

    @cached_property
    def _plain(self) -> tuple[list[list[float]], list[float], list[float], list[float]]:
        """Products, factors and bounds as plain numbers."""
        factors, lowest, highest = (
            array.tolist() for array in (self._factors, self._bounds.lowest, self._bounds.highest)
        )
        return self._gram.tolist(), factors, lowest, highest

    def _one_by_one(self, brakes: Sequence["_Brake | None"]) -> float:
        """The same, each joint within its bounds before the next one moves; plain numbers, as one joint is few."""
        gram, factors, lowest, highest = self._plain
        q, slopes, gained = self.q.tolist(), self._slopes.tolist(), 0.0
        for i, row in enumerate(gram):
            slope, here, brake = slopes[i], q[i], brakes[i]
            move = slope * factors[i]
            if brake is not None:
                lower, upper, middle, scale = brake
                if (slope > 0.0) == (here > middle):  # Eq. 3.29; moves away from the nearer limit are whole
                    move *= max(scale * (upper - here) * (here - lower), 0.0)
            reached = min(max(here + move, lowest[i]), highest[i])
            move = reached - here
            if move != 0.0:
                gained += move * (2.0 * slope - move * row[i])
                slopes = [slope - move * product for slope, product in zip(slopes, row, strict=True)]
                q[i] = reached
        self.q, self._slopes = np.array(q), np.array(slopes)
        return gained
