"""Program: the best step within the trust region for the linear rows of a point, slack on what is violated."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import daqp
import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.search.programs.measures import IN_RESERVE
from cellplan.search.programs.objective import Demands, Objective, Reserve
from cellplan.search.programs.rows import ConstraintRows, Linear

SOLVED: Final = 1  # exit flag of daqp
UNBOUNDED: Final = 1e30  # [-] no bound
PROVED: Final = 1e-6  # [-] by which an answer may miss a row of length 1
DEAREST: Final = 1e4  # [-] price of slack
HIGHER: Final = 10.0  # [-] factor of the price
SPARED: Final = 0.1  # [-] share of what could be mended that a price may leave
MISSED: Final = 1e-9  # [-] usual units: nothing
PROXIMAL: Final = 1e-3  # [-] weight of a step: of equal ones the shortest
CURVATURE: Final = 0.75  # [-] of the time: second derivative of c^(-1/2) by a relative change of c
SLOWER: Final = -0.4  # [-] least relative change of a square in one step
FASTER: Final = 0.6  # [-] largest one
FARTHEST: Final = 1e6  # [-] by which the objective of one step may change


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramSolution:
    """The least point of a program."""

    at: Array  # the point, shape (n,)
    multipliers: Array  # how fast the least value falls as a row's bound rises, shape (M,), none negative
    of_bounds: Array  # the same of the bounds of the variables, negative at lower ones, shape (n,)


def least(
    cost: Array, weights: Array, rows: Array, highest: Array, bounds: tuple[Array, Array]
) -> ProgramSolution | None:
    """The least ``cost x + 1/2 sum weights x^2`` under ``rows x <= highest`` and bounds; None where there is none.

    Args:
        cost: Shape (n,).
        weights: Positive, shape (n,).
        rows: Shape (M, n).
        highest: Shape (M,).
        bounds: Lower and upper ones, shape (n,) each.
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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramStep:
    """The solution of a program."""

    z: Array  # step in usual steps of the variables, then relative changes of the squares of a retimed motion, (n + m,)
    expected: float  # what it is expected to gain
    left: float  # what is still missed after it, by the rows, in usual units
    before: float  # what is missed before it
    solved: ProgramSolution  # the whole solution


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LinearProgram:
    """One linear program in the step z, the objective t, the slacks of violated demands and costs of changes.

    The time of a retimed motion is convex in the squares of its speed, which are part of the step: it is quadratic in
    them, so that they do not change from one bound to the other.
    """

    rows: Sequence[ConstraintRows]  # the rows, stacked
    box: tuple[Array, Array]  # lower and upper ends of the step in usual steps, shape (n + m,) each
    demands: Demands  # what is demanded
    changed: tuple[Array, Array]  # cost of the present change and of one usual step of each variable, shape (n,) each
    curved: Array  # second derivatives of the objective by the step, shape (n + m,)
    price: float = 1.0  # what a slack of one unit costs

    @classmethod
    def of(cls, linear: Linear, demands: Demands, reserve: Reserve, trust: float) -> "LinearProgram":
        """The program of a point, for a trust region of some radius in usual steps."""
        problem, x = linear.problem, linear.measures.point.x
        lower = np.minimum(np.maximum((problem.lower - x) / problem.scale, -trust), 0.0)
        upper = np.maximum(np.minimum((problem.upper - x) / problem.scale, trust), 0.0)
        curved, pace = np.zeros(len(x)), linear.measures.pace
        if pace is not None:
            inner = pace.inner
            lower = np.append(lower, np.full(len(inner), SLOWER))
            upper = np.append(upper, np.full(len(inner), FASTER))
            of_cycle = pace.seconds / linear.measures.cycle if demands.objective is Objective.CYCLE else 0.0
            curved = np.append(curved, of_cycle * CURVATURE * pace.shares[inner])
        return cls(
            rows=linear.rows(demands, reserve, np.maximum(-lower, upper)),
            box=(lower, upper),
            demands=demands,
            changed=((x - problem.given) * problem.cost, problem.cost * problem.scale),
            curved=curved,
        )

    def priced(self, price: float) -> "LinearProgram":
        """The same at the least price, from a given one on, at which slack is nearly as small as it can be."""
        program = replace(self, price=price)
        while program.price < DEAREST:
            step, dearer = program.solve(), replace(program, price=HIGHER * program.price)
            if step is None or step.left <= MISSED:
                break
            least_left = replace(program, price=DEAREST).solve()
            if least_left is None or step.left - least_left.left <= SPARED * (step.before - least_left.left):
                break
            program = dearer
        return program

    def solve(self, corrections: Array | None = None) -> ProgramStep | None:
        """The best step; None where the solver finds none.

        Args:
            corrections: Added to the violations of all rows, shape (M,): what a step was seen to miss beyond its rows.
        """
        count, violations = len(self.box[0]), self._stacked([row.violations for row in self.rows])
        gradients = np.concatenate([np.zeros((0, count)), *(row.gradients for row in self.rows)])
        aims = np.repeat([row.aim for row in self.rows], [len(row.violations) for row in self.rows])
        family, most, free = self._families((violations > 0.0) & (aims == 0.0), violations)
        slacks, costs = len(most), self._costs
        A = np.zeros((len(violations) + 2 * costs, count + 1 + 2 * slacks + costs))
        A[: len(violations), :count], A[: len(violations), count] = gradients, -aims
        is_loose = np.flatnonzero(family >= 0)
        for first in (count + 1, count + 1 + slacks):
            A[is_loose, first + family[is_loose]] = -1.0
        targets = violations if corrections is None else violations + corrections
        top = np.concatenate([-targets, *self._changes(A[len(violations) :], count + 1 + 2 * slacks)])
        prices = np.repeat([IN_RESERVE * self.price, self.price, 1.0], [slacks, slacks, costs])
        cost = np.concatenate([np.zeros(count), [self._weight], prices])
        lower = np.concatenate([self.box[0], [-FARTHEST], np.zeros(2 * slacks + costs)])
        upper = np.concatenate([self.box[1], [FARTHEST], free, most - free, np.full(costs, FARTHEST)])
        weights = np.full(len(cost), PROXIMAL)
        weights[:count] += self.curved
        solved = least(cost, weights, A, top, (lower, upper))
        if solved is None:
            return None
        now = np.concatenate([np.zeros(count), [0.0], free, most - free, np.abs(self.changed[0])[:costs]])
        out = slice(count + 1 + slacks, count + 1 + 2 * slacks)
        return ProgramStep(
            z=solved.at[:count],
            expected=float(cost @ (now - solved.at) - 0.5 * self.curved @ solved.at[:count] ** 2),
            left=float(solved.at[out].sum()),
            before=float(now[out].sum()),
            solved=solved,
        )

    def _stacked(self, parts: Sequence[Array]) -> Array:
        """Arrays of all rows, one after the other."""
        return np.concatenate([np.zeros(0), *parts])

    @property
    def _weight(self) -> float:
        """Weight of t."""
        return 1.0 if self.demands.objective in (Objective.CYCLE, Objective.CLEARANCE) else 0.0

    @property
    def _costs(self) -> int:
        """Number of variables that stand for the costs of changes."""
        return len(self.changed[0]) if self.demands.objective is Objective.CHANGE else 0

    def _families(self, is_loose: Flags, violations: Array) -> tuple[Indices, Array, Array]:
        """Which slack each row has, -1 for none; what is missed now of each, and how much of it counts as kept.

        Rows about one joint or one pair share theirs.
        """
        kinds = np.repeat(np.arange(len(self.rows)), [len(row.violations) for row in self.rows])
        subjects = np.concatenate([np.zeros(0, dtype=np.intp), *(row.subjects for row in self.rows)])
        family = np.full(len(violations), -1, dtype=np.intp)
        labels = np.stack([kinds, subjects], axis=1)[is_loose]
        families, which = np.unique(labels, axis=0, return_inverse=True) if len(labels) else (labels, np.zeros(0, int))
        family[is_loose] = which
        most, free = np.zeros(len(families)), np.zeros(len(families))
        np.maximum.at(most, which, violations[is_loose])
        free[which] = self._stacked([row.allowed for row in self.rows])[is_loose]
        return family, most, np.minimum(free, most)

    def _changes(self, block: Array, first: int) -> list[Array]:
        """Fill in the rows that keep the cost of each change above the change itself, both ways; their bounds."""
        if not self._costs:
            return []
        present, per_step = self.changed
        steps = np.arange(self._costs)
        for sign, part in ((1.0, block[: self._costs]), (-1.0, block[self._costs :])):
            part[steps, steps] = sign * per_step
            part[steps, first + steps] = -1.0
        return [-present, present]
