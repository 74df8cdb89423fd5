"""Advice: for each base the step that helps most by the exact derivatives, and what it would do."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.trials.limits import effects, standing_of
from cellplan.model.cell.layout import VariableKind
from cellplan.model.units import MM
from cellplan.report.record.common import Record
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.program import LinearProgram
from cellplan.search.programs.rows import Linear
from cellplan.session.answer import Look
from cellplan.session.variables import LiveVariables

EVERY: Final = 20  # [-] changes: between them the advice is that of a layout close by
TRUST: Final = 2.0  # [-] usual steps of 0.1 m that an arrow is long at most where something is missed
SMALL: Final = 0.2  # [-] likewise where nothing is
SHORTEST: Final = 1e-3  # [m] of an arrow
ALONG: Final = 0.98  # [-] share of a step along an axis that is named by it
AXES: Final = "xyz"
SHOWN: Final = (("margin_deg", "deg margin"), ("clearance_mm", "mm clearance"), ("cycle_s", "s"))
LEAST: Final = {"margin_deg": 0.01, "clearance_mm": 0.01, "cycle_s": 0.001}  # what is not worth saying


class Advice:
    """What would help a block, of a layout that is not many changes old.

    Attributes:
        records: An arrow for each base that may move; empty until they are known.
    """

    def __init__(self) -> None:
        """Begin without any."""
        self.records, self._version = list[Record](), -EVERY
        self._pieces: Iterator[list[Record] | None] = iter(())

    @classmethod
    def of(cls, look: Look, variables: LiveVariables, version: int) -> Self:
        """Advice of a present layout; see ``go_on``."""
        advice = cls()
        while advice.go_on(look, variables, version):
            pass
        return advice

    def go_on(self, look: Look, variables: LiveVariables, version: int) -> bool:
        """A bounded piece of work; False where there is nothing to do until some changes later.

        Args:
            look: The block as it is now.
            variables: What may be changed.
            version: How often it was changed.
        """
        for arrows in self._pieces:
            self.records = self.records if arrows is None else arrows
            return True
        if is_due := version >= self._version + EVERY:
            self._pieces, self._version = _advised(look, variables), version
        return is_due


def _advised(look: Look, variables: LiveVariables) -> Iterator[list[Record] | None]:
    """An arrow for each base that may move: towards what is missed, else towards a shorter cycle.

    They come last, after None for each bounded piece of the work. There are none for a motion that the kernel does not
    have, that breaks off, or is awaited.
    """
    problem, motion = look.block.problem, look.motion
    if problem is None or not motion.is_followed or motion.is_planned or motion.is_awaited:
        yield []
        return
    is_missed = any(not figure.is_met for figure in look.figures)
    span, times = float(motion.times[-1] - motion.times[0]), [it.at for it in look.figures if it.at is not None]
    demands = Demands(
        objective=Objective.CONFORMING if is_missed else Objective.CYCLE,
        margin=np.zeros(motion.q.shape[1]),
        duration=span if is_missed else None,
    )
    standing = standing_of(problem, motion.point(), demands, Effort(also_at=tuple(times)))
    yield None
    linear = Linear.of(problem, standing.measures)
    yield None
    program = LinearProgram.of(linear, demands, Effort().reserve, TRUST if is_missed else SMALL)
    by_variable = {key: _finite(values) for key, values in effects(standing, np.ones(len(motion.x)), linear).items()}
    records = list[Record]()
    for robot, base in enumerate(look.block.cell.robots):
        columns = _columns(variables, base.name)
        steps = variables.ties.steps(variables.layout.tied.ranges, columns)
        dx = _best(program, columns, steps, problem.scale)
        if dx is not None and (length := float(np.linalg.norm(dx[columns]))) >= SHORTEST:
            direction = np.zeros(3)
            for column in columns:
                direction[variables.layout.tied.ranges[column].index] = dx[column] / length
            gains = {key: float(values @ dx) for key, values in by_variable.items()}
            records.append(_record(robot, direction, MM * length, gains))
        yield None
    yield records


def _columns(variables: LiveVariables, robot: str) -> list[int]:
    """Places of the position of a base among the variables, as far as it may move."""
    return [
        column
        for column, variable in enumerate(variables.layout.tied.ranges)
        if variable.kind is VariableKind.BASE
        and variable.name == robot
        and variable.index < (3 if variables.listed[column].is_varied else 2)
        and not variables.listed[column].is_locked
    ]


def _best(program: LinearProgram, columns: list[int], steps: Array, scale: Array) -> Array | None:
    """The best step of some variables alone, with those that follow them; None where there is none.

    Args:
        steps: What steps make of all variables, see ``Ties.steps``.
        scale: Usual steps, shape (n,).

    Returns:
        The step in [m] and [rad], shape (n,).
    """
    count = len(scale)
    whole = np.eye(len(program.box[0]))  # the step has further parts where a motion is timed anew
    whole[:count, :count] = steps * scale / scale[:, None]
    lower, upper = (np.where(np.isin(np.arange(len(whole)), columns), side, 0.0) for side in program.box)
    for column in columns:
        for other in np.flatnonzero(whole[:count, column]).tolist():
            ends = sorted(side[other] / whole[other, column] for side in program.box)
            lower[column], upper[column] = max(lower[column], ends[0]), min(upper[column], ends[1])
    rows = [replace(row, gradients=row.gradients @ whole) for row in program.rows]
    program = replace(program, rows=rows, box=(lower, upper))
    solved = program.priced(program.price).solve() if columns else None
    return None if solved is None else (whole[:count, :count] @ solved.z[:count]) * scale


def _record(robot: int, direction: Array, length: float, gains: dict[str, float]) -> Record:
    """An arrow in plain values."""
    axis = int(np.argmax(np.abs(direction)))
    named = f"{'+' if direction[axis] > 0.0 else '-'}{AXES[axis]}"
    if abs(direction[axis]) < ALONG:
        named = f"({', '.join(f'{component:.2f}' for component in direction + 0.0)})"
    said = [f"{gains[key]:+.3g} {unit}" for key, unit in SHOWN if abs(gains[key]) >= LEAST[key]]
    return {
        "robot": robot,
        "direction": [round(component, 6) + 0.0 for component in direction.tolist()],
        "step_mm": round(length, 3),
        "text": f"{length:.3g} mm along {named}: {', '.join(said) or 'nothing changes much'}",
    }


def _finite(values: list[float | None]) -> Array:
    """Effects, 0 where there is none."""
    return np.array([0.0 if value is None else value for value in values])
