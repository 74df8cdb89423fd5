"""Solving a paper's cell and keeping its curves: path, errors, joints, conditioning."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cellplan.planning.methods
from cellplan import Cell, Report, load_cell, solve

Array = NDArray[np.float64]
Numbers = dict[str, Any]  # what was measured, by name: numbers, truths, lists of numbers, or more of these
FOLDER = Path(__file__).resolve().parent
PAPERS = FOLDER.parent.parent / "cells" / "papers"
OWN_METHODS = FOLDER / "methods"  # resolution methods that only these pages compare
DIGITS = 3  # [-] of a recorded figure: what the page can show; the rest depends on the processor's rounding
NOTHING = 1e-12  # smaller figures are rounding, and recorded as zero


@dataclass(frozen=True, kw_only=True, eq=False)
class Curves:
    """One run of one arm's only task, in SI units.

    Attributes:
        t: Times, shape (N,).
        q: Joint positions, shape (N, n).
        desired: Reference place of the tool, shape (N, 3).
        actual: Actual place of the tool, shape (N, 3).
        turn: Angle from the desired orientation, shape (N,).
        report: The whole report.
        iterations: Evaluations, rounds or moves of each step, shape (N - 1,); None where the method counts none.
    """

    t: Array
    q: Array
    desired: Array
    actual: Array
    turn: Array
    report: Report
    iterations: Array | None

    @property
    def error(self) -> Array:
        """Distance from the desired place, shape (N,)."""
        return np.asarray(np.linalg.norm(self.desired - self.actual, axis=1))

    @property
    def between(self) -> Array:
        """Middle of each step, shape (N - 1,)."""
        return 0.5 * (self.t[1:] + self.t[:-1])

    @property
    def qd(self) -> Array:
        """Joint speeds in each step, shape (N - 1, n)."""
        return np.diff(self.q, axis=0) / np.diff(self.t)[:, None]

    @property
    def qdd(self) -> Array:
        """Joint accelerations at the inner samples, shape (N - 2, n)."""
        return np.diff(self.qd, axis=0) / np.diff(self.between)[:, None]

    def after(self, instant: float) -> NDArray[np.bool_]:
        """Which times are not before the given one."""
        return np.asarray(self.t >= instant - 1e-9)


def paper_cell(name: str, *, method: str | None = None, values: Mapping[str, object] | None = None) -> Cell:
    """A cell of ``cells/papers``, as ``--set`` and ``--method`` would change it; also by a method of these pages."""
    cell = load_cell(PAPERS / f"{name}.yaml")
    if values is not None:
        cell = cell.with_values(values)
    if method is not None and str(OWN_METHODS) not in cellplan.planning.methods.__path__:
        cellplan.planning.methods.__path__.append(str(OWN_METHODS))
    return cell if method is None else replace(cell, solver=cell.solver.model_copy(update={"method": method}))


def curves(cell: Cell) -> Curves:
    """Solve a cell with one arm and one task."""
    (run,) = solve(cell).runs
    (accuracy,) = run.report.accuracy
    desired = run.schedule.tasks[0].X_PT[:, :3, 3]
    return Curves(
        t=run.report.times,
        q=run.report.q[cell.robots[0].name],
        desired=desired,
        actual=desired - accuracy.position_error,
        turn=np.asarray(np.linalg.norm(accuracy.orientation_error, axis=1)),
        report=run.report,
        iterations=run.motion.iterations,
    )


def rounded(numbers: Any) -> Any:
    """The same numbers with the digits that are recorded."""
    if isinstance(numbers, dict):
        return {name: rounded(value) for name, value in numbers.items()}
    if isinstance(numbers, list | tuple | np.ndarray):
        return [rounded(value) for value in numbers]
    if isinstance(numbers, bool | np.bool_ | str):
        return numbers if isinstance(numbers, str) else bool(numbers)
    return 0.0 if abs(numbers) < NOTHING else float(f"{numbers:.{DIGITS}g}")
