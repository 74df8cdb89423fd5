"""``cellplan solve``: plan a cell, check the result and write joint tables, report and plots."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from cellplan.cli.completion import run_folders
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
    TaskName,
    Watch,
)
from cellplan.cli.output import Result, json_failure, present
from cellplan.cli.progress import Listener, progress_listener
from cellplan.errors import ExitStatus

if TYPE_CHECKING:
    from cellplan.model.cell import Cell
    from cellplan.pipeline.solution import Solution
    from cellplan.planning.transfer.best_try import BlockedTransferError
    from cellplan.report.record.common import Record

SCHEMA = "cellplan.solve/1"

Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Run folder (default: outputs/<cell name>).")
]
KeepRejected = Annotated[
    bool, typer.Option("--keep-rejected", help="Write the tables of a failed run below rejected/.")
]

Near = Annotated[
    Path | None,
    typer.Option(
        "--near",
        metavar="RUN",
        help="Keep the branches of an earlier run: starts and homes that the cell leaves open are nearest to its own.",
        autocompletion=run_folders,
    ),
]
WithView = Annotated[
    bool,
    typer.Option("--view", help="Write the 3-D page view.html too, as cellplan view does."),
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
    near: Near = None,
    as_json: AsJson = False,
    keep_rejected: KeepRejected = False,
    with_view: WithView = False,
    watch: Watch = False,
    plots: PlotFormats = None,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Plan, check, and write joint tables, report and plots.

    The tables are written only when every check passes. Exit status: 0 passed, 1 a check failed, 2 bad input,
    3 no solution, 4 internal error, 130 interrupted.
    """
    overrides = {
        "mode": mode,
        "method": method,
        "integrator": integrator,
        "duration": duration,
        "clearance_mm": clearance_mm,
    }
    request = _Request(
        cell=cell,
        output=output,
        settings=tuple(settings or ()),
        overrides=overrides,
        task=task,
        near=near,
        keep_rejected=keep_rejected,
        with_view=with_view,
        plot_formats=tuple(plots or ()),
        allow_dirs=tuple(allow_dir or ()),
    )
    if watch:
        _watch(request, as_json=as_json, quiet=quiet)
    with json_failure(SCHEMA, desired=as_json), progress_listener(quiet=quiet) as progress:
        result = _solved(request, lambda _: None, progress)
    present(result, as_json=as_json)
    raise typer.Exit(result.status)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Request:
    """What is to be solved and written, as the options say."""

    cell: Path
    output: Path | None
    settings: tuple[str, ...]
    overrides: Mapping[str, str | float | None]
    task: str | None
    near: Path | None
    keep_rejected: bool
    with_view: bool
    plot_formats: tuple[str, ...]
    allow_dirs: tuple[Path, ...]


def _solved(request: _Request, follow: "Callable[[Cell], None]", progress: Listener) -> Result:
    """Solve and write; ``follow`` is called with the cell as soon as it is read."""
    from cellplan.io.cell.load import load_cell
    from cellplan.io.run.folder import refuse_unless_replaceable
    from cellplan.pipeline.overrides import require_task, with_overrides
    from cellplan.pipeline.parallel import solve_in_parallel
    from cellplan.planning.transfer.best_try import BlockedTransferError
    from cellplan.report.plots.rendering import require_formats

    require_formats(request.plot_formats)
    given = load_cell(request.cell, allow_dirs=request.allow_dirs)
    follow(given)
    changed = with_overrides(given, request.settings, **request.overrides)
    require_task(changed, request.task)
    folder = request.output or Path("outputs") / changed.name
    refuse_unless_replaceable(folder)
    try:
        solution = solve_in_parallel(changed, task=request.task, near=request.near, progress=progress)
    except BlockedTransferError as error:
        raise _with_page(error, folder) from error
    record = _written(solution, folder, request, progress)
    return _result(request, changed, solution, record, folder)


def _with_page(error: "BlockedTransferError", folder: Path) -> "BlockedTransferError":
    """The error with the 3-D page of the best try, which is written beside the run folder."""
    from cellplan.pipeline.view.write import write_view_of_blocked

    page = folder.with_name(f"{folder.name}-{error.name or 'transfer'}.html")
    shown = f"; 3-D page of the best try: {page}" if write_view_of_blocked(error, page) else ""
    return type(error)(error.place, f"{error.what}{shown}", name=error.name)


def _result(request: _Request, changed: "Cell", solution: "Solution", record: "Record", folder: Path) -> Result:
    """What to say of a solution that was written."""
    from cellplan.cli.next_steps import after_solve, view_line
    from cellplan.cli.verbosity import log_effort
    from cellplan.report.text.run import summary_lines

    log_effort(record)
    status = ExitStatus.PASSED if solution.passed else ExitStatus.CHECK_FAILED
    lines = summary_lines(record, folder)
    lines += [f"3-D page: {folder / 'view.html'}"] if request.with_view else []
    lines += [] if request.with_view else [view_line(folder, request.cell, changed, request.allow_dirs)]
    if request.task is None:
        failed = [check["name"] for check in record["checks"] if not check["passed"]]
        lines += after_solve(request.cell, changed, failed, run=folder, allow_dirs=request.allow_dirs)
    lines += [solution.remark] if solution.remark and not solution.passed else []  # else the checks have settled it
    place = {"folder": str(folder), "report_path": str(folder / "report.html")}
    about = {"schema": SCHEMA, "status": record["status"], "exit": int(status), **place}
    return Result(status, lines, {**about, "report": record}, folder)


def _written(solution: "Solution", folder: Path, request: _Request, progress: Listener) -> "Record":
    """Write a run folder, with its 3-D page where that is desired."""
    from cellplan.pipeline.write_run import write_run

    record = write_run(
        solution,
        folder,
        keep_rejected=request.keep_rejected,
        formats=request.plot_formats,
        progress=progress,
    )
    if request.with_view:
        from cellplan.pipeline.view.write import write_view_of_run

        write_view_of_run(folder, solution.cell, progress=progress)
    return record


def _watch(request: _Request, *, as_json: bool, quiet: bool) -> NoReturn:
    """Solve again and again, beside a page that shows the latest result."""
    from cellplan.cli.watch import watch
    from cellplan.cli.watch_page import WatchPage

    run = request.output or Path("outputs") / request.cell.stem
    pages = [("report", "report.html"), *([("3-D page", "view.html")] if request.with_view else [])]
    watch(
        partial(_solved, request), request.cell, schema=SCHEMA, as_json=as_json, quiet=quiet, page=WatchPage(run, pages)
    )
