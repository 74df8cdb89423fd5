"""What binds at a point, and what each variable does there: the multipliers and gradients of the last program."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.search.programs.measures import ANGLE, LENGTH, SHARE, SINGULAR, MeasureKind, Measures
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import Point, Problem
from cellplan.search.programs.program import LinearProgram
from cellplan.search.programs.rows import ConstraintRows, Linear, PacedRows

NEAR: Final = 0.02  # [-] usual steps of the region in which the multipliers hold
COUNTS: Final = 1e-6  # [-] multiplier from which on a row binds


@dataclass(frozen=True, slots=True, kw_only=True)
class BindingRow:
    """A demand that keeps the objective from being better."""

    kind: MeasureKind  # what it is about
    names: tuple[str, str]  # robot and joint, the two bodies, or the robot whose singular values they are
    time: float  # when, in [s] on the clock of the nodes
    share: float  # of the objective's gradient; for the cycle of speeds and accelerations, adding up to 1
    gain: float | None  # of the objective per SI unit, or share, demanded less; None for the objective itself


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Explanation:
    """What binds at a point and what each variable does.

    Attributes:
        held: How fast the objective still falls along each variable with all demands kept, shape (n,): not 0 only where
            the variable is at its bound, or the point is no local optimum.
    """

    binding: tuple[BindingRow, ...]  # what binds, the largest share first
    by_variable: Array  # derivatives of the objective by the variables in SI, whatever else is demanded, shape (n,)
    held: Array


def explain(problem: Problem, point: Point, demands: Demands, effort: Effort) -> Explanation | None:
    """What binds at a point; None where the program there has no solution."""
    measures = Measures.of(problem, point, demands, effort)
    program = LinearProgram.of(Linear.of(problem, measures), demands, effort.reserve, NEAR).priced(1.0)
    step = program.solve()
    if step is None:
        return None
    solved, unit = step.solved, _unit(measures, demands)
    binding, gradient, at = list[BindingRow](), np.zeros(len(point.x)), 0
    for rows in program.rows:
        multipliers = solved.multipliers[at : at + len(rows.violations)]
        at += len(rows.violations)
        if rows.aim or isinstance(rows, PacedRows):
            gradient += (multipliers @ rows.gradients)[: len(gradient)]
        binding += _bound(problem, measures, rows, multipliers, unit)
    if demands.objective is Objective.CHANGE:
        gradient = np.sign(point.x - problem.given) * problem.cost * problem.scale
    return Explanation(
        binding=tuple(sorted(binding, key=lambda binding: -binding.share)),
        by_variable=gradient * unit / problem.scale,
        held=solved.of_bounds[: len(point.x)] * unit / problem.scale,
    )


def _unit(measures: Measures, demands: Demands) -> float:
    """The objective that one unit of a program's is, in [s], [m] or cost."""
    match demands.objective:
        case Objective.CYCLE:
            return measures.cycle
        case Objective.CLEARANCE:
            return LENGTH
        case _:
            return 1.0


def _bound(
    problem: Problem, measures: Measures, rows: ConstraintRows, multipliers: Array, unit: float
) -> list[BindingRow]:
    units = {
        MeasureKind.DISTANCE: LENGTH,
        MeasureKind.LOWER_LIMIT: ANGLE,
        MeasureKind.UPPER_LIMIT: ANGLE,
        MeasureKind.SINGULAR: SINGULAR,
    }
    bindings = list[BindingRow]()
    if rows.kind in {MeasureKind.DURATION, MeasureKind.CYCLE}:
        return []
    for row in np.flatnonzero(multipliers > COUNTS).tolist():
        subject, size = int(rows.subjects[row]), units.get(rows.kind, SHARE)
        if size == ANGLE and not problem.limits.is_revolute[subject]:
            size = LENGTH
        bindings.append(
            BindingRow(
                kind=rows.kind,
                names=_names(problem, rows.kind, subject, measures),
                time=float(problem.times[rows.nodes[row]]),
                share=float(multipliers[row]),
                gain=None if rows.aim or isinstance(rows, PacedRows) else float(multipliers[row]) * unit / size,
            )
        )
    return bindings


def _names(problem: Problem, kind: MeasureKind, subject: int, measures: Measures) -> tuple[str, str]:
    """What a row is about."""
    if kind is MeasureKind.SINGULAR and measures.arms is not None:
        return measures.arms.names[subject], "singular values"
    return problem.pair_names(subject) if kind is MeasureKind.DISTANCE else problem.joint_names(subject)
