"""Program: the best step within the trust region for the linear rows of a point, slack on what is violated."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.search.programs.objective import Demands, Objective
from cellplan.search.programs.rows import Rows
from cellplan.search.programs.solver import Solved, least

SLACK: Final = 10.0  # [-] share of the objective that the slack of one unit costs: feasibility first
PROXIMAL: Final = 1e-3  # [-] weight of a step: of equal ones the shortest
FARTHEST: Final = 1e3  # [-] by which the objective of one step may change


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Program:
    """One linear program in the step z, the objective t, the slacks of violated demands and costs of changes.

    Attributes:
        rows: The rows, stacked.
        box: Lower and upper ends of the step in usual steps, shape (n,) each.
        demands: What is demanded.
        changed: Cost of the present change and of one usual step of each variable, shape (n,) each.
    """

    rows: Sequence[Rows]
    box: tuple[Array, Array]
    demands: Demands
    changed: tuple[Array, Array]

    def solve(self) -> tuple[Array, float, Solved] | None:
        """The step in usual steps, what it is expected to gain, and the solution; None where the solver finds none."""
        count = len(self.box[0])
        lacks = np.concatenate([np.zeros(0), *(each.lacks for each in self.rows)])
        gradients = np.concatenate([np.zeros((0, count)), *(each.gradients for each in self.rows)])
        aims = np.concatenate([np.zeros(0), *(np.full(len(each.lacks), each.aim) for each in self.rows)])
        family, most = self._families(lacks, aims)
        slacks, costs = len(most), self._costs
        A = np.zeros((len(lacks) + 2 * costs, count + 1 + slacks + costs))
        A[: len(lacks), :count], A[: len(lacks), count] = gradients, -aims
        is_loose = np.flatnonzero(family >= 0)
        A[is_loose, count + 1 + family[is_loose]] = -1.0
        top = np.concatenate([-lacks, *self._changes(A[len(lacks) :], count + 1 + slacks)])
        cost = np.concatenate([np.zeros(count), [self._weight], np.full(slacks, SLACK), np.ones(costs)])
        lower = np.concatenate([self.box[0], [-FARTHEST], np.zeros(slacks + costs)])
        upper = np.concatenate([self.box[1], [FARTHEST], most, np.full(costs, FARTHEST)])
        solved = least(cost, np.full(len(cost), PROXIMAL), A, top, (lower, upper))
        if solved is None:
            return None
        now = np.concatenate([np.zeros(count), [0.0], most, np.abs(self.changed[0])[: costs or 0]])
        return solved.at[:count], float(cost @ (now - solved.at)), solved

    @property
    def _weight(self) -> float:
        """Weight of t."""
        return 1.0 if self.demands.objective in (Objective.CYCLE, Objective.CLEARANCE) else 0.0

    @property
    def _costs(self) -> int:
        """Number of variables that stand for the costs of changes."""
        return len(self.box[0]) if self.demands.objective is Objective.CHANGE else 0

    def _families(self, lacks: Array, aims: Array) -> tuple[Array, Array]:
        """Which slack each row has, -1 for none, and the most that each slack may be: what is missed now.

        Rows about one joint or one pair share theirs.
        """
        kinds = np.repeat(np.arange(len(self.rows)), [len(each.lacks) for each in self.rows])
        subjects = np.concatenate([np.zeros(0, dtype=np.intp), *(each.subjects for each in self.rows)])
        is_violated: Flags = (lacks > 0.0) & (aims == 0.0)
        family = np.full(len(lacks), -1)
        labels = np.stack([kinds, subjects], axis=1)[is_violated]
        found, which = np.unique(labels, axis=0, return_inverse=True) if len(labels) else (labels, np.zeros(0, int))
        family[is_violated] = which
        most = np.zeros(len(found))
        np.maximum.at(most, which, lacks[is_violated])
        return family, most

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
