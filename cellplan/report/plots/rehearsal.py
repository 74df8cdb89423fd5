"""Plots of a rehearsal: true errors over time before and after correcting, error per round, envelope of the trials."""

import math
from collections.abc import Sequence

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.rehearsal import Rehearsal, RunRehearsal
from cellplan.model.report import TaskAccuracy
from cellplan.report.plots.palette import CLASSES, INK, LIMIT, ROBOTS
from cellplan.report.plots.run import ORIENTATION, POSITION, ErrorKind, draw_error, readable_unit
from cellplan.report.plots.sheet import Sheet
from cellplan.report.record.rehearsal import EXECUTIONS, Pick

TITLES = {"before": "as solved", "after": "corrected from pass to pass", "in_pass": "corrected within the pass"}
MIN_SHOWN_MM = 1e-12  # errors below it are drawn there: a logarithm needs a floor


def rehearsal_sheets(rehearsal: Rehearsal) -> dict[str, Sheet]:
    """All plots by name (``before_<task>``, ``after_<task>``, ``rounds_<task>``, …)."""
    sheets: dict[str, Sheet] = {}
    for run in rehearsal.runs:
        for place, errors in enumerate(run.trials[0].before):
            for name, pick in EXECUTIONS.items():
                sheets |= _execution_sheets(rehearsal.cell, run, place, name=name, pick=pick)
            sheets |= _round_sheets(rehearsal.cell, run, errors.task)
    return sheets


def _execution_sheets(cell: Cell, run: RunRehearsal, place: int, *, name: str, pick: Pick) -> dict[str, Sheet]:
    """True errors of one task over time in its worst trial, and the envelope of all trials."""
    selected = [(trial, errors[place]) for trial in run.trials if (errors := pick(trial)) is not None]
    if not selected:
        return {}
    task = cell.task(selected[0][1].task)
    first = run.judged_from[task.name]
    largest = [float(np.linalg.norm(errors.position_error[first:], axis=1).max()) for _, errors in selected]
    worst = selected[int(np.argmax(largest))]
    several = f" (worst of {len(selected)} trials)" if len(selected) > 1 else ""
    title = f"{task.name} ({task.robot}): true tool error on the part, {TITLES[name]}{several}"
    sheet = Sheet(title, rows=2, columns=2, times=run.times)
    draw_error(sheet, 0, worst[1].position_error, allowed=task.tolerance.position, kind=POSITION)
    draw_error(sheet, 1, worst[1].orientation_error, allowed=task.tolerance.orientation, kind=ORIENTATION)
    sheets = {f"{name}_{task.name}": sheet}
    if len(selected) > 1:
        sheets |= _envelope_sheets(run, [errors for _, errors in selected], name=name)
    return sheets


def _envelope_sheets(run: RunRehearsal, selected: Sequence[TaskAccuracy], *, name: str) -> dict[str, Sheet]:
    """Largest, mean and smallest error of all trials over time."""
    title = f"{selected[0].task}: largest, mean and smallest true error of {len(selected)} trials, {TITLES[name]}"
    sheet = Sheet(title, rows=1, columns=2, times=run.times)
    position = np.stack([np.linalg.norm(errors.position_error, axis=1) for errors in selected])
    orientation = np.stack([np.linalg.norm(errors.orientation_error, axis=1) for errors in selected])
    _draw_band(sheet, 0, position, kind=POSITION)
    _draw_band(sheet, 1, orientation, kind=ORIENTATION)
    return {f"envelope_{name}_{selected[0].task}": sheet}


def _draw_band(sheet: Sheet, index: int, lengths: Array, *, kind: ErrorKind) -> None:
    """Envelope of error lengths, shape (T, N)."""
    largest = float(lengths.max())
    unit, scale = readable_unit(largest, kind.units)
    panel = sheet.panel(index, f"{kind.name}, in {unit}", span=(0.0, scale * largest or 1.0), is_floored=True)
    for curve, colour in ((lengths.max(axis=0), LIMIT), (lengths.mean(axis=0), INK), (lengths.min(axis=0), CLASSES[0])):
        sheet.curve(panel, sheet.times, scale * curve, colour=colour)


def _round_sheets(cell: Cell, run: RunRehearsal, task: str) -> dict[str, Sheet]:
    """Largest true error of one task in each round, on a logarithmic scale, one curve per trial."""
    corrections = [trial.correction for trial in run.trials if trial.correction is not None]
    longest = max((len(correction.rounds) for correction in corrections), default=0)
    if longest < 2:
        return {}
    sheet = Sheet(
        f"{task}: largest true error by correction round",
        rows=1,
        columns=2,
        times=np.arange(float(longest)),
        across="round",
    )
    tolerance = cell.task(task).tolerance
    position = [[1e3 * made.position[task] for made in correction.rounds] for correction in corrections]
    orientation = [[math.degrees(made.orientation[task]) for made in correction.rounds] for correction in corrections]
    _draw_decades(sheet, 0, position, title="position error in mm", allowed=1e3 * tolerance.position)
    _draw_decades(sheet, 1, orientation, title="orientation error in deg", allowed=math.degrees(tolerance.orientation))
    return {f"rounds_{task}": sheet}


def _draw_decades(sheet: Sheet, index: int, curves: Sequence[Sequence[float]], *, title: str, allowed: float) -> None:
    """Errors by round as powers of ten."""
    decades = [np.log10(np.maximum(curve, MIN_SHOWN_MM)) for curve in curves]
    limit = math.log10(max(allowed, MIN_SHOWN_MM))
    low = min(limit, *(float(curve.min()) for curve in decades))
    high = max(limit, *(float(curve.max()) for curve in decades))
    panel = sheet.panel(index, f"log10 of the {title}", note=f"allowed {allowed:g}", span=(low, high))
    sheet.limit(panel, limit)
    for number, curve in enumerate(decades):
        rounds = np.arange(float(len(curve)))
        sheet.curve(panel, rounds, curve, colour=ROBOTS[number % len(ROBOTS)])
        for made, value in zip(rounds, curve, strict=True):
            sheet.dot(panel, float(made), float(value), colour=ROBOTS[number % len(ROBOTS)])
