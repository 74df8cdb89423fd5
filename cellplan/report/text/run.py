"""A run as text: verdict, cycle time, worst values, failed checks, and location of the report."""

import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from cellplan.report.record.common import Record
from cellplan.report.text.accelerations import acceleration_lines
from cellplan.report.text.method import DEFAULT_METHOD
from cellplan.report.text.notes import (
    accuracy_note,
    clock_note,
    grip_notes,
    left_out_notes,
    open_surface_notes,
)


def read_record(folder: Path) -> Record:
    """The report of a run on disk."""
    record: Record = json.loads((folder / "report.json").read_text(encoding="utf-8"))
    return record


def summary_lines(record: Record, folder: Path) -> list[str]:
    """All lines about one run folder."""
    return [
        f"{record['cell']}: {record['status']}",
        *figure_lines(record),
        *_failure_lines(record["checks"]),
        *(f"  {line}" for line in record.get("not_in_program", [])),
        *_place_lines(folder),
    ]


def figure_lines(record: Record) -> list[str]:
    """The worst values of a run."""
    return [
        f"  mode {record['mode']}, {record['cycle_time_s']:g} s{_clock_text(record)}{_method_text(record['solver'])}",
        *_program_lines(record),
        *_task_lines(record["tasks"]),
        *_closure_lines(record.get("closure", {})),
        *_margin_lines(record["joints"]),
        *_speed_lines(record["joints"]),
        *acceleration_lines(record),
        *_drift_lines(record.get("repeatability", {})),
        *_clearance_lines(record["clearance"]["whole"]),
        *_slack_lines(record["solver"]["slack"]),
        *_fallback_lines(record["solver"]),
        *(f"  note: {line}" for line in record.get("remarks", [])),
        *(f"  note: {line}" for _, line in open_surface_notes(record.get("open_surfaces", []))),
        *(f"  grip: {line}" for line in grip_notes(record)),
        *(f"  {line}" for line in record.get("rests_on", {}).get("lines", [])),
        *left_out_lines(record),
    ]


def left_out_lines(record: Record) -> list[str]:
    """One line for each kind of pairs that were not judged in full."""
    return [f"  {line}" for line in left_out_notes(record)]


def _clock_text(record: Record) -> str:
    """What determines the duration, unless the cell file states it."""
    note = clock_note(record)
    return f" ({note})" if note else ""


def _method_text(solver: Record) -> str:
    """The method, unless it is the default one."""
    return "" if solver["method"] == DEFAULT_METHOD else f", method {solver['method']}"


def _task_lines(tasks: Record) -> Iterator[str]:
    for name, task in tasks.items():
        position, orientation = _largest(task, "position_error", "mm"), _largest(task, "orientation_error", "deg")
        yield f"  task {name} ({task['robot']}): largest error {_short(position)} mm, {_short(orientation)} deg"


def _closure_lines(closures: Record) -> Iterator[str]:
    for robot, closure in closures.items():
        position, orientation = _largest(closure, "position_error", "mm"), _largest(closure, "orientation_error", "deg")
        yield f"  grasp of {robot}: largest closure error {_short(position)} mm, {_short(orientation)} deg"


def _largest(errors: Record, name: str, unit: str) -> float | None:
    """The larger of an error at the rows and between them."""
    at_rows: float | None = errors[f"max_{name}_{unit}"]
    between: float | None = errors.get(f"max_{name}_between_rows_{unit}")
    return at_rows if at_rows is None or between is None else max(at_rows, between)


def _margin_lines(joints: Record) -> Iterator[str]:
    """The joint with the smallest margin, in degrees and in millimetres."""
    for unit in ("deg", "mm"):
        bounded = [
            (use["margin"], f"{robot} {joint}", use["margin_at_s"])
            for robot, uses in joints.items()
            for joint, use in uses.items()
            if use["unit"] == unit and use["margin"] is not None
        ]
        if bounded:
            margin, joint, at_s = min(bounded)
            yield f"  smallest joint margin {margin:.4g} {unit}: {joint}{_time(at_s)}"


