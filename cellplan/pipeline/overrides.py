"""What the command line may change of a cell before it is solved."""

from collections.abc import Iterable
from dataclasses import replace
from difflib import get_close_matches
from typing import cast, get_args

from cellplan.errors import InputError, InvalidFileError
from cellplan.model.cell import Cell, Mode
from cellplan.model.cell_errors import CellErrors
from cellplan.model.solver import ACCURATE_METHODS, NULL_SPACE_METHODS, Integrator, MethodName

FARTHEST_MM = 10_000.0  # as in the cell file
LONGEST = 1e6  # [s] as in the cell file


def with_overrides(
    cell: Cell,
    *,
    mode: str | None = None,
    method: str | None = None,
    integrator: str | None = None,
    duration: float | None = None,
    clearance_mm: float | None = None,
) -> Cell:
    """The cell with other choices; what is None stays as it is.

    Args:
        cell: The cell as written.
        mode: Who moves.
        method: Resolution method. A cell that does not name its integrator takes the one that goes with the method.
        integrator: How joint speeds become positions.
        duration: Length of the common clock in [s]: the same as ``motion.duration_s`` in the cell file.
        clearance_mm: Smallest allowed distance in [mm] between things that must not touch.

    Raises:
        InputError: A choice does not exist, or makes no sense.
    """
    written = cell.solver.method
    if mode is not None:
        motion = replace(cell.motion, mode=Mode(_known("--mode", mode, [str(each) for each in Mode])))
        cell = replace(cell, motion=motion)
    if method is not None:
        cell = _with_method(cell, cast(MethodName, _known("--method", method, get_args(MethodName))))
    if integrator is not None:
        cell = _with_integrator(cell, integrator, is_new_method=method is not None)
    elif cell.solver.method != written:
        cell = _with_fitting_integrator(cell)
    if duration is not None:
        cell = _with_duration(cell, duration)
    if clearance_mm is not None:
        if not 0.0 <= clearance_mm <= FARTHEST_MM:
            raise InputError(f"--clearance-mm: expected a number from 0 to {FARTHEST_MM:g}, got {clearance_mm:g}")
        cell = replace(cell, checks=replace(cell.checks, clearance=clearance_mm / 1e3))
    return cell


def with_draws(errors: CellErrors, *, trials: int | None = None, seed: int | None = None) -> CellErrors:
    """The errors with another number of trials or another seed; what is None stays as it is.

    Raises:
        InputError: A number makes no sense.
    """
    for option, given, least in (("--trials", trials, 1), ("--seed", seed, 0)):
        if given is not None and given < least:
            raise InputError(f"{option}: expected a whole number of at least {least}, got {given}")
    return replace(
        errors,
        trials=errors.trials if trials is None else trials,
        seed=errors.seed if seed is None else seed,
    )


def require_task(cell: Cell, name: str | None) -> None:
    """Refuse the name of a task that the cell does not have.

    Raises:
        InputError: There is no such task.
    """
    if name is not None:
        _known("--task", name, [task.name for task in cell.tasks])


def _with_method(cell: Cell, name: MethodName) -> Cell:
    """The cell with another resolution method, which must be able to do all that is asked."""
    asked = ["solver.secondary"] * bool(cell.solver.goals) + ["motion.cyclic"] * cell.motion.cyclic
    if asked and name not in NULL_SPACE_METHODS:
        raise InputError(
            f"--method: expected a method that leaves room besides the tasks, as {cell.origin.at(asked[0])} asks for "
            f"it ({', '.join(sorted(NULL_SPACE_METHODS))}), got '{name}'"
        )
    return replace(cell, solver=replace(cell.solver, method=name))


def _with_integrator(cell: Cell, name: str, *, is_new_method: bool) -> Cell:
    """The cell with another integrator, which must go with all that is asked of the solver."""
    integrator = Integrator(_known("--integrator", name, [str(each) for each in Integrator]))
    if integrator is Integrator.ACCURATE:
        findings = [InputError(_why_not(cell, key, is_new_method)) for key in cell.solver.against_accurate]
        if findings:
            raise findings[0] if len(findings) == 1 else InvalidFileError(findings)
    return replace(cell, solver=replace(cell.solver, integrator=integrator))


def _why_not(cell: Cell, key: str, is_new_method: bool) -> str:
    """What rules the accurate mode out, where it stands, and what helps."""
    place, methods = cell.origin.at(f"solver.{key}"), ", ".join(sorted(ACCURATE_METHODS))
    if key == "method" and is_new_method:
        return f"--method: expected {methods} with --integrator accurate, got '{cell.solver.method}'"
    if key == "method":
        found = f"{place} is '{cell.solver.method}'"
        return f"--integrator: expected euler, as {found}, got 'accurate'; add --method {methods}"
    what = "goals besides the tasks" if key == "secondary" else "joint weights that change along the motion"
    return f"--integrator: expected euler, as {place} asks for {what}, got 'accurate'; remove them from the cell"


def _with_fitting_integrator(cell: Cell) -> Cell:
    """The cell with the integrator that its new method calls for, unless it names one itself."""
    key = "solver.integrator"
    if key in cell.origin.lines or not cell.origin.document:
        if cell.solver.integrator is Integrator.ACCURATE and cell.solver.against_accurate:
            raise InputError(
                f"--method: expected {', '.join(sorted(ACCURATE_METHODS))}, as {cell.origin.at(key)} asks for the "
                f"accurate mode, got '{cell.solver.method}'; add --integrator euler"
            )
        return cell
    integrator = Integrator.EULER if cell.solver.against_accurate else Integrator.ACCURATE
    return replace(cell, solver=replace(cell.solver, integrator=integrator))


def _with_duration(cell: Cell, duration: float) -> Cell:
    """The cell on a clock of another length, as if the cell file gave it as ``motion.duration_s``."""
    step = cell.motion.step
    if not step <= duration <= LONGEST:
        raise InputError(
            f"--duration: expected a number of seconds from {step:g} (motion.step_s) to {LONGEST:g}, got {duration:g}"
        )
    return replace(cell, motion=replace(cell.motion, duration=duration))


def _known(option: str, given: str, allowed: Iterable[str]) -> str:
    """The given word if it is allowed, else an error that offers the nearest one."""
    words = list(allowed)
    if given in words:
        return given
    near = get_close_matches(given, words, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    raise InputError(f"{option}: expected one of {', '.join(words)}, got '{given}'{hint}")
