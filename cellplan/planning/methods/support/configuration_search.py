"""Configuration search: from one configuration to one that reaches the tasks, pass by pass, within bounds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.support.search_cost import Expansion, SearchCost
from cellplan.planning.tracking.problem import StepResult, TrackingProblem

POSITION_MARGIN: Final = 1e-11  # [rad] or [m] that a search stays inside a limit: rounding of the written tables
SPEED_MARGIN_FRACTION: Final = 1e-7  # share of a velocity limit left unused: rounding of the tables over one step
STALLED: Final = 1e-9  # share of the cost below which the gain of a pass or a round is negligible
SLOW_FRACTION: Final = 0.01  # share of the cost: a pass that leaves more of it is slow and is extrapolated
EXTRAPOLATED_PASSES: Final = 6  # passes that are extrapolated together
DEPENDENT_RATIO: Final = 1e-6  # share of the largest singular value below which two passes are linearly dependent
MAX_EXTRAPOLATION: Final = 30.0  # largest extrapolation of the passes, in multiples of their length
DISTURBANCE: Final = 1e-2  # [rad] or [m]: disturbance of a configuration at which no single joint lowers the cost
MIN_GAIN_FRACTION: Final = 1e-6  # share of the cost by which a disturbance must lower it to be kept


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Joint position bounds of a search: lowest and highest positions, shape (nq,) each."""

    lowest: Array
    highest: Array

    def clipped(self, q: Array) -> Array:
        """A configuration brought within the bounds."""
        return np.clip(q, self.lowest, self.highest)


Pass = Callable[[Expansion, Bounds, int], tuple[Expansion, int]]  # with so many rounds left, to a better expansion


class ConfigurationSearch:
    """Repeats the passes of a method until all tools are reached, nothing is gained any more or the rounds are used up.

    Where joints hinder each other, moves of one joint at a time gain less and less. After a pass that gained little the
    last few passes are therefore extrapolated, in the combination that to first order brings the tools nearest, if that
    lowers the cost: it relates to passes of single moves as conjugate directions do to steepest descent.

    The only singular situation ([Nicolato2007]_ 3.2.2) is an arm stretched out towards a goal on its own line: no joint
    alone can lower the cost there. The search is then repeated from a slightly disturbed configuration, always the same
    disturbance; its result is dropped if it lowers the cost no further, as with a goal out of reach.
    """

    def __init__(self, problem: TrackingProblem) -> None:
        """Take the tasks and the settings of the search."""
        settings = problem.cell.solver.search
        self._problem = problem
        self.cost = SearchCost(problem)
        self._target = settings.tolerance_mm.si**2
        self._rounds = settings.rounds

    def advance(
        self, k: int, start: Array, bounds: Bounds, improve: Pass, *, momentum: Array | None = None
    ) -> StepResult:
        """Search for the configuration at the sample after k.

        Args:
            start: Configuration there, shape (nq,); it sets which joints may move and how free tool axes lean.
            momentum: What the joints moved in the step before, shape (nq,): the search begins as far along it as
                brings the tools nearest, at most as far as it went, if that costs less than the start.

        Returns:
            The best configuration found; its slack is the root of the cost that is left over the step.
        """
        self.cost.aim(k + 1, start)
        expansion = self.cost.expand(start)
        if momentum is not None and expansion.cost > self._target:
            moved = expansion.q + _scaled(expansion, momentum) * self._problem.mobile(k)
            expansion = cheaper(expansion, self.cost.expand(bounds.clipped(moved)))
        expansion, used = self._repeat(expansion, bounds, improve, self._rounds)
        if expansion.cost > self._target and used < self._rounds:
            disturbed = self.cost.expand(bounds.clipped(expansion.q + self._disturbance(k)))
            improved, more = self._repeat(disturbed, bounds, improve, self._rounds - used)
            used += more
            expansion = improved if improved.cost < (1.0 - MIN_GAIN_FRACTION) * expansion.cost else expansion
        left = np.sqrt(expansion.cost) / self._problem.step(k) if expansion.cost > self._target else 0.0
        return StepResult(q=expansion.q, iterations=used, slack=float(left))

    def _repeat(self, expansion: Expansion, bounds: Bounds, improve: Pass, rounds: int) -> tuple[Expansion, int]:
        """Pass after pass; the best expansion and the rounds used."""
        used = 0
        moves: list[Array] = []
        while expansion.cost > self._target and used < rounds:
            better, spent = improve(expansion, bounds, rounds - used)
            used += spent
            if max(self._target, SLOW_FRACTION * expansion.cost) < better.cost < expansion.cost:
                combined = np.stack([*moves, better.q - expansion.q], axis=1)
                better = cheaper(better, self.cost.expand(bounds.clipped(better.q + _extrapolated(better, combined))))
            moves = [*moves[1 - EXTRAPOLATED_PASSES :], better.q - expansion.q]
            has_stalled = not better.cost < (1.0 - STALLED) * expansion.cost
            expansion = cheaper(expansion, better)
            if has_stalled:
                break
        return expansion, used

    def _disturbance(self, k: int) -> Array:
        """A disturbance of the joints that may move, different for each."""
        mobile = self._problem.mobile(k) * np.any(self._problem.signs != 0.0, axis=0)
        return DISTURBANCE * np.cos(1.0 + 2.4 * np.arange(len(mobile))) * mobile


def cheaper(one: Expansion, other: Expansion) -> Expansion:
    """The expansion that costs less; the first one if they cost the same."""
    return other if other.cost < one.cost else one


def _scaled(expansion: Expansion, move: Array) -> Array:
    """The part of a move that brings all tools nearest to first order, at most the whole move, shape (nq,).

    Anything longer would let motion in the null space grow from step to step, without end.
    """
    shift = expansion.a @ move
    square = float(shift @ shift)
    share = float(expansion.e @ shift) / square if square > 0.0 else 0.0
    return min(max(share, 0.0), 1.0) * move


def _extrapolated(expansion: Expansion, moves: Array) -> Array:
    """The linear combination of moves, shape (nq, n), that brings all tools nearest to first order, shape (nq,)."""
    shares = np.linalg.lstsq(expansion.a @ moves, expansion.e, rcond=DEPENDENT_RATIO)[0]
    move = moves @ shares
    longest, most = float(np.max(np.abs(move))), MAX_EXTRAPOLATION * float(np.max(np.abs(moves)))
    return move if longest <= most else move * (most / longest)


def position_bounds(problem: TrackingProblem, q: Array) -> Bounds:
    """The joints' limits; a joint outside its limits may only move back."""
    limits = problem.cell.joint_limits
    return Bounds(np.minimum(limits.lower + POSITION_MARGIN, q), np.maximum(limits.upper - POSITION_MARGIN, q))


def speed_bounds(problem: TrackingProblem, k: int, q: Array) -> Bounds:
    """The position limits, narrowed to what the velocity limits allow in step k ([Nicolato2007]_ Eq. 3.28)."""
    positions = position_bounds(problem, q)
    reach = (1.0 - SPEED_MARGIN_FRACTION) * problem.cell.joint_limits.velocity * problem.step(k)
    return Bounds(np.maximum(positions.lowest, q - reach), np.minimum(positions.highest, q + reach))
