"""``cellplan compare``: one cell in every mode, or several cells and runs, side by side."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import cell_files
from cellplan.cli.options.request import argument, option
from cellplan.cli.terminal.errors import resumable
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class CompareOptions(shared.StudyOptions):
    """What is compared, and where the study is written."""

    SCHEMA = "cellplan.study/1"

    subjects: Annotated[
        tuple[Path, ...],
        argument(
            "CELL_OR_RUN",
            "One cell file, to compare its modes; or several cell files and run folders.",
            autocompletion=cell_files,
        ),
    ]
    output: Annotated[
        Path | None, option("-o, --output DIR", "Study folder (default: outputs/<cell name>-compare).")
    ] = None
    feed: shared.Feed = None


def compare(options: CompareOptions) -> Result:
    """Compare the modes of one cell, or several cells and runs: one table, one page, and what pays.

    What fails or cannot be planned is a column with its reason. Exit status: 0 at least one passed, 1 none did, 2 bad
    input, 130 interrupted (--resume goes on).
    """
    from cellplan.cli.options.crew import crew
    from cellplan.jobs.compare.compare import CompareJob, files_of, first_name
    from cellplan.jobs.compare.compare import compare as run_comparison
    from cellplan.jobs.compare.result import comparison_lines

    job = options.to(CompareJob)
    folder = options.output or Path("outputs") / f"{first_name(job)}-compare"
    job = replace(job, runs=folder if options.keep_runs else None)
    with (
        crew(options.workers, options.scheduler, partial(files_of, job), keep_runs=options.keep_runs) as workers,
        progress_listener(quiet=options.quiet) as progress,
        resumable(),
    ):
        record = run_comparison(job, folder, workers=workers, resume=options.resume, progress=progress)
    status, lines = exit_status(record["counts"]), comparison_lines(record, folder)
    return result_of_folder(options.schema, status, lines, folder / "study.html", study=record)


def exit_status(counts: dict[str, int]) -> ExitStatus:
    """Passed if one variant did; bad input if none is a valid cell."""
    if counts["passed"]:
        return ExitStatus.PASSED
    others = counts["failed"] + counts["no_solution"] + counts["crashed"]
    return ExitStatus.CHECK_FAILED if others else ExitStatus.BAD_INPUT
