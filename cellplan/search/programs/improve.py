"""Improve: sequential linear programs with a trust region, from a point to a local optimum.

Each program is linear in a step of all variables, with exact derivatives. Demands that are violated have a slack, which
costs more than anything the objective can gain. A step is taken where the true motion bears it out; it is then the
point of the next program, so every iteration works out one motion, one set of distances and one set of derivatives. A
step that is refused costs a smaller program and one more motion.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.programs.measures import LENGTH, Measures, Missed
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import Point, Problem
from cellplan.search.programs.program import LinearProgram
from cellplan.search.programs.rows import Linear

WIDEST: Final = 1.5  # [-] usual steps
SMALLEST: Final = 0.004  # [-] usual steps: below, nothing more is gained
BORNE_OUT: Final = 0.1  # [-] share of what a program expects that the true motion must gain
GOOD: Final = 0.7  # [-] share from which the next region is wider
GROWS: Final = 1.6  # [-] factor of the region after a good step
SHRINKS: Final = 0.4  # [-] and after one that is refused
LEAST: Final = 1e-6  # [-] that a step must gain
CORRECTIONS: Final = 1  # programs with the bends of the rows that a refused step has shown
LOOKS_BACK: Final = 8  # [-] iterations over which the gain is judged
GIVE_UP_AFTER: Final = 12  # programs: see ``Effort.give_up_above``


@dataclass(frozen=True, slots=True, kw_only=True)
class Iteration:
    """One program."""

    cycle: float  # shortest cycle in [s] after it
    violation: float  # what is missed after it, in usual units; 0 where all demands are kept
    objective: float  # the objective after it
    trust: float  # radius of the trust region in usual steps
    is_taken: bool  # whether its step was taken


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Improved:
    """What a local optimisation comes to: the best conforming point, else the one that misses least."""

    x: Array  # the variables, shape (n,)
    start: Array  # start posture of all joints in [rad] or [m], shape (nq,)
    point: Point  # the motion
    cycle: float  # shortest cycle in [s]
    objective: float  # what was to be small, see ``Measures.objective``
    violation: float  # what is missed, in usual units; 0 where all demands are kept at the nodes and keys
    history: tuple[Iteration, ...]  # all programs

    @property
    def is_conforming(self) -> bool:
        """Whether all demands are kept at the nodes and keys."""
        return self.violation <= 0.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _State:
    """A point and how it stands."""

    measures: Measures
    missed: Missed
    objective: float

    @property
    def violation(self) -> float:
        """What is missed."""
        return self.missed.violation

    @property
    def rank(self) -> tuple[float, float]:
        """What makes one point better than another: what is missed, then the objective."""
        return self.violation, self.objective


def improve(
    problem: Problem, x: Array, start: Array, demands: Demands, effort: Effort | None = None
) -> Improved | None:
    """The local optimum that programs reach from a point.

    Args:
        x: Variables to begin with, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).

    Returns:
        The best point; None where there is no motion at the first one.
    """
    given = effort or Effort()
    first = problem.evaluate(x, start)
    return None if first is None else _Climb(problem, demands, given).from_point(first)


class _Climb:
    """The iterations."""

    def __init__(self, problem: Problem, demands: Demands, effort: Effort) -> None:
        """Note what is improved."""
        self._problem, self._demands, self._effort = problem, demands, effort
        self._trust, self._price = effort.trust, 1.0
        self._history: list[Iteration] = []

    def from_point(self, first: Point) -> Improved:
        """Iterate from a point until nothing more is gained."""
        here = best = self._state(first)
        linear: Linear | None = None
        for _ in range(self._effort.iterations):
            if self._is_done(here):
                break
            linear = linear or Linear.of(self._problem, here.measures)
            there = self._step(here, linear)
            self._note(there or here, is_taken=there is not None)
            if there is not None:
                here, linear = there, None
                best = min(best, here, key=lambda improved: improved.rank)
        return self._result(best)

    def _is_done(self, here: _State) -> bool:
        """Whether the objective is reached, the region is too small, or too little is gained."""
        if self._demands.objective is Objective.CONFORMING and here.violation <= 0.0:
            return True
        if self._trust < SMALLEST:
            return True
        if len(self._history) <= LOOKS_BACK:
            return False
        limit = self._effort.give_up_above
        if limit is not None and len(self._history) >= GIVE_UP_AFTER and here.objective > limit:
            return True
        before, now = self._history[-1 - LOOKS_BACK], self._history[-1]
        return before.violation <= 0.0 and before.objective - now.objective < self._effort.least_gain * self._unit(
            before.objective
        )

    def _step(self, here: _State, linear: Linear) -> _State | None:
        """The state after one program; None where its step is refused. Sets the next region."""
        program = LinearProgram.of(linear, self._demands, self._effort.reserve, self._trust).priced(self._price)
        self._price = program.price
        bends: Array | None = None
        for _ in range(1 + CORRECTIONS):
            step = program.solve(bends)
            if step is None:
                break
            there = self._at(here, linear, step.z)
            gain = -np.inf if there is None else self._gain(here, there)
            if there is None:
                break
            if gain > max(BORNE_OUT * step.expected, LEAST):
                if gain > GOOD * step.expected:
                    self._trust = min(WIDEST, GROWS * self._trust)
                return there
            seen = (row.bends(here.measures, there.measures, step.z) for row in program.rows)
            bends = np.concatenate([np.zeros(0), *seen])
        count = len(here.measures.point.x)
        reach = self._trust if step is None else float(np.abs(step.z[:count]).max(initial=0.0))
        self._trust = SHRINKS * min(self._trust, reach)
        return None

    def _at(self, here: _State, linear: Linear, z: Array) -> _State | None:
        """The state after a step, in usual steps; None where a tool cannot follow."""
        problem, point = self._problem, here.measures.point
        dx = np.clip(point.x + z[: len(point.x)] * problem.scale, problem.lower, problem.upper) - point.x
        near = replace(point, q=point.q + linear.derivatives.q @ dx, rates=linear.derivatives.rates)
        motion = problem.evaluate(point.x + dx, point.start, near)
        return None if motion is None else self._state(motion)

    def _gain(self, here: _State, there: _State) -> float:
        """What a step gains: the merit of the program, true."""
        objective = (here.objective - there.objective) / self._unit(here.objective)
        return objective + here.missed.cost(self._price) - there.missed.cost(self._price)

    def _unit(self, objective: float) -> float:
        """What counts as one in the objective of a program."""
        match self._demands.objective:
            case Objective.CYCLE:
                return objective
            case Objective.CLEARANCE:
                return LENGTH
            case _:
                return 1.0

    def _state(self, point: Point) -> _State:
        measures = Measures.of(self._problem, point, self._demands, self._effort)
        return _State(
            measures=measures,
            missed=measures.missed(self._problem, self._demands, self._effort.reserve),
            objective=measures.objective(self._problem, self._demands),
        )

    def _note(self, state: _State, *, is_taken: bool) -> None:
        """Keep a line of the history."""
        self._history.append(
            Iteration(
                cycle=state.measures.cycle,
                violation=state.violation,
                objective=state.objective,
                trust=self._trust,
                is_taken=is_taken,
            )
        )

    def _result(self, best: _State) -> Improved:
        point = best.measures.point
        return Improved(
            x=point.x,
            start=point.start,
            point=point,
            cycle=best.measures.cycle,
            objective=best.objective,
            violation=best.violation,
            history=tuple(self._history),
        )
