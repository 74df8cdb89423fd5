"""``report.json`` of a program whose tasks have a report each: the worst values of all of them."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, TypedDict

from cellplan.model.branches import MovedStart
from cellplan.model.cell import Cell
from cellplan.model.report import CAUTION, Report
from cellplan.report.record.accelerations import AccelerationsRecord, NotJudgedRecord, accelerations_record
from cellplan.report.record.clearance import clearance_record, left_out_record
from cellplan.report.record.clock import clock_from
from cellplan.report.record.common import (
    Number,
    Provenance,
    RunCheckRecord,
    check_record,
    number,
    origin_record,
    status,
)
from cellplan.report.record.idle import missing_moves
from cellplan.report.record.joints import joints_record, repeatability_record
from cellplan.report.record.merging import worst_of
from cellplan.report.record.open_surfaces import open_surfaces_record
from cellplan.report.record.payload import hardest_loads, loads_record
from cellplan.report.record.phases import in_phase, phases_record
from cellplan.report.record.rests_on import rests_on_record
from cellplan.report.record.run import SCHEMA, HeadRecord
from cellplan.report.record.skew import SkewKey, least_skew_record
from cellplan.report.record.solver import solver_record
from cellplan.report.record.tasks import tasks_record
from cellplan.report.record.tool_errors import ClosureRecord, closures_record, without_means


class _RunEntry(TypedDict):
    status: Annotated[str, "`passed` or `failed`"]
    folder: Annotated[str, "folder of its report"]
    cycle_time_s: Annotated[Number, "its duration"]


class RunEntry(_RunEntry, total=False):
    """A run of several, with the largest errors of its task."""

    robot: Annotated[str, "the operator"]
    max_position_error_mm: Annotated[Number, "largest distance"]
    max_position_error_at_s: Annotated[Number, "its time"]
    max_orientation_error_deg: Annotated[Number, "largest angle"]
    max_orientation_error_at_s: Annotated[Number, "its time"]
    max_position_error_between_rows_mm: Annotated[Number, "largest distance between the rows"]
    max_orientation_error_between_rows_deg: Annotated[Number, "largest angle between the rows"]


class SummaryRecord(HeadRecord, SkewKey):
    """The record of several runs: the worst of tasks, joints, clearance and accelerations."""

    runs: Annotated[dict[str, RunEntry], "by task: the runs"]
    closure: Annotated[dict[str, ClosureRecord], "by co-holder; empty if one robot holds the part"]
    checks: Annotated[list[RunCheckRecord], "every verified statement, with its run"]
    cycles: Annotated[int | None, "how often the phases follow one another; null unless from home to home"]


def summary_record(
    reports: Mapping[str, Report],
    *,
    cell: Cell,
    provenance: Provenance,
    transfers: Mapping[str, str] | None = None,
    moved: Iterable[MovedStart] = (),
) -> SummaryRecord:
    """The record of several runs, one after another.

    Tasks, joints, clearance and accelerations are the worst of all runs, each with the phase it is from; everything
    else is in the report of each run.

    Args:
        reports: Report by the name of the run, which is its phase and its folder.
        provenance: Origin of the result.
        transfers: How the transfer moves of each phase were found, by the name of the phase.
        moved: How far starts were moved.
    """
    runs, merged = list(reports.values()), _merged(reports, cell)
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if all(report.passed for report in runs) else "failed",
        "mode": runs[0].mode,
        "cycle_time_s": number(sum(report.cycle_time for report in runs)),
        "clock_from": clock_from(cell),
        "phases": phases_record(runs[0].phases),
        "runs": {name: in_phase(_run_entry(name, report, cell), name) for name, report in reports.items()},
        **least_skew_record(reports),
        "tasks": merged["tasks"],
        "open_surfaces": open_surfaces_record(cell),
        "remarks": [text for _, text in cell.remarks],
        "closure": merged["closure"],
        "joints": merged["joints"],
        "repeatability": {name: drift for report in runs for name, drift in repeatability_record(report).items()},
        "clearance": merged["clearance"],
        "required_clearance_mm": number(cell.checks.clearance_mm),
        "left_out": left_out_record(dict.fromkeys(entry for report in runs for entry in report.clearance.left_out)),
        "checks": [
            {"phase": name, **check_record(check)} for name, report in reports.items() for check in report.checks
        ],
        "not_in_program": missing_moves(cell, {name: report.tasks for name, report in reports.items()}),
        "rests_on": merged["rests_on"],
        **origin_record(cell, provenance),
        "caution": CAUTION,
        "solver": solver_record(cell.solver, transfers=transfers, moved=moved),
        "accelerations": merged["accelerations"],
        "cycles": None if cell.program is None else cell.program.cycles,
    }


def _merged(reports: Mapping[str, Report], cell: Cell) -> Any:
    """The tasks of all runs, and the worst of joints, tools, part, distances and loads; times name their phases."""
    runs, known = list(reports.values()), {task.name for task in cell.tasks}
    accelerations = [accelerations_record(report.accelerations) for report in runs]
    merged = worst_of(
        [
            in_phase(
                {
                    # straight moves of holders have a report each
                    "tasks": tasks_record(report, cell) if known.issuperset(report.tasks) else {},
                    "joints": joints_record(report.joints, report.accelerations.joints),
                    "closure": _closures(report, cell),
                    "clearance": clearance_record(report.clearance.minima),
                    "accelerations": accelerations_record(report.accelerations),
                    "payload": loads_record(report.loads),
                },
                name,
            )
            for name, report in reports.items()
        ]
    )
    merged["accelerations"]["not_judged"] = _all_left(accelerations)
    rests_on = rests_on_record(cell, hardest_loads(runs), [tip for report in runs for tip in report.standoffs])
    return merged | {"rests_on": {**rests_on, "payload": merged["payload"]}}


def _closures(report: Report, cell: Cell) -> dict[str, ClosureRecord]:
    """Closure errors by robot, without what is a mean over one run."""
    return {robot: without_means(record) for robot, record in closures_record(report, cell).items()}


def _all_left(accelerations: Iterable[AccelerationsRecord]) -> list[NotJudgedRecord]:
    """What was not judged in any of the runs, once each."""
    left: list[NotJudgedRecord] = []
    for record in accelerations:
        left += [entry for entry in record["not_judged"] if entry not in left]
    return left


def _run_entry(name: str, report: Report, cell: Cell) -> RunEntry:
    """What the summary holds of one run."""
    entry: RunEntry = {"status": status(report), "folder": name, "cycle_time_s": number(report.cycle_time)}
    if not {task.name for task in cell.tasks}.issuperset(report.tasks):
        return entry
    tasks = tasks_record(report, cell).values()
    for task in sorted(tasks, key=lambda errors: errors["max_position_error_mm"] or 0.0)[-1:]:
        entry["robot"] = task["robot"]
        entry["max_position_error_mm"] = task["max_position_error_mm"]
        entry["max_position_error_at_s"] = task["max_position_error_at_s"]
        entry["max_orientation_error_deg"] = task["max_orientation_error_deg"]
        entry["max_orientation_error_at_s"] = task["max_orientation_error_at_s"]
        if "max_position_error_between_rows_mm" in task:
            entry["max_position_error_between_rows_mm"] = task["max_position_error_between_rows_mm"]
            entry["max_orientation_error_between_rows_deg"] = task["max_orientation_error_between_rows_deg"]
    return entry
