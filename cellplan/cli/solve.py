"""``cellplan solve``: plan a cell, check the result and write joint tables, report and plots."""

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cellplan.cli.options import (
    AllowDirs,
    AsJson,
    CellFile,
    Clearance,
    Duration,
    Integrator,
    Method,
    Mode,
    PlotFormats,
    Quiet,
    Settings,
)
from cellplan.cli.output import json_failure, say, say_json
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.pipeline.solution import Solution
    from cellplan.report.record.common import Record

SCHEMA = "cellplan.solve/1"

Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Run folder (default: outputs/<cell name>).")
]
TaskName = Annotated[str | None, typer.Option("--task", metavar="NAME", help="Plan this task only.")]
KeepRejected = Annotated[
    bool, typer.Option("--keep-rejected", help="Write the tables of a failed run below rejected/.")
]

WithView = Annotated[
    bool,
    typer.Option("--view", help="Write the 3-D page view.html too, as cellplan view does; the report leads to it."),
]


def solve(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    output: Output = None,
    mode: Mode = None,
    method: Method = None,
    integrator: Integrator = None,
    duration: Duration = None,
    clearance_mm: Clearance = None,
    settings: Settings = None,
    task: TaskName = None,
    as_json: AsJson = False,
    keep_rejected: KeepRejected = False,
    with_view: WithView = False,
    plots: PlotFormats = None,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Plan, check, and write joint tables, report and plots.

    The tables are written only when every check passes. Exit status: 0 passed, 1 a check failed, 2 bad input,
    3 no solution, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.cli.repair_line import repair_lines
        from cellplan.io.cell.load import load_cell
        from cellplan.io.run.folder import refuse_unless_replaceable
        from cellplan.pipeline.overrides import require_task, with_overrides
        from cellplan.pipeline.solve import solve as solve_cell
        from cellplan.report.plots.rendering import require_formats
        from cellplan.report.text.run import summary_lines

        require_formats(plots or ())
        given = load_cell(cell, allow_dirs=allow_dir or ())
        changed = with_overrides(
            given,
            settings or (),
            mode=mode,
            method=method,
            integrator=integrator,
            duration=duration,
            clearance_mm=clearance_mm,
        )
        require_task(changed, task)
        folder = output or Path("outputs") / changed.name
        refuse_unless_replaceable(folder)
        with progress_listener(quiet=quiet) as progress:
            solution = solve_cell(changed, task=task, progress=progress)
            record = _written(solution, folder, keep_rejected, plots or (), with_view)
    status = ExitStatus.PASSED if solution.passed else ExitStatus.CHECK_FAILED
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "report.html")}
        say_json({"schema": SCHEMA, "status": record["status"], "exit": int(status), **place, "report": record})
    else:
        further = [] if solution.passed or task is not None else repair_lines(cell, changed, allow_dir or ())
        page = [f"3-D page: {folder / 'view.html'}"] if with_view else []
        say("\n".join([*summary_lines(record, folder), *page, *further]))
        if solution.remark:
            say(solution.remark)
    raise typer.Exit(status)


def _written(solution: "Solution", folder: Path, keep_rejected: bool, formats: Collection[str], view: bool) -> "Record":
    """Write a run folder, with its 3-D page where that is desired."""
    from cellplan.pipeline.write_run import write_run

    record = write_run(solution, folder, keep_rejected=keep_rejected, formats=formats, view=view)
    if view:
        from cellplan.pipeline.view.write import write_view_of_run

        write_view_of_run(folder, solution.cell)
    return record
