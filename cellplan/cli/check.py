"""``cellplan check``: read and validate a cell without solving it."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import typer

from cellplan.cli.options import AllowDirs, AsJson, CellFile, Quiet, Settings, Watch
from cellplan.cli.output import Result, json_failure, present
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from cellplan.cli.progress import Listener
    from cellplan.model.cell import Cell, Robot
    from cellplan.pipeline.check import CellCheck

SCHEMA = "cellplan.check/1"


def check(
    cell: CellFile,
    settings: Settings = None,
    watch: Watch = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Read and validate everything without solving: files, robots, paths, reach and collisions at the start.

    Exit status: 0 sound, 1 a collision at the start, 2 bad input, 3 no start posture found, 4 internal error, 130
    interrupted.
    """
    work = partial(_checked, cell, tuple(settings or ()), tuple(allow_dir or ()))
    if watch:
        from cellplan.cli.watch import watch as watch_cell

        watch_cell(work, cell, schema=SCHEMA, as_json=as_json, quiet=quiet)
    with json_failure(SCHEMA, desired=as_json), progress_listener(quiet=quiet) as progress:
        result = work(lambda _: None, progress)
    present(result, as_json=as_json)
    raise typer.Exit(result.status)


def _checked(
    path: Path,
    settings: tuple[str, ...],
    allow_dirs: tuple[Path, ...],
    follow: Callable[[Cell], None],
    progress: Listener,
) -> Result:
    """Read and check a cell; ``follow`` is called with the cell as soon as it is read."""
    from cellplan.cli.next_steps import after_check
    from cellplan.io.cell.load import load_cell
    from cellplan.pipeline.check import check as check_cell
    from cellplan.pipeline.overrides import with_overrides
    from cellplan.report.text.check import check_lines

    given = load_cell(path, allow_dirs=allow_dirs)
    follow(given)
    changed = with_overrides(given, settings)
    result = check_cell(changed, progress=progress)
    status = ExitStatus.PASSED if result.passed else ExitStatus.CHECK_FAILED
    record = _record(result)
    lines = [*check_lines(record), *after_check(path, changed, passed=result.passed, allow_dirs=allow_dirs)]
    return Result(status, lines, {"schema": SCHEMA, "status": record["status"], "exit": int(status), **record})


def _record(result: CellCheck) -> dict[str, Any]:
    """The result in printed units."""
    from cellplan.report.record.clearance import left_out_record
    from cellplan.report.record.common import check_record, number
    from cellplan.report.record.missing_tools import missing_tools
    from cellplan.report.record.open_surfaces import open_surfaces_record
    from cellplan.report.record.solver import moved_start_record
    from cellplan.report.record.tasks import direction_record
    from cellplan.report.text.notes import open_surface_notes

    open_surfaces = open_surfaces_record(result.cell)
    remarks = [*result.cell.remarks, *open_surface_notes(open_surfaces), *missing_tools(result.cell)]
    return {
        "cell": result.cell.name,
        "status": "passed" if result.passed else "failed",
        "start": {robot.name: _start(robot) for robot in result.cell.robots},
        "start_found": list(result.found),
        "start_choice": result.choice,
        "moved_starts": [moved_start_record(each) for each in result.moved],
        "path_length_mm": {name: number(1e3 * length) for name, length in result.path_lengths.items()},
        "path_bulge_mm": {name: number(1e3 * bulge) for name, bulge in result.bulges.items()},
        "controllers": {
            name: {
                "kind": str(controller.kind),
                "robots": [it.name for it in result.cell.robots if it.control and it.control.controller == name],
            }
            for name, controller in result.cell.controllers.items()
        },
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
