"""``report.json`` of a program whose tasks have a report each: the worst values of all of them."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Annotated, Any, Final, NamedTuple, TypedDict

from cellplan.model.cell.cell import Cell
from cellplan.model.motion.branches import MovedStart
from cellplan.model.report.report import CAUTION, Report
from cellplan.report.record.common import (
    Number,
    Provenance,
    Record,
    RunCheckRecord,
    check_record,
    number,
    origin_record,
    status,
)
from cellplan.report.record.figures import Fold, figures_record
from cellplan.report.record.phases import AT, clock_from, in_phase, missing_moves, phase_key, phases_record
from cellplan.report.record.run import SCHEMA, HeadRecord
from cellplan.report.record.sections.accelerations import AccelerationsRecord, NotJudgedRecord, accelerations_record
from cellplan.report.record.sections.clearance import clearance_record, left_out_record
from cellplan.report.record.sections.joints import joints_record, repeatability_record, with_worst_time
from cellplan.report.record.sections.payload import hardest_loads, loads_record
from cellplan.report.record.sections.rests_on import open_surfaces_record, rests_on_record
from cellplan.report.record.sections.skew import SkewKey, least_skew_record
from cellplan.report.record.sections.solver import solver_record
from cellplan.report.record.sections.tasks import tasks_record
from cellplan.report.record.sections.tool_errors import ClosureRecord, closures_record, without_means


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
        "figures": figures_record(runs),
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
        "cycles": cell.program.cycles if cell.program.is_home_to_home else None,
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


class Figure(NamedTuple):
    """A figure of a record, and what of the same run goes with it."""

    key: str  # of the figure
    worst: Fold  # max or min
    at: str  # key of its time; empty without one
    further: tuple[str, ...] = ()  # keys of what else belongs to it


LOAD: Final = ("mass_kg", "tool_mass_kg", "part_mass_kg", "part_shared", "centre_in_flange_mm")
LIMIT: Final = ("acceleration_limit", "acceleration_limit_source", "acceleration_ratio")
# fmt: off
FIGURES: Final = (
    Figure("min", min, ""),
    Figure("max", max, ""),
    Figure("margin", min, "margin_at_s"),
    Figure("peak_velocity", max, "peak_velocity_at_s", ("velocity_ratio",)),
    Figure("peak_acceleration", max, "peak_acceleration_at_s", LIMIT),
    Figure("peak_jerk", max, "peak_jerk_at_s"),
    Figure("peak_acceleration_m_s2", max, "peak_acceleration_at_s"),
    Figure("peak_jerk_m_s3", max, "peak_jerk_at_s"),
    Figure("minimum_mm", min, AT, ("pair", "exact", "points_mm", "accuracies_mm")),
    Figure("max_position_error_mm", max, AT),
    Figure("max_orientation_error_deg", max, "max_orientation_error_at_s"),
    Figure("max_position_error_between_rows_mm", max, "max_position_error_between_rows_at_s"),
    Figure("max_orientation_error_between_rows_deg", max, "max_orientation_error_between_rows_at_s"),
    Figure("felt_mass_kg", max, "felt_at_s", LOAD),
    Figure("static_moment_nm", max, "static_moment_at_s"),
    Figure("moment_nm", max, "moment_at_s"),
    Figure("inertia_kg_m2", max, "inertia_at_s"),
)


# fmt: on


def worst_of(records: Sequence[Record]) -> Any:
    """One record of several of the same form: of each figure the worst, the first one of those that are alike.

    Joints travel the sum of all runs; a distance is certified if that of every run is. What is no figure is that of
    the first run that has it.

    Args:
        records: Records by name, or of one subject, of each run.
    """
    merged: dict[str, Any] = {}
    for key in dict.fromkeys(chain.from_iterable(records)):
        values = [record[key] for record in records if record.get(key) is not None] or [None]
        merged[key] = worst_of(values) if isinstance(values[0], Mapping) else values[0]
    for figure in FIGURES:
        known = [record for record in records if record.get(figure.key) is not None]
        if known:
            worst = figure.worst(known, key=lambda record: record[figure.key])
            keys = (figure.key, figure.at, phase_key(figure.at), *figure.further)
            merged |= {key: worst[key] for key in keys if key in worst}
    if "travel" in merged:
        merged["travel"] = number(sum(record["travel"] for record in records))
        merged = with_worst_time(merged)
    if "certified" in merged and merged["minimum_mm"] is not None:
        merged["certified"] = all(record["certified"] for record in records if record["minimum_mm"] is not None)
        merged["exact"] = merged["certified"] and merged["exact"]
    return merged
