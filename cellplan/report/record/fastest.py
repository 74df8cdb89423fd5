"""``fastest.json``: the shortest cycles of a cell, its production curve and the program that meets a demand."""

import csv
import io
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, TypedDict

from cellplan.model.report import Report
from cellplan.report.record.common import Number, Record, number
from cellplan.report.record.key_figures import key_figures
from cellplan.report.record.load_figures import LoadFigures, RobotSpeedRecord, robot_speeds

SCHEMA: Final = "cellplan.fastest/1"
COMPARED: Final = ("max_velocity_ratio", "max_acceleration_ratio", "max_tool_speed_mm_s", "energy_proxy_s")


class BindingRecord(TypedDict):
    """What binds a phase."""

    phase: Annotated[str, "name of the phase"]
    robot: Annotated[str, "name of the robot"]
    joint: Annotated[str, "name of the joint; that of the task for its own limits; empty for a tool speed"]
    limit: Annotated[str, "`velocity`, `acceleration`, `jerk`, `tool speed`, `feed` or `tolerance between rows`"]
    percent: Annotated[Number, "what is reached of it"]
    time_percent: Annotated[Number, "how much of the time of the phase it asks for"]
    text: Annotated[str, "one line of text"]


class ProgramRecord(TypedDict):
    """A program that was solved and verified at its cycle time."""

    law: Annotated[str, "`time_laws`, `common_speed` or `reduced_speed`"]
    status: Annotated[str, "`passed` or `failed`"]
    cycle_s: Annotated[Number, "time from the first row to the last one"]
    share_of_written: Annotated[Number, "share of the cycle as it is written"]
    settings: Annotated[dict[str, Any], "by address: values of the cell file with which `solve` gives it"]
    options: Annotated[list[str], "the same as `KEY=VALUE` for `--set`"]
    binding: Annotated[list[BindingRecord], "what binds each phase"]
    figures: Annotated[LoadFigures, "its load"]
    robots: Annotated[dict[str, RobotSpeedRecord], "by robot: speeds in the world"]
    largest_position_error_mm: Annotated[Number, "largest position error of a tool, at the rows or between them"]
    largest_orientation_error_deg: Annotated[Number, "largest orientation error, likewise"]
    smallest_clearance_mm: Annotated[Number, "smallest certified distance of two bodies; null without pairs"]
    failed: Annotated[list[str], "checks that failed"]


class PointRecord(TypedDict):
    """A cycle on the production curve."""

    law: Annotated[str, "`time_laws` or `common_speed`"]
    settings: Annotated[dict[str, Any], "by address: values of the cell file with which `solve` gives it"]
    figures: Annotated[LoadFigures | dict[str, Any], "its load; the clearance is that of the shortest cycle alone"]
    reason: Annotated[str, "why there is no program; empty if there is one"]


class DemandRecord(TypedDict):
    """A demand and the calmest program that meets it."""

    parts_per_h: Annotated[Number, "parts per hour that were asked for"]
    allowed_cycle_s: Annotated[Number, "longest cycle in whole steps that makes them"]
    idle_s: Annotated[Number, "time of this cycle that the robots wait"]
    program: Annotated[ProgramRecord, "the program"]
    saving_against_shortest: Annotated[dict[str, Number], "by figure: share that the program saves; negative: costs"]
    saving_against_written: Annotated[dict[str, Number], "the same against the program as it is written"]


class FastestRecord(TypedDict):
    """The shortest cycles of a cell."""

    schema: Annotated[str, "name and version of the format"]
    cell: Annotated[str, "name of the cell"]
    status: Annotated[str, "`passed` if every program passed every check, else `failed`"]
    written_s: Annotated[Number, "cycle time of the program as it is written"]
    as_written: Annotated[LoadFigures, "load of the program as it is written; its clearance is not checked"]
    cycles: Annotated[dict[str, ProgramRecord], "by law: the shortest cycle"]
    remark: Annotated[str, "why there is no program at reduced speed; empty if there is one"]
    curve: Annotated[list[PointRecord], "the production curve, law after law, the shortest cycle first"]
    demand: Annotated[DemandRecord | None, "the demand; null if none was given"]
    inputs: Annotated[dict[str, str], "SHA-256 of every input file, by name"]
    versions: Annotated[dict[str, str], "versions of cellplan and of the packages that the numbers depend on"]


def program_figures(reports: Sequence[Report], cycle: float) -> dict[str, Any]:
    """Verdict, errors, clearance and speeds of a program.

    Args:
        reports: The report of each phase.
        cycle: Time from the first row of the program to the last one in [s].
    """
    key = key_figures(reports)
    failed = [check.message for report in reports for check in report.checks if not check.passed]
    return {
        "status": "failed" if failed else "passed",
        "robots": dict(robot_speeds(reports, cycle)),
        "largest_position_error_mm": key["max_position_error_mm"],
        "largest_orientation_error_deg": key["max_orientation_error_deg"],
        "smallest_clearance_mm": key["min_clearance_mm"],
        "failed": failed,
    }


def savings(figures: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Number]:
    """Shares by which the load of a program is below that of another one, by figure; None where there is none."""
    found: dict[str, Number] = {}
    for name in COMPARED:
        before, now = other[name], figures[name]
        found[name] = number(1.0 - now / before) if before and now is not None else None
    return found


def curve_table(record: Record) -> str:
    """The production curve as CSV: a row for each cycle, those as written, at reduced speed and of the demand too."""
    rows: list[tuple[str, Mapping[str, Any]]] = [("as_written", record["as_written"])]
    rows += [(point["law"], point["figures"]) for point in record["curve"] if point["figures"]]
    if "reduced_speed" in record["cycles"]:
        rows.append(("reduced_speed", record["cycles"]["reduced_speed"]["figures"]))
    if record["demand"]:
        rows.append(("demand", record["demand"]["program"]["figures"]))
    names = list(LoadFigures.__annotations__)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["law", *names])
    writer.writerows([law, *(figures[name] for name in names)] for law, figures in rows)
    return text.getvalue()
