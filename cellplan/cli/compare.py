"""``cellplan compare``: one cell in every mode, or several cells and runs, side by side."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import cell_files
from cellplan.cli.errors import InterruptedWorkError
from cellplan.cli.options import AllowDirs, AsJson, PlotFormats, Quiet, Settings, TaskName
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.cli.sweep import KeepRuns, Resume, Workers
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.study/1"

Subjects = Annotated[
    list[Path],
    typer.Argument(
        metavar="CELL_OR_RUN",
        help="One cell file, to compare its modes; or several cell files and run folders.",
        show_default=False,
        autocompletion=cell_files,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Study folder (default: outputs/<cell name>-compare)."),
]


def compare(  # noqa: PLR0913, PLR0917 - the options of the command
    subjects: Subjects,
    output: Output = None,
    settings: Settings = None,
    task: TaskName = None,
    workers: Workers = None,
    resume: Resume = False,
    keep_runs: KeepRuns = False,
    plots: PlotFormats = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Compare the modes of one cell, or several cells and runs: one table, one page, and what pays.

    What fails or cannot be planned is a column with its reason. Exit status: 0 at least one passed, 1 none did, 2 bad
    input, 130 interrupted (--resume goes on).
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.guard import processors
        from cellplan.pipeline.compare.compare import CompareJob, first_name
        from cellplan.pipeline.compare.compare import compare as run_comparison
        from cellplan.pipeline.compare.result import comparison_lines

        job = CompareJob(
            subjects=tuple(subjects),
            allow_dirs=tuple(allow_dir or ()),
            settings=tuple(settings or ()),
            task=task,
            formats=tuple(plots or ()),
        )
        folder = output or Path("outputs") / f"{first_name(job)}-compare"
        job = replace(job, runs=folder if keep_runs else None)
        with progress_listener(quiet=quiet) as progress:
            try:
                record = run_comparison(job, folder, workers=workers or processors(), resume=resume, progress=progress)
            except KeyboardInterrupt as error:
                raise InterruptedWorkError(str(error) or "interrupted") from None
    status = exit_status(record["counts"])
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "study.html")}
        say_json({"schema": SCHEMA, "exit": int(status), **place, "study": record})
    else:
        show(comparison_lines(record, folder), passed=status == ExitStatus.PASSED)
    raise typer.Exit(status)


def exit_status(counts: dict[str, int]) -> ExitStatus:
    """Passed if one variant did; bad input if none is a valid cell."""
    if counts["passed"]:
        return ExitStatus.PASSED
    others = counts["failed"] + counts["no_solution"] + counts["crashed"]
    return ExitStatus.CHECK_FAILED if others else ExitStatus.BAD_INPUT
