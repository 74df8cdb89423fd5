"""``cellplan solve``: plan a cell, check the result and write joint tables, report and plots."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import one_of, run_folders
from cellplan.cli.options.request import Options, option
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.cli.terminal.progress import Listener, progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.model.cell.cell import Cell
    from cellplan.planning.transfer.best_try import BlockedTransferError
    from cellplan.report.record.common import Record
    from cellplan.runs.solution import Solution


@dataclass(frozen=True, slots=True, kw_only=True)
class SolveOptions(Options):
    """What is solved and written."""

    SCHEMA = "cellplan.solve/1"

    cell: shared.CellFile
    output: Annotated[Path | None, option("-o, --output DIR", "Run folder (default: outputs/<cell name>).")] = None
    mode: shared.Mode = None
    method: shared.Method = None
    integrator: Annotated[
        str | None,
        option(
            "--integrator NAME",
            "Integration of joint velocities: auto, accurate or euler.",
            autocompletion=one_of("auto", "cellplan.model.solver:Integrator"),
        ),
    ] = None
    duration: Annotated[float | None, option("--duration S", "Duration of the motion in seconds.")] = None
    clearance_mm: Annotated[float | None, option("--clearance-mm MM", "Required clearance in millimetres.")] = None
    settings: shared.Settings = ()
    task: shared.TaskName = None
    near: Annotated[
        Path | None,
        option(
            "--near RUN",
            "Keep the branches of an earlier run: starts and homes that the cell leaves open are nearest to its own.",
            autocompletion=run_folders,
        ),
    ] = None
    as_json: shared.AsJson = False
    keep_rejected: Annotated[bool, option("--keep-rejected", "Write the tables of a failed run below rejected/.")] = (
        False
    )
    with_view: Annotated[bool, option("--view", "Write the 3-D page view.html too, as cellplan view does.")] = False
    watch: shared.Watch = False
    plots: shared.PlotFormats = ()
    quiet: shared.Quiet = False
    allow_dirs: shared.AllowDirs = ()


def solve(options: SolveOptions) -> Result:
    """Plan, check, and write joint tables, report and plots.

    The tables are written only when every check passes. Exit status: 0 passed, 1 a check failed, 2 bad input,
    3 no solution, 4 internal error, 130 interrupted.
    """
    if options.watch:
        from cellplan.cli.watch.watch import watch

        work = partial(_solved, options)
        watch(work, options.cell, schema=options.schema, as_json=options.as_json, quiet=options.quiet)
    with progress_listener(quiet=options.quiet) as progress:
        return _solved(options, lambda _: None, progress)


def _solved(options: SolveOptions, follow: "Callable[[Cell], None]", progress: Listener) -> Result:
    """Solve and write; ``follow`` is called with the cell as soon as it is read."""
    from cellplan.files.cell.load import load_cell
    from cellplan.files.run.folder import refuse_unless_replaceable
    from cellplan.planning.transfer.best_try import BlockedTransferError
    from cellplan.report.plots.rendering import require_formats
    from cellplan.runs.overrides import require_task, with_overrides
    from cellplan.runs.solve import solve_in_parallel

    require_formats(options.plots)
    given = load_cell(options.cell, allow_dirs=options.allow_dirs)
    follow(given)
    changed = with_overrides(
        given,
        options.settings,
        mode=options.mode,
        method=options.method,
        integrator=options.integrator,
        duration=options.duration,
        clearance_mm=options.clearance_mm,
    )
    require_task(changed, options.task)
    folder = options.output or Path("outputs") / changed.name
    refuse_unless_replaceable(folder)
    try:
        solution = solve_in_parallel(changed, task=options.task, near=options.near, progress=progress)
    except BlockedTransferError as error:
        raise _with_page(error, folder) from error
    record = _written(solution, folder, options, progress)
    return _result(options, changed, solution, record, folder)


def _with_page(error: "BlockedTransferError", folder: Path) -> "BlockedTransferError":
    """The error with the 3-D page of the best try, which is written beside the run folder."""
    from cellplan.jobs.view.write import write_view_of_blocked

    page = folder.with_name(f"{folder.name}-{error.name or 'transfer'}.html")
    shown = f"; 3-D page of the best try: {page}" if write_view_of_blocked(error, page) else ""
    return type(error)(error.place, f"{error.what}{shown}", error.best, name=error.name)


def _result(options: SolveOptions, changed: "Cell", solution: "Solution", record: "Record", folder: Path) -> Result:
    """What to say of a solution that was written."""
    from cellplan.cli.next_steps import after_solve, view_line
    from cellplan.cli.terminal.verbosity import log_effort
    from cellplan.report.text.run import summary_lines

    log_effort(record)
    status = ExitStatus.PASSED if solution.passed else ExitStatus.CHECK_FAILED
    page = view_line(folder, options.cell, changed, options.allow_dirs)
    lines = [*summary_lines(record, folder), f"3-D page: {folder / 'view.html'}" if options.with_view else page]
    if options.task is None:
        failed = [check["name"] for check in record["checks"] if not check["passed"]]
        lines += after_solve(options.cell, changed, failed, run=folder, allow_dirs=options.allow_dirs)
    lines += [solution.remark] if solution.remark and not solution.passed else []  # else the checks have settled it
    report = folder / "report.html"
    return result_of_folder(options.schema, status, lines, report, says=record["status"], report=record)


def _written(solution: "Solution", folder: Path, options: SolveOptions, progress: Listener) -> "Record":
    """Write a run folder, with its 3-D page where that is desired."""
    from cellplan.runs.write_run import write_run

    record = write_run(solution, folder, keep_rejected=options.keep_rejected, formats=options.plots, progress=progress)
    if options.with_view:
        from cellplan.jobs.view.write import write_view_of_run

        write_view_of_run(folder, solution.cell, progress=progress)
    return record
