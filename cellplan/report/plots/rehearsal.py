"""Figures of a rehearsal: true errors over time before and after correcting, error per round, range of the trials."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.rehearsal import Rehearsal, RunRehearsal
from cellplan.model.report import TaskAccuracy
from cellplan.report.plots.errors import ORIENTATION, POSITION, ErrorKind, error_axis, error_panels, readable_unit
from cellplan.report.plots.figure import Axis, Curve, Figure, Item, Limit, Mark, Panel, time_axis, value_axis
from cellplan.report.plots.palette import CLASSES, INK, LIMIT, ROBOTS
from cellplan.report.record.rehearsal import EXECUTIONS, Pick

TITLES: Final = {"before": "as solved", "after": "corrected from pass to pass", "in_pass": "corrected within the pass"}


def rehearsal_figures(rehearsal: Rehearsal) -> dict[str, Figure]:
    """All figures by name (``before_<task>``, ``after_<task>``, ``rounds_<task>``, …)."""
    figures: dict[str, Figure] = {}
    for run in rehearsal.runs:
        for place, errors in enumerate(run.trials[0].before):
            for name, pick in EXECUTIONS.items():
                figures |= _execution_figures(rehearsal.cell, run, place, name=name, pick=pick)
            figures |= _round_figures(rehearsal.cell, run, errors.task)
    return figures


def _execution_figures(cell: Cell, run: RunRehearsal, place: int, *, name: str, pick: Pick) -> dict[str, Figure]:
    """True errors of one task over time in its worst trial, and the range of all trials."""
    selected = [(trial, errors[place]) for trial in run.trials if (errors := pick(trial)) is not None]
    if not selected:
        return {}
    task = cell.task(selected[0][1].task)
    first = run.judged_from[task.name]
    largest = [float(np.linalg.norm(errors.position_error[first:], axis=1).max()) for _, errors in selected]
    worst = selected[int(np.argmax(largest))][1]
    several = f" (worst of {len(selected)} trials)" if len(selected) > 1 else ""
    title = f"{task.name} ({task.robot}): true tool error on the part, {TITLES[name]}{several}"
    panels = error_panels(run.times, worst.position_error, allowed=task.tolerance.position, kind=POSITION)
    panels += error_panels(run.times, worst.orientation_error, allowed=task.tolerance.orientation, kind=ORIENTATION)
    figures = {f"{name}_{task.name}": Figure(title=title, x=time_axis(run.times), panels=panels, columns=2)}
    if len(selected) > 1:
        figures |= _envelope_figures(run, [errors for _, errors in selected], name=name)
    return figures


def _envelope_figures(run: RunRehearsal, selected: Sequence[TaskAccuracy], *, name: str) -> dict[str, Figure]:
    """Largest, mean and smallest error of all trials over time."""
    task = selected[0].task
    title = f"{task}: largest, mean and smallest true error of {len(selected)} trials, {TITLES[name]}"
    position = np.stack([np.linalg.norm(errors.position_error, axis=1) for errors in selected])
    orientation = np.stack([np.linalg.norm(errors.orientation_error, axis=1) for errors in selected])
    panels = [_range(run.times, position, kind=POSITION), _range(run.times, orientation, kind=ORIENTATION)]
    return {f"envelope_{name}_{task}": Figure(title=title, x=time_axis(run.times), panels=panels, columns=2)}


def _range(times: Array, lengths: Array, *, kind: ErrorKind) -> Panel:
    """Range of error lengths, shape (T, N)."""
    largest = float(lengths.max())
    unit, scale = readable_unit(largest, kind.units)
    return Panel(
        title=f"{kind.name}, in {unit}",
        y=value_axis(0.0, scale * largest or 1.0, unit=unit, is_floored=True),
        items=[
            Curve("largest", times, scale * lengths.max(axis=0), LIMIT),
            Curve("mean", times, scale * lengths.mean(axis=0), INK),
            Curve("smallest", times, scale * lengths.min(axis=0), CLASSES[0]),
        ],
    )


def _round_figures(cell: Cell, run: RunRehearsal, task: str) -> dict[str, Figure]:
    """Largest true error of one task in each round, on a logarithmic scale, one curve per trial."""
    corrections = [trial.correction for trial in run.trials if trial.correction is not None]
    longest = max((len(correction.rounds) for correction in corrections), default=0)
    if longest < 2:
        return {}
    tolerance = cell.task(task).tolerance
    position = [np.array([1e3 * made.position[task] for made in each.rounds]) for each in corrections]
    orientation = [np.degrees([made.orientation[task] for made in each.rounds]) for each in corrections]
    figure = Figure(
        title=f"{task}: largest true error by correction round",
        x=Axis(low=0.0, high=longest - 1.0, label="round"),
        panels=[
            _rounds(position, title="position error", unit="mm", allowed=1e3 * tolerance.position),
            _rounds(orientation, title="orientation error", unit="deg", allowed=math.degrees(tolerance.orientation)),
        ],
        columns=2,
    )
    return {f"rounds_{task}": figure}


def _rounds(curves: Sequence[Array], *, title: str, unit: str, allowed: float) -> Panel:
    """Errors by round."""
    items: list[Item] = [Limit(allowed, f"tolerance {allowed:.6g} {unit}")]
    for number, curve in enumerate(curves):
        colour, rounds = ROBOTS[number % len(ROBOTS)], np.arange(float(len(curve)))
        items.append(Curve(f"trial {number}", rounds, curve, colour))
        items += [Mark(float(made), float(value), colour) for made, value in zip(rounds, curve, strict=True)]
    return Panel(title=f"{title}, in {unit}", y=error_axis(curves, allowed, unit=unit), items=items)
