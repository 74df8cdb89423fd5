"""``cellplan check``: read and validate a cell without solving it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from cellplan.cli.options import AllowDirs, AsJson, CellFile, Quiet, Settings
from cellplan.cli.output import json_failure, say, say_json
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.model.cell import Robot
    from cellplan.pipeline.check import CellCheck

SCHEMA = "cellplan.check/1"


def check(
    cell: CellFile,
    settings: Settings = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Read and validate everything without solving: files, robots, paths, reach and collisions at the start.

    Exit status: 0 sound, 1 a collision at the start, 2 bad input, 3 no start posture found, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.cell.load import load_cell
        from cellplan.pipeline.check import check as check_cell
        from cellplan.pipeline.overrides import with_overrides

        with progress_listener(quiet=quiet) as progress:
            result = check_cell(
                with_overrides(load_cell(cell, allow_dirs=allow_dir or ()), settings or ()), progress=progress
            )
    status = ExitStatus.PASSED if result.passed else ExitStatus.CHECK_FAILED
    record = _record(result)
    if as_json:
        say_json({"schema": SCHEMA, "status": record["status"], "exit": int(status), **record})
    else:
        say("\n".join(_lines(record)))
    raise typer.Exit(status)


def _record(result: CellCheck) -> dict[str, Any]:
    """The result in printed units."""
    from cellplan.report.record.clearance import left_out_record
    from cellplan.report.record.common import check_record, number
    from cellplan.report.record.missing_tools import missing_tools
    from cellplan.report.record.open_surfaces import open_surfaces_record
    from cellplan.report.record.tasks import direction_record
    from cellplan.report.text.notes import open_surface_notes

    open_surfaces = open_surfaces_record(result.cell)
    remarks = [*open_surface_notes(open_surfaces), *missing_tools(result.cell)]
    return {
        "cell": result.cell.name,
        "status": "passed" if result.passed else "failed",
        "start": {robot.name: _start(robot) for robot in result.cell.robots},
        "start_found": list(result.found),
        "start_choice": result.choice,
        "path_length_mm": {name: number(1e3 * length) for name, length in result.path_lengths.items()},
        "direction": {task.name: direction_record(task) for task in result.cell.tasks},
        "checks": [check_record(each) for each in result.checks],
        "open_surfaces": open_surfaces,
        "remarks": [f"{result.cell.origin.at(key)}: {line}" for key, line in remarks],
        "left_out": left_out_record(result.left_out),
    }


def _start(robot: Robot) -> dict[str, float | None]:
    """Start posture by joint and unit, under the column names of the tables."""
    from cellplan.report.record.common import number

    if robot.start is None:
        return {}
    return {
        f"{joint.name}_{joint.display_unit.name}": number(joint.display_unit.scale * position)
        for joint, position in zip(robot.model.joints, robot.start, strict=True)
    }


def _lines(record: dict[str, Any]) -> list[str]:
    """The result as lines of text."""
    from cellplan.report.record.tasks import direction_text
    from cellplan.report.text.run import left_out_lines

    lines = [f"{record['cell']}: {'passed' if record['status'] == 'passed' else 'failed'}"]
    for robot, start in record["start"].items():
        configuration = ", ".join(f"{joint} {position:.4g}" for joint, position in start.items())
        lines.append(
            f"  start of {robot} ({'searched' if robot in record['start_found'] else 'given'}): {configuration}"
        )
    lines += [f"  {record['start_choice']}"] if record["start_choice"] else []
    for name, length in record["path_length_mm"].items():
        lines.append(f"  task {name}: path of {length:.4g} mm, {direction_text(record['direction'][name])}")
    lines += [f"  note: {remark}" for remark in record["remarks"]]
    lines += [f"  {'' if each['passed'] else 'FAILED '}{each['message']}" for each in record["checks"]]
    return lines + left_out_lines(record)