def _speed_lines(joints: Record) -> Iterator[str]:
    driven = [
        (use["velocity_ratio"], f"{robot} {joint}", use["peak_velocity_at_s"])
        for robot, uses in joints.items()
        for joint, use in uses.items()
        if use["velocity_ratio"] is not None
    ]
    if driven:
        ratio, joint, at_s = max(driven)
        yield f"  largest joint speed {100.0 * ratio:.4g} % of its limit: {joint}{_time(at_s)}"


def _program_lines(record: Record) -> Iterator[str]:
    """The phases of a program from home to home, and how its transfer moves were found."""
    if not record.get("cycles"):
        return
    runs, found = record["runs"], record["solver"]["transfers"] or {}
    phases = ", ".join(f"{name} {run['cycle_time_s']:.3f} s" for name, run in runs.items())
    yield f"  from home to home, {record['cycles']} x: {phases}"
    for name, words in found.items():
        yield f"  {name}: {words}"


def _drift_lines(repeatability: Record) -> Iterator[str]:
    """The largest drift of a joint over a cycle; nothing if all joints return."""
    for name, found in repeatability.items():
        if found["closes"]:
            continue
        subject = "all tasks" if name == "all" else f"task {name}"
        of_cycles = f"cycle {{}} of {found['cycles']}" if found["cycles"] > 1 else "the cycle"
        for unit, joint, cycle in (("deg", "joint", "at_cycle"), ("mm", "sliding_joint", "sliding_at_cycle")):
            if f"worst_drift_{unit}" in found:
                where = of_cycles.format(found[cycle])
                drift = found[f"worst_drift_{unit}"]
                yield f"  joint drift {drift:.4g} {unit} in {where} of {subject}: {found[joint]}"


def _clearance_lines(whole: Record) -> Iterator[str]:
    if whole["minimum_mm"] is not None and whole["pair"]:
        first, second = whole["pair"]
        proof = "certified" if whole["certified"] else "not certified"
        least = "" if whole.get("exact", True) else "at least "
        figure = f"{least}{whole['minimum_mm']:.4g} mm, {proof}"
        rests_on = accuracy_note(whole["pair"], whole.get("accuracies_mm"))
        where = f"{first} - {second}{_time(whole['at_s'])}{f', {rests_on}' if rests_on else ''}"
        yield f"  smallest clearance {figure}: {where}"


def _slack_lines(slack: Record | None) -> Iterator[str]:
    """The largest task slack."""
    if slack and slack["max"]:
        yield f"  task slack up to {slack['max']:.2g} ({slack['unit']}){_time(slack['max_at_s'])}"


def _fallback_lines(solver: Record) -> Iterator[str]:
    """The time at which collocation failed."""
    resolution = solver.get("resolution")
    if resolution and solver["integrator"] == "accurate" and resolution["euler_from_s"] is not None:
        lost = resolution.get("lost")
        reason = f"; {lost['message']}" if lost else ""
        yield f"  collocation failed at {resolution['euler_from_s']:.3f} s; continued with Euler steps{reason}"


def _failure_lines(checks: Iterable[Record]) -> Iterator[str]:
    for check in checks:
        if not check["passed"]:
            run = f"{check['run']}: " if check.get("run") else ""
            yield f"  FAILED {run}{check['message']}"


def _place_lines(folder: Path) -> Iterator[str]:
    yield f"report: {folder / 'report.html'}"
    for tables in (folder / "tables", folder / "rejected"):
        if tables.is_dir():
            yield f"tables: {tables}"


def _short(value: float | None) -> str:
    return "unknown" if value is None else f"{value:.2g}"


def _time(at_s: float | None) -> str:
    return "" if at_s is None else f" at {at_s:.3f} s"
