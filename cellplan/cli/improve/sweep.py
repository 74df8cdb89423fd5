"""``cellplan sweep``: solve every combination of some values of a cell, and compare what comes of them."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.request import option
from cellplan.cli.terminal.errors import resumable
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class SweepOptions(shared.StudyOptions):
    """What is varied, and where the study is written."""

    SCHEMA = "cellplan.study/1"

    cell: shared.CellFile
    vary: Annotated[
        tuple[str, ...],
        option(
            "--vary KEY=…",
            "Values of a key of the cell file: FROM:TO:STEP or VALUE,VALUE,…; repeated for all combinations.",
        ),
    ]
    output: Annotated[Path | None, option("-o, --output DIR", "Study folder (default: outputs/<cell name>-sweep).")] = (
        None
    )
    mode: shared.Mode = None


def sweep(options: SweepOptions) -> Result:
    """Solve every combination of some values and write one table, one page and one line for each variant.

    A variant that fails is a row with its reason. Exit status: 0 at least one variant passed, 1 none did, 2 bad input,
    130 interrupted (--resume goes on).
    """
    from cellplan.cli.options.crew import crew
    from cellplan.files.cell.load import load_cell
    from cellplan.jobs.sweep.result import study_lines
    from cellplan.jobs.sweep.sweep import SweepJob, files_of
    from cellplan.jobs.sweep.sweep import sweep as run_sweep
    from cellplan.study.variants import read_axis

    axes = [read_axis(text) for text in options.vary]
    name = load_cell(options.cell, allow_dirs=options.allow_dirs).name
    folder = options.output or Path("outputs") / f"{name}-sweep"
    settings = options.settings if options.mode is None else (f"motion.mode={options.mode}", *options.settings)
    job = options.to(SweepJob, settings=settings, runs=folder if options.keep_runs else None)
    with (
        crew(options.workers, options.scheduler, partial(files_of, job, axes), keep_runs=options.keep_runs) as workers,
        progress_listener(quiet=options.quiet) as progress,
        resumable(),
    ):
        record = run_sweep(job, axes, folder, workers=workers, resume=options.resume, progress=progress)
    status = ExitStatus.PASSED if record["counts"]["passed"] else ExitStatus.CHECK_FAILED
    return result_of_folder(options.schema, status, study_lines(record, folder), folder / "study.html", study=record)
