"""A rehearsal as text, plots, page, tables and files: what is shown, and in which order."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.files.cell.write import render_cell
from cellplan.files.run.folder import RunFolder
from cellplan.files.run.joint_tables import program_digest
from cellplan.geometry.transforms import Array
from cellplan.jobs.rehearsal.record import EXECUTIONS, Pick, rehearsal_record
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.rehearsal import Rehearsal, RunRehearsal
from cellplan.model.report.report import TaskAccuracy
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import cell_page, inline_plots
from cellplan.report.plots.errors import ORIENTATION, POSITION, ErrorKind, error_axis, error_panels, readable_unit
from cellplan.report.plots.figure import (
    Figure,
    Item,
    Limit,
    PlotAxis,
    PlotCurve,
    PlotMark,
    PlotPanel,
    time_axis,
    value_axis,
)
from cellplan.report.plots.palette import CLASSES, INK, LIMIT, ROBOTS
from cellplan.report.plots.rendering import pictures
from cellplan.report.record.common import CheckRecord, Provenance, Record, as_json
from cellplan.report.record.numbers import seconds, small
from cellplan.report.record.rows import by_name, columns_of, listed_table
from cellplan.runs.write_run import versions

TITLES: Final = {"before": "as solved", "after": "corrected from pass to pass", "in_pass": "corrected within the pass"}
ON_TERMINAL: Final = {**TITLES, "after": "corrected"}
OUTCOMES: Final = {
    "converged": "converged",
    "stalled": "does not converge: the error stopped decreasing",
    "diverged": "does not converge: the error grew, or the corrected references cannot be followed",
    "unfinished": "has not converged: allow more --rounds",
}
_JOINT_FIGURES: Final = (("error", "deg", "deg"), ("error", "mm", "mm"), ("torque", "nm", "N m"), ("torque", "n", "N"))
ON_PAGE: Final = OUTCOMES | {
    "stalled": "does not converge: the error stopped decreasing above the tolerance",
    "unfinished": "has not converged within the allowed rounds",
}


# Text


def summary_lines(record: Record, folder: Path) -> list[str]:
    """All lines about one rehearsal."""
    cells = "one real cell" if record["trials"] == 1 else f"{record['trials']} real cells"
    return [
        f"{record['cell']}: {record['status']}",
        f"  mode {record['mode']}, {seconds(record['cycle_time_s'])} s, rehearsed on {cells}, seed {record['seed']}",
        *(f"  simulated arm {line}" for line in simulated_lines(record)),
        *_task_lines(record),
        *_repeatability_lines(record["tasks"]),
        *_round_lines(record["runs"]),
        *(f"  FAILED {check['message']}" for check in record["checks"] if not check["passed"]),
        *(f"  {line}" for line in record["not_in_program"]),
        f"report: {folder / 'rehearsal.html'}",
        *([f"tables: {folder / 'tables'}"] if record["tables_released"] else []),
    ]


def _task_lines(record: Record) -> Iterator[str]:
    for name, task in record["tasks"].items():
        for key, title in ON_TERMINAL.items():
            place, errors = f"  task {name} ({task['robot']}), {title}", task[key]
            if errors is not None:
                position, orientation = errors["max_position_error_mm"], errors["max_orientation_error_deg"]
                lost = record["trials"] - errors["trials"]
                yield f"{place}: true error {small(position)} mm, {small(orientation)} deg" + (
                    f", path lost in {lost} trials" if lost else ""
                )
            elif key == "in_pass" and record["in_pass"]:
                yield f"{place}: the path was lost"


def simulated_lines(record: Record) -> Iterator[str]:
    """The largest joint error and the largest torque of each simulated arm, with their joints."""
    for robot, joints in record["simulated"].items():
        figures = [(key, value, name) for name, joint in joints.items() for key, value in joint.items()]
        words = []
        for kind, unit, printed in _JOINT_FIGURES:
            stated = [(value, name) for key, value, name in figures if key == f"max_{kind}_{unit}"]
            if stated:
                value, name = max(stated)
                words.append(f"{kind} {small(value)} {printed} ({name})")
        yield f"{robot}: joint {', '.join(words)}"


def _repeatability_lines(tasks: Record) -> Iterator[str]:
    """Path accuracy and repeatability where there is more than one trial."""
    for name, task in tasks.items():
        for key, figures in task["iso_9283"].items():
            if figures is not None and figures["RT_p_mm"] is not None:
                accuracy, spread = figures["AT_p_mm"], figures["RT_p_mm"]
                yield f"  task {name}, {ON_TERMINAL[key]}: AT_p {small(accuracy)} mm, RT_p {small(spread)} mm"


def _round_lines(runs: Iterable[Record]) -> Iterator[str]:
    """Outcome of the correction: the convergence table of a single cell, or the count of each outcome."""
    for run in runs:
        where = f"{run['name']}: " if run["name"] else ""
        corrections = [trial["correction"] for trial in run["trials"] if trial["correction"] is not None]
        for outcome, text in OUTCOMES.items():
            count = sum(correction["outcome"] == outcome for correction in corrections)
            if count:
                share = f" in {count} of {len(corrections)} trials" if len(corrections) > 1 else ""
                yield f"  {where}feedback {text}{share}"
        if len(corrections) == 1:
            for made in corrections[0]["rounds"]:
                share = small(made["share_of_tolerance"])
                yield f"    round {made['round']}: largest true error {share} of its tolerance"


# Plots and page


def rehearsal_figures(rehearsal: Rehearsal) -> dict[str, Figure]:
    """All figures by name (``before_<task>``, ``after_<task>``, ``rounds_<task>``, …)."""
    figures: dict[str, Figure] = {}
    for run in rehearsal.runs:
        for place, errors in enumerate(run.trials[0].before):
            for name, pick in EXECUTIONS.items():
                figures |= _execution_figures(rehearsal.cell, run, place, name=name, pick=pick)
            figures |= _round_figures(rehearsal.cell, run, errors.task)
        figures |= _joint_figures(rehearsal, run)
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
    allowed = task.tolerance
    panels = error_panels(run.times, worst.position_error, allowed=allowed.position_mm.si, kind=POSITION)
    panels += error_panels(run.times, worst.orientation_error, allowed=allowed.orientation_deg.si, kind=ORIENTATION)
    figures = {f"{name}_{task.name}": Figure(title=title, x=time_axis(run.times), panels=panels, columns=2)}
    if len(selected) > 1:
        figures |= _envelope_figures(run, [errors for _, errors in selected], name=name)
    return figures


def _joint_figures(rehearsal: Rehearsal, run: RunRehearsal) -> dict[str, Figure]:
    """Joint errors of the simulated arms over time, in the first trial."""
    cell, simulation, joints = rehearsal.cell, rehearsal.errors.simulation, run.trials[0].joints
    if simulation is None or joints is None:
        return {}
    figures = {}
    for name in simulation.robots:
        axes, columns = cell.robot(name).model.joints, cell.columns(name)
        scales = np.array([joint.display_unit.scale for joint in axes])
        errors = scales * (joints.executed - joints.commanded)[:, columns]
        limit = max(float(np.abs(errors).max()), 1e-12)
        units = " or ".join(dict.fromkeys(joint.display_unit.name for joint in axes))
        panel = PlotPanel(
            title=f"executed less commanded, in {units}",
            y=value_axis(-limit, limit, unit=units),
            items=[
                PlotCurve(joint.name, run.times, errors[:, index], ROBOTS[index % len(ROBOTS)])
                for index, joint in enumerate(axes)
            ],
        )
        figures["_".join(["joints", *re.findall(r"[\w-]+", f"{run.name or ''} {name}")])] = Figure(
            title=f"{name}: joint errors of the simulated arm", x=time_axis(run.times), panels=[panel], columns=1
        )
    return figures


def _envelope_figures(run: RunRehearsal, selected: Sequence[TaskAccuracy], *, name: str) -> dict[str, Figure]:
    """Largest, mean and smallest error of all trials over time."""
    task = selected[0].task
    title = f"{task}: largest, mean and smallest true error of {len(selected)} trials, {TITLES[name]}"
    position = np.stack([np.linalg.norm(errors.position_error, axis=1) for errors in selected])
    orientation = np.stack([np.linalg.norm(errors.orientation_error, axis=1) for errors in selected])
    panels = [_range(run.times, position, kind=POSITION), _range(run.times, orientation, kind=ORIENTATION)]
    return {f"envelope_{name}_{task}": Figure(title=title, x=time_axis(run.times), panels=panels, columns=2)}


def _range(times: Array, lengths: Array, *, kind: ErrorKind) -> PlotPanel:
    """Range of error lengths, shape (T, N)."""
    largest = float(lengths.max())
    unit, scale = readable_unit(largest, kind.units)
    return PlotPanel(
        title=f"{kind.name}, in {unit}",
        y=value_axis(0.0, scale * largest or 1.0, unit=unit, is_floored=True),
        items=[
            PlotCurve("largest", times, scale * lengths.max(axis=0), LIMIT),
            PlotCurve("mean", times, scale * lengths.mean(axis=0), INK),
            PlotCurve("smallest", times, scale * lengths.min(axis=0), CLASSES[0]),
        ],
    )


def _round_figures(cell: Cell, run: RunRehearsal, task: str) -> dict[str, Figure]:
    """Largest true error of one task in each round, on a logarithmic scale, one curve per trial."""
    corrections = [trial.correction for trial in run.trials if trial.correction is not None]
    longest = max((len(correction.rounds) for correction in corrections), default=0)
    if longest < 2:
        return {}
    tolerance = cell.task(task).tolerance
    position = [np.array([1e3 * made.position[task] for made in correction.rounds]) for correction in corrections]
    orientation = [np.degrees([made.orientation[task] for made in correction.rounds]) for correction in corrections]
    figure = Figure(
        title=f"{task}: largest true error by correction round",
        x=PlotAxis(low=0.0, high=longest - 1.0, label="round"),
        panels=[
            _rounds(position, title="position error", unit="mm", allowed=tolerance.position_mm),
            _rounds(orientation, title="orientation error", unit="deg", allowed=tolerance.orientation_deg),
        ],
        columns=2,
    )
    return {f"rounds_{task}": figure}


def _rounds(curves: Sequence[Array], *, title: str, unit: str, allowed: float) -> PlotPanel:
    items: list[Item] = [Limit(allowed, f"tolerance {allowed:.6g} {unit}")]
    for number, curve in enumerate(curves):
        colour, rounds = ROBOTS[number % len(ROBOTS)], np.arange(float(len(curve)))
        items.append(PlotCurve(f"trial {number}", rounds, curve, colour))
        items += [PlotMark(float(made), float(value), colour) for made, value in zip(rounds, curve, strict=True)]
    return PlotPanel(title=f"{title}, in {unit}", y=error_axis(curves, allowed, unit=unit), items=items)


def rehearsal_page(record: Record, *, cell: Cell, plots: Mapping[str, bytes]) -> str:
    """The page of a rehearsal."""
    simulated = list(simulated_lines(record))
    parts = {"plots": inline_plots(plots), "executions": TITLES, "outcomes": ON_PAGE, "simulated": simulated}
    return cell_page("jobs/rehearsal/rehearsal.html", record, cell, parts)


# Files


def write_rehearsal(
    rehearsal: Rehearsal, folder: Path, *, formats: Collection[str] = (), progress: Progress = silent
) -> Record:
    """Write the folder of a rehearsal; it appears whole or not at all.

    It has ``rehearsal.json``, ``rehearsal.html``, ``plots/`` and ``cell.yaml``. Corrected tables stand under
    ``tables/``, or ``tables/<task>/`` where there is one run per task; only when everything passed.

    Args:
        rehearsal: The rehearsal.
        folder: The folder; an older rehearsal there is replaced.
        formats: Further formats of the plots beside SVG: ``png``, ``pdf``; both need matplotlib.
        progress: Called with the stage and the fraction done.

    Returns:
        The record in the ``rehearsal.json`` of the folder.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write; a format cannot be
            written.
    """
    progress("writing the rehearsal", 1.0)
    provenance = Provenance(versions=versions(), digests=_digests(rehearsal))
    plots = pictures(rehearsal_figures(rehearsal), formats)
    record = rehearsal_record(rehearsal, provenance=provenance)
    with RunFolder(folder) as target:
        for name, picture in plots.items():
            target.write_bytes(f"plots/{name}", picture)
        target.write_text("rehearsal.json", as_json(record))
        target.write_text("rehearsal.html", rehearsal_page(record, cell=rehearsal.cell, plots=plots))
        target.write_text("cell.yaml", render_cell(rehearsal.cell))
        for run in rehearsal.runs if rehearsal.is_released else ():
            place = "tables" if run.name is None else f"tables/{run.name}"
            for robot, text in run.corrected.program.tables.items() if run.corrected else ():
                target.write_text(f"{place}/{robot}.csv", text)
    return record


def _digests(rehearsal: Rehearsal) -> dict[str, str]:
    """Digest of the corrected program of each run."""
    return {
        "corrected program" if run.name is None else f"corrected program of {run.name}": program_digest(
            run.corrected.program.tables
        )
        for run in rehearsal.runs
        if run.corrected is not None and rehearsal.is_released
    }


REHEARSAL: Final = ResultKind(
    name="rehearsal",
    title="Rehearsal",
    file="rehearsal.json",
    made_of=Rehearsal,
    record=lambda rehearsal: rehearsal_record(rehearsal, provenance=Provenance(versions={}, digests={})),
    tables=lambda record: {
        "tasks": lambda: columns_of(by_name(record["tasks"], "task")),
        "checks": listed_table(record, "checks", CheckRecord),
    },
    shown={"tasks": ("task", "robot", "before.max_position_error_mm", "after.max_position_error_mm")},
)
