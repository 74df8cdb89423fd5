"""True errors: how far the tools of real cells are from their tasks, judged by the tasks' tolerances."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.rehearsal import RunRehearsal
from cellplan.model.report import Check, TaskAccuracy
from cellplan.model.units import DEGREES, MILLIMETRES

KINDS: Final = (("position", MILLIMETRES), ("orientation", DEGREES))


def largest(errors: Array, first: int) -> float:
    """Largest length of error vectors, shape (N, 3), from a sample on."""
    return float(np.linalg.norm(errors[first:], axis=1).max())


def worst_share(cell: Cell, accuracy: Sequence[TaskAccuracy], judged_from: Mapping[str, int]) -> float:
    """Largest error of all tasks as a share of its tolerance; an error where none is allowed is infinite."""
    shares = [0.0]
    for errors in accuracy:
        tolerance, first = cell.task(errors.task).tolerance, judged_from[errors.task]
        for error, allowed in (
            (largest(errors.position_error, first), tolerance.position_mm.si),
            (largest(errors.orientation_error, first), tolerance.orientation_deg.si),
        ):
            shares.append(error / allowed if allowed > 0.0 else np.inf if error > 0.0 else 0.0)
    return max(shares)


def check_true_errors(cell: Cell, run: RunRehearsal) -> tuple[Check, ...]:
    """Position and orientation error of each task of a run, at its worst over all trials, against its tolerance."""
    return tuple(
        _check(cell, run, place, kind) for place in range(len(run.trials[0].final)) for kind in range(len(KINDS))
    )


def _check(cell: Cell, run: RunRehearsal, place: int, kind: int) -> Check:
    """One error of one task."""
    name, (unit, scale) = KINDS[kind]
    errors = [trial.final[place] for trial in run.trials]
    task = cell.task(errors[0].task)
    first = run.judged_from[task.name]
    series = np.stack(
        [np.linalg.norm((error.position_error, error.orientation_error)[kind][first:], axis=1) for error in errors]
    )
    trial, sample = np.unravel_index(int(np.argmax(series)), series.shape)
    value, at_s = scale * float(series[trial, sample]), float(run.times[first + sample])
    limit = scale * (task.tolerance.position_mm.si, task.tolerance.orientation_deg.si)[kind]
    after = " after correction" if run.trials[0].correction is not None else ""
    which = f" in trial {trial + 1} of {len(errors)}" if len(errors) > 1 else ""
    return Check(
        name=f"true_{name}_error",
        subject=task.name,
        passed=value <= limit,
        value=value,
        limit=limit,
        unit=unit,
        at_s=at_s,
        message=f"true {name} error of task '{task.name}'{after}: {value:.3g} {unit} at {at_s:.3f} s{which}, "
        f"allowed {limit:g} {unit}",
    )
