"""``cellplan check``: read and validate a cell without solving it."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from cellplan.cli.options import shared
from cellplan.cli.options.completion import one_of
from cellplan.cli.options.request import option
from cellplan.cli.terminal.output import Result
from cellplan.cli.terminal.progress import Listener, progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.jobs.check import CellCheck
    from cellplan.model.cell.cell import Cell, Robot


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckOptions(shared.JobOptions):
    """What is checked."""

    SCHEMA = "cellplan.check/1"

    cell: shared.CellFile
    settings: shared.Settings = ()
    formats: Annotated[
        tuple[str, ...],
        option(
            "--for FORMATS",
            "Say all that programs in these formats still need of the cell, such as rapid,krl; may be repeated.",
            autocompletion=one_of("cellplan.programs.dialects:DIALECTS"),
        ),
    ] = ()
    controllers: shared.Controllers = None
    watch: shared.Watch = False


def check(options: CheckOptions) -> Result:
    """Read and validate everything without solving: files, robots, paths, reach and collisions at the start.

    Exit status: 0 sound, 1 a collision at the start, 2 bad input, 3 no start posture found, 4 internal error, 130
    interrupted.
    """
    work = partial(_checked, options)
    if options.watch:
        from cellplan.cli.watch.watch import watch

        watch(work, options.cell, schema=options.schema, as_json=options.as_json, quiet=options.quiet)
    with progress_listener(quiet=options.quiet) as progress:
        return work(lambda _: None, progress)


def _checked(options: CheckOptions, follow: "Callable[[Cell], None]", progress: Listener) -> Result:
    """Read and check a cell; ``follow`` is called with the cell as soon as it is read."""
    from cellplan.files.cell.reader_process import begin_reading

    begin_reading(options.cell)
    from cellplan.files.cell.load import load_cell, with_names
    from cellplan.runs.overrides import with_overrides

    formats: list[str] = []
    if options.formats:
        from cellplan.programs.export.exporters import formats_for
        from cellplan.programs.export.refusals import require_settings, settings_remarks

        formats = formats_for(options.formats)
    given = load_cell(options.cell, allow_dirs=options.allow_dirs)
    follow(given)
    named = given if options.controllers is None else with_names(given, options.controllers)
    changed = with_overrides(named, options.settings)
    unwritten: list[tuple[str, str]] = []
    if formats:
        require_settings(changed, formats)
        unwritten = settings_remarks(changed, formats)
    from cellplan.cli.next_steps import after_check
    from cellplan.jobs.check import check as check_cell
    from cellplan.jobs.check import check_lines

    result = check_cell(changed, progress=progress)
    status = ExitStatus.PASSED if result.passed else ExitStatus.CHECK_FAILED
    record = _record(result, unwritten) | ({"for": formats} if formats else {})
    steps = after_check(options.cell, changed, passed=result.passed, allow_dirs=options.allow_dirs)
    about = {"schema": options.schema, "status": record["status"], "exit": int(status)}
    return Result(status, [*check_lines(record), *steps], {**about, **record})


def _record(result: "CellCheck", more: "list[tuple[str, str]]") -> dict[str, Any]:
    """The result in printed units; ``more`` are further remarks with their keys."""
    from cellplan.report.record.common import check_record, number
    from cellplan.report.record.sections.clearance import left_out_record
    from cellplan.report.record.sections.rests_on import missing_tools, open_surfaces_record
    from cellplan.report.record.sections.solver import moved_start_record
    from cellplan.report.record.sections.tasks import direction_record
    from cellplan.report.text.notes import open_surface_notes

    open_surfaces = open_surfaces_record(result.cell)
    remarks = [*result.cell.remarks, *open_surface_notes(open_surfaces), *missing_tools(result.cell), *more]
    return {
        "cell": result.cell.name,
        "status": "passed" if result.passed else "failed",
        "start": {robot.name: _start(robot) for robot in result.cell.robots},
        "start_found": list(result.searched),
        "start_choice": result.choice,
        "moved_starts": [moved_start_record(start) for start in result.moved],
        "path_length_mm": {name: number(1e3 * length) for name, length in result.path_lengths.items()},
        "path_bulge_mm": {name: number(1e3 * bulge) for name, bulge in result.bulges.items()},
        "controllers": {
            name: {
                "kind": controller.kind,
                "robots": [it.name for it in result.cell.robots if it.control and it.control.id == name],
            }
            for name, controller in result.cell.controllers.items()
        },
        "direction": {task.name: direction_record(task) for task in result.cell.tasks},
        "checks": [check_record(check) for check in result.checks],
        "open_surfaces": open_surfaces,
        "remarks": [f"{result.cell.origin.at(key)}: {line}" for key, line in remarks],
        "left_out": left_out_record(result.left_out),
    }


def _start(robot: "Robot") -> dict[str, float | None]:
    """Start posture by joint and unit, under the column names of the tables."""
    from cellplan.report.record.common import number

    if robot.start is None:
        return {}
    return {
        f"{joint.name}_{joint.display_unit.name}": number(joint.display_unit.scale * position)
        for joint, position in zip(robot.model.joints, robot.start, strict=True)
    }
