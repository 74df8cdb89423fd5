"""Configuration search: from one configuration to one that reaches the tasks, pass by pass, within bounds."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.planning.methods.support.search_cost import Expansion, SearchCost
from cellplan.planning.tracking.problem import Advance, TrackingProblem

POSITION_MARGIN: Final = 1e-11  # [rad] or [m] that a search stays inside a limit: rounding of the written tables
SPEED_ROOM: Final = 1e-7  # share of a top speed that is left: rounding of the written tables over one step
STALLED: Final = 1e-9  # share of the cost below which what a pass or a round gains counts as nothing
SLOW: Final = 0.01  # share of the cost that a pass leaves at least when it counts as slow
WAYS: Final = 6  # passes that are carried on together
DEPENDENT: Final = 1e-6  # share of the largest singular value below which two passes led the tools the same way
FARTHEST: Final = 30.0  # times their own length that passes are carried on at most
NUDGE: Final = 1e-2  # [rad] or [m]: disturbance of a configuration from which no single joint can go on
WORTH_IT: Final = 1e-6  # share of the cost that must be gained for a nudge to be kept


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Where a search may take the joints: lowest and highest positions, shape (nq,) each."""

    lowest: Array
    highest: Array

    def held(self, q: Array) -> Array:
        """A configuration brought within the bounds."""
        return np.clip(q, self.lowest, self.highest)


Pass = Callable[
    [Expansion, Bounds, int], tuple[Expansion, int]
]  # from an expansion, with so many rounds left, to a better one


class ConfigurationSearch:
    """Repeats the passes of a method until all tools are reached, nothing is gained any more or the rounds are used up.

    Where joints hinder each other, moves of one joint at a time gain less and less. After a pass that gained little the
    last few passes are therefore carried on, in the mixture that to first order brings the tools nearest, if the cost
    turns out less there: to passes of single moves that is what conjugate directions are to steepest descent.

    The only singular situation ([Nicolato2007]_ 3.2.2) is an arm stretched out towards a goal on its own line: no joint
    alone can gain anything there. The configuration is then disturbed a little, always in the same way, and searched
    from again; the disturbance is forgotten if it led nowhere, as with a goal out of reach.

    Attributes:
        cost: The cost that is searched for its least value.
    """

    def __init__(self, problem: TrackingProblem) -> None:
        """Take the tasks and the settings of the search."""
        settings = problem.cell.solver.search
        self._problem = problem
        self.cost = SearchCost(problem)
        self._target = settings.tolerance**2
        self._rounds = settings.rounds

    def advance(self, k: int, start: Array, bounds: Bounds, improve: Pass, *, momentum: Array | None = None) -> Advance:
        """Search for the configuration at the sample after k.

        Args:
            k: The sample.
            start: Configuration there, shape (nq,); it sets which joints may move and which way tools lean.
            bounds: Where the joints may go.
            improve: The method's pass over the joints, on this cost.
            momentum: What the joints moved in the step before, shape (nq,): the search begins as far along it as
                brings the tools nearest, at most as far as it went, if that costs less than the start.

        Returns:
            The best configuration found; its slack is the root of the cost that is left over the step.
        """
        self.cost.aim(k + 1, start)
        expansion = self.cost.expand(start)
        if momentum is not None and expansion.cost > self._target:
            moved = expansion.q + _scaled(expansion, momentum) * self._problem.mobile(k)
            expansion = cheaper(expansion, self.cost.expand(bounds.held(moved)))
        expansion, used = self._repeat(expansion, bounds, improve, self._rounds)
        if expansion.cost > self._target and used < self._rounds:
            nudged = self.cost.expand(bounds.held(expansion.q + self._nudge(k)))
            found, more = self._repeat(nudged, bounds, improve, self._rounds - used)
            used += more
            expansion = found if found.cost < (1.0 - WORTH_IT) * expansion.cost else expansion
        left = np.sqrt(expansion.cost) / self._problem.step(k) if expansion.cost > self._target else 0.0
        return Advance(q=expansion.q, iterations=used, slack=float(left))

    def _repeat(self, expansion: Expansion, bounds: Bounds, improve: Pass, rounds: int) -> tuple[Expansion, int]:
        """Pass after pass; the best expansion and the rounds used."""
        used = 0
        ways: list[Array] = []
        while expansion.cost > self._target and used < rounds:
            better, spent = improve(expansion, bounds, rounds - used)
            used += spent
            if max(self._target, SLOW * expansion.cost) < better.cost < expansion.cost:
                moves = np.stack([*ways, better.q - expansion.q], axis=1)
                better = cheaper(better, self.cost.expand(bounds.held(better.q + _carried_on(better, moves))))
            ways = [*ways[1 - WAYS :], better.q - expansion.q]
            has_stalled = not better.cost < (1.0 - STALLED) * expansion.cost
            expansion = cheaper(expansion, better)
            if has_stalled:
                break
        return expansion, used

    def _nudge(self, k: int) -> Array:
        """A disturbance that no two joints share, of those that may move."""
        mobile = self._problem.mobile(k) * np.any(self._problem.signs != 0.0, axis=0)
        return NUDGE * np.cos(1.0 + 2.4 * np.arange(len(mobile))) * mobile


def cheaper(one: Expansion, other: Expansion) -> Expansion:
    """The expansion that costs less; the first one if they cost the same."""
    return other if other.cost < one.cost else one


def _scaled(expansion: Expansion, way: Array) -> Array:
    """As much of a way as brings all tools nearest to first order, at most its whole length, shape (nq,).

    Anything longer would let motion in the null space grow from step to step, without end.
    """
    shift = expansion.a @ way
    square = float(shift @ shift)
    share = float(expansion.e @ shift) / square if square > 0.0 else 0.0
    return min(max(share, 0.0), 1.0) * way


def _carried_on(expansion: Expansion, ways: Array) -> Array:
    """The sum of multiples of ways, shape (nq, n), that brings all tools nearest to first order, shape (nq,)."""
    shares = np.linalg.lstsq(expansion.a @ ways, expansion.e, rcond=DEPENDENT)[0]
    move = ways @ shares
    longest, most = float(np.max(np.abs(move))), FARTHEST * float(np.max(np.abs(ways)))
    return move if longest <= most else move * (most / longest)


def position_bounds(problem: TrackingProblem, q: Array) -> Bounds:
    """The joints' limits; a joint that is outside may only come back."""
    limits = problem.cell.joint_limits
    return Bounds(np.minimum(limits.lower + POSITION_MARGIN, q), np.maximum(limits.upper - POSITION_MARGIN, q))


def speed_bounds(problem: TrackingProblem, k: int, q: Array) -> Bounds:
    """The joints' limits, and how far their top speeds take them in the step after k ([Nicolato2007]_ Eq. 3.28)."""
    positions = position_bounds(problem, q)
    reach = (1.0 - SPEED_ROOM) * problem.cell.joint_limits.velocity * problem.step(k)
    return Bounds(np.maximum(positions.lowest, q - reach), np.minimum(positions.highest, q + reach))
