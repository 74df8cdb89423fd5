"""``report.json``: the record of a run for scripts; plain JSON in printed units, the same bytes for the same run."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

from cellplan.model.cell import Cell
from cellplan.model.motion import Motion
from cellplan.model.report import CAUTION, ClearanceClass, ClearanceMinimum, JointUse, Report
from cellplan.report.record.accelerations import acceleration_parts, merge_accelerations
from cellplan.report.record.clearance import clearance_proof_record, closest_pairs_record
from cellplan.report.record.clock import clock_from
from cellplan.report.record.closure import closures_record, worst_closures_record
from cellplan.report.record.idle import missing_moves
from cellplan.report.record.left_out import left_out_record
from cellplan.report.record.method import solver_record
from cellplan.report.record.open_surfaces import open_surfaces_record
from cellplan.report.record.payload import worst_loads
from cellplan.report.record.rests_on import rests_on_record, with_accuracies
from cellplan.report.record.run import (
    SCHEMA,
    Provenance,
    Record,
    check_record,
    clearance_record,
    joints_record,
    number,
    origin_record,
    repeatability_record,
    report_record,
    status,
)
from cellplan.report.record.task import tasks_record


def report_json(report: Report, *, cell: Cell, provenance: Provenance, motion: Motion | None = None) -> str:
    """The record of one run as text; values without a finite number are null.

    Args:
        report: The run.
        cell: Its cell.
        provenance: Where the result comes from.
        motion: The motion as it was planned, for what its steps took; None when it is not at hand.
    """
    return _as_text(run_record(report, cell=cell, provenance=provenance, motion=motion))


def run_record(report: Report, *, cell: Cell, provenance: Provenance, motion: Motion | None = None) -> Record:
    """The record of one run, of its closures and of how its motion was found, without the series."""
    record = report_record(report, cell=cell, provenance=provenance)
    record["tasks"] = tasks_record(report, cell)
    return record | {
        "clearance": with_accuracies(record["clearance"], report.clearance.minima),
        "rests_on": rests_on_record(cell, report.loads),
        "closest_pairs": closest_pairs_record(report.clearance),
        "clearance_proof": clearance_proof_record(report.clearance),
        "open_surfaces": open_surfaces_record(cell),
        "left_out": left_out_record(report.clearance.left_out),
        "closure": closures_record(report, cell),
        "solver": solver_record(cell.solver, motion),
        **acceleration_parts(record, report.accelerations),
    }


def summary_json(reports: Mapping[str, Report], *, cell: Cell, provenance: Provenance) -> str:
    """The record of a job done in several runs, one after another, as text; see ``summary_record``."""
    return _as_text(summary_record(reports, cell=cell, provenance=provenance))


def summary_record(reports: Mapping[str, Report], *, cell: Cell, provenance: Provenance) -> Record:
    """The record of a job done in several runs, one after another.

    Tasks, joints and clearance are merged over the runs, the worst counts; everything else stands in the report of
    each run.

    Args:
        reports: Report by the name of the run, which is its task and its folder.
        cell: The cell.
        provenance: Where the result comes from.
    """
    runs = list(reports.values())
    minima = _merge_minima(runs)
    record = {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if all(report.passed for report in runs) else "failed",
        "mode": runs[0].mode,
        "cycle_time_s": number(sum(report.cycle_time for report in runs)),
        "clock_from": clock_from(cell),
        "runs": {name: _run_record(name, report, cell) for name, report in reports.items()},
        "tasks": {name: record for report in runs for name, record in tasks_record(report, cell).items()},
        "open_surfaces": open_surfaces_record(cell),
        "closure": worst_closures_record(runs, cell),
        "joints": joints_record(merge_joint_uses(use for report in runs for use in report.joints)),
        "repeatability": {name: drift for report in runs for name, drift in repeatability_record(report).items()},
        "clearance": with_accuracies(clearance_record(minima), minima),
        "required_clearance_mm": number(1e3 * cell.checks.clearance),
        "left_out": left_out_record(dict.fromkeys(each for report in runs for each in report.clearance.left_out)),
        "checks": [{"run": name, **check_record(check)} for name, report in reports.items() for check in report.checks],
        "not_in_program": missing_moves(cell, {name: report.tasks for name, report in reports.items()}),
        "rests_on": rests_on_record(cell, worst_loads(runs)),
        **origin_record(cell, provenance),
        "caution": CAUTION,
        "solver": solver_record(cell.solver),
    }
    return record | acceleration_parts(record, merge_accelerations(report.accelerations for report in runs))


def _run_record(name: str, report: Report, cell: Cell) -> Record:
    """What the summary says about one run."""
    errors = (
        "robot",
        "max_position_error_mm",
        "max_position_error_at_s",
        "max_orientation_error_deg",
        "max_orientation_error_at_s",
        "max_position_error_between_rows_mm",
        "max_orientation_error_between_rows_deg",
    )
    record: Record = {"status": status(report), "folder": name, "cycle_time_s": number(report.cycle_time)}
    for task in tasks_record(report, cell).values():
        record |= {key: task[key] for key in errors if key in task}
    return record


def merge_joint_uses(uses: Iterable[JointUse]) -> list[JointUse]:
    """One entry per joint over several runs: the widest range, the smallest margin, the highest speed, all travel."""
    merged: dict[tuple[str, str], JointUse] = {}
    for use in uses:
        key = (use.robot, use.joint)
        merged[key] = _merge_two(merged[key], use) if key in merged else use
    return list(merged.values())


def _merge_two(first: JointUse, second: JointUse) -> JointUse:
    tighter = min(first, second, key=lambda use: use.margin)
    faster = max(first, second, key=lambda use: use.peak_velocity)
    return replace(
        first,
        min=min(first.min, second.min),
        max=max(first.max, second.max),
        margin=tighter.margin,
        margin_at_s=tighter.margin_at_s,
        peak_velocity=faster.peak_velocity,
        peak_velocity_at_s=faster.peak_velocity_at_s,
        travel=first.travel + second.travel,
    )


def _merge_minima(runs: list[Report]) -> dict[ClearanceClass, ClearanceMinimum]:
    """The smallest distance of each class over several runs, certified when every run's is."""
    merged = {}
    for kind in ClearanceClass:
        found = [run.clearance.minima[kind] for run in runs if kind in run.clearance.minima]
        measured = [minimum for minimum in found if minimum.minimum is not None]
        if measured:
            smallest = min(measured, key=lambda minimum: math.inf if minimum.minimum is None else minimum.minimum)
            merged[kind] = replace(smallest, certified=all(minimum.certified for minimum in measured))
    return merged


def _as_text(record: Record) -> str:
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
