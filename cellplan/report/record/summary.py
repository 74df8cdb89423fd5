"""``report.json`` of a program and of its phases; that of several phases has the worst values of all of them."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Annotated, Any, Final, NamedTuple, TypedDict

from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import CAUTION, Report
from cellplan.report.record.common import Number, Provenance, Record, RunCheckRecord, number, origin_record
from cellplan.report.record.figures import Fold, figures_record
from cellplan.report.record.phases import AT, in_phase, missing_moves, phase_key, phases_record
from cellplan.report.record.run import HeadRecord, ReportedPhase, RunRecord, begin_record, run_record
from cellplan.report.record.sections.accelerations import NotJudgedRecord
from cellplan.report.record.sections.clearance import left_out_record
from cellplan.report.record.sections.joints import with_worst_time
from cellplan.report.record.sections.payload import hardest_loads
from cellplan.report.record.sections.rests_on import open_surfaces_record, rests_on_record
from cellplan.report.record.sections.skew import SkewKey, least_skew_record
from cellplan.report.record.sections.solver import NOT_PLANNED, PlanningFacts, solver_record
from cellplan.report.record.sections.tasks import TaskRecord
from cellplan.report.record.sections.tool_errors import ClosureRecord, without_means
from cellplan.report.record.sections.torques import TorquesKey, torques_of_phases


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


class SummaryRecord(HeadRecord, SkewKey, TorquesKey):
    """The record of several runs: the worst of tasks, joints, clearance and accelerations."""

    runs: Annotated[dict[str, RunEntry], "by task: the runs"]
    closure: Annotated[dict[str, ClosureRecord], "by co-holder; empty if one robot holds the part"]
    checks: Annotated[list[RunCheckRecord], "every verified statement, with its run"]
    cycles: Annotated[int | None, "how often the phases follow one another; null unless from home to home"]


class ProgramRecords(NamedTuple):
    """The ``report.json`` of a program, and that of each phase."""

    whole: Record  # that of the only phase, or the worst values of several
    phases: Mapping[str, Record]  # by the place of the phase in the folder of the run: its name, empty for the only one
    cells: Mapping[str, Cell]  # the cell as it is in each phase, and in the whole program, by place

    @property
    def by_place(self) -> dict[str, Record]:
        """All of them by their places."""
        return {**self.phases, "": self.whole}


def program_records(
    phases: Sequence[ReportedPhase], *, cell: Cell, provenance: Provenance, planning: Sequence[PlanningFacts] = ()
) -> ProgramRecords:
    """The records of a program of one or several phases.

    Args:
        planning: What only the planner of each phase knows; empty if it is not available.
    """
    records = {
        phase.report.phase or "": run_record(phase, provenance=provenance, planning=facts)
        for phase, facts in zip(phases, planning or [NOT_PLANNED] * len(phases), strict=True)
    }
    whole = records.get("") or _whole([phase.report for phase in phases], records, planning, cell, provenance)
    return ProgramRecords(whole, records, {"": cell, **{phase.report.phase or "": phase.cell for phase in phases}})


def _whole(
    reports: Sequence[Report],
    records: Mapping[str, RunRecord],
    planning: Sequence[PlanningFacts],
    cell: Cell,
    provenance: Provenance,
) -> SummaryRecord:
    """The record of several phases, one after another.

    Tasks, joints, clearance and accelerations are the worst of all phases, each with the phase it is from; everything
    else is in the report of each phase.
    """
    transfers = {name: text for facts in planning for name, text in facts.transfers.items()}
    moved = tuple(dict.fromkeys(start for facts in planning for start in facts.moved))
    worst = worst_of([in_phase(_merged(record, cell), name) for name, record in records.items()])
    tips, torques = ([it for report in reports for it in getattr(report, key)] for key in ("standoffs", "torques"))
    rests_on = rests_on_record(cell, hardest_loads(reports), tips, torques)
    return {
        **begin_record(reports, cell),
        "phases": phases_record(reports[0].phases),
        "runs": {name: in_phase(_run_entry(record, cell, folder=name), name) for name, record in records.items()},
        **least_skew_record(reports),
        **torques_of_phases(reports, worst["torques"]),
        "tasks": worst["tasks"],
        "open_surfaces": open_surfaces_record(cell),
        "remarks": [text for _, text in cell.remarks],
        "closure": worst["closure"],
        "joints": worst["joints"],
        "repeatability": dict(chain.from_iterable(record["repeatability"].items() for record in records.values())),
        "clearance": worst["clearance"],
        "figures": figures_record(reports),
        "required_clearance_mm": number(cell.checks.clearance_mm),
        "left_out": left_out_record(dict.fromkeys(entry for report in reports for entry in report.clearance.left_out)),
        "checks": [{"phase": name, **check} for name, record in records.items() for check in record["checks"]],
        "not_in_program": missing_moves(cell, {report.phase: report.tasks for report in reports}),
        "base_reactions": worst["base_reactions"],
        "rests_on": {**rests_on, "payload": worst["payload"]},
        **origin_record(cell, provenance),
        "caution": CAUTION,
        "solver": solver_record(cell.solver, PlanningFacts(transfers=transfers, moved=moved)),
        "accelerations": worst["accelerations"] | {"not_judged": _not_judged(records.values())},
        "forces": worst["forces"],
        "cycles": cell.program.cycles if cell.program.is_home_to_home else None,
    }


def _merged(record: RunRecord, cell: Cell) -> Record:
    """What of a phase is merged with that of others."""
    return {
        "tasks": _tasks(record, cell),
        "joints": record["joints"],
        "closure": {robot: without_means(closure) for robot, closure in record["closure"].items()},
        "clearance": record["clearance"],
        "accelerations": record["accelerations"],
        "forces": record["forces"],
        "payload": record["rests_on"]["payload"],
        "base_reactions": record["base_reactions"],
        "torques": record.get("torques", {}),
    }


def _tasks(record: RunRecord, cell: Cell) -> dict[str, TaskRecord]:
    """Tasks of a phase; none in a straight move of a holder."""
    return record["tasks"] if {task.name for task in cell.tasks}.issuperset(record["tasks"]) else {}


def _not_judged(records: Iterable[RunRecord]) -> list[NotJudgedRecord]:
    """What was not judged in any of the phases, once each."""
    left: list[NotJudgedRecord] = []
    for record in records:
        left += [entry for entry in record["accelerations"]["not_judged"] if entry not in left]
    return left


def _run_entry(record: RunRecord, cell: Cell, *, folder: str) -> Record:
    """What the record of a program holds of one phase."""
    tasks: list[Record] = list(_tasks(record, cell).values())
    worst = max(tasks[::-1], key=lambda errors: errors["max_position_error_mm"] or 0.0, default={})
    errors = {key: worst[key] for key in RunEntry.__annotations__ if key in worst}
    return {"status": record["status"], "folder": folder, "cycle_time_s": record["cycle_time_s"], **errors}


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
    Figure("peak_torque", max, "peak_torque_at_s", ("torque_ratio",)),
    Figure("peak_power_w", max, "peak_power_at_s"),
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
    *(Figure(f"{key}_n", max, f"{key}_at_s") for key in ("vertical", "horizontal")),
    *(Figure(f"{key}_nm", max, f"{key}_at_s") for key in ("tilting", "turning", "tilting_at_rest")),
    Figure("weight_n", max, ""),
    Figure("torque", max, "torque_at_s"),
    Figure("moving", max, "moving_at_s"),
    Figure("by_process", max, "by_process_at_s"),
    Figure("by_weight", max, "by_weight_at_s"),
    Figure("by_closure", max, ""),
    Figure("force_n", max, "force_at_s"),
    Figure("share", max, "share_at_s", ("tangential_n", "torsion_nm", "normal_n")),
    Figure("across_nm", max, ""),
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
