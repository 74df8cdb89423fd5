"""``cellplan sweep``: solve every combination of some values of a cell, and compare what comes of them."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.errors import InterruptedWorkError
from cellplan.cli.options import AllowDirs, AsJson, CellFile, Mode, PlotFormats, Quiet, Settings, TaskName
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.study/1"

Vary = Annotated[
    list[str],
    typer.Option(
        "--vary",
        metavar="KEY=…",
        help="Values of a key of the cell file: FROM:TO:STEP or VALUE,VALUE,…; repeated for all combinations.",
        show_default=False,
    ),
]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="DIR", help="Study folder (default: outputs/<cell name>-sweep)."),
]
Workers = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", help="Processes that solve (default: one for each processor).", min=1),
]
Resume = Annotated[bool, typer.Option("--resume", help="Continue the study in the folder.")]
KeepRuns = Annotated[bool, typer.Option("--keep-runs", help="Keep the run folder of every variant below runs/.")]


def sweep(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    vary: Vary,
    output: Output = None,
    mode: Mode = None,
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
    """Solve every combination of some values and write one table, one page and one line for each variant.

    A variant that fails is a row with its reason. Exit status: 0 at least one variant passed, 1 none did, 2 bad input,
    130 interrupted (--resume goes on).
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.guard import processors
        from cellplan.io.cell.load import load_cell
        from cellplan.pipeline.sweep import SweepJob
        from cellplan.pipeline.sweep import sweep as run_sweep
        from cellplan.pipeline.sweep_result import study_lines
        from cellplan.study.variants import read_axis

        axes = [read_axis(text) for text in vary]
        given = load_cell(cell, allow_dirs=allow_dir or ())
        folder = output or Path("outputs") / f"{given.name}-sweep"
        of_mode = (f"motion.mode={mode}",) if mode is not None else ()
        job = SweepJob(
            cell=cell,
            allow_dirs=tuple(allow_dir or ()),
            settings=(*of_mode, *(settings or ())),
            task=task,
            runs=folder if keep_runs else None,
            formats=tuple(plots or ()),
        )
        with progress_listener(quiet=quiet) as progress:
            try:
                record = run_sweep(job, axes, folder, workers=workers or processors(), resume=resume, progress=progress)
            except KeyboardInterrupt as error:
                raise InterruptedWorkError(str(error) or "interrupted") from None
    status = ExitStatus.PASSED if record["counts"]["passed"] else ExitStatus.CHECK_FAILED
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "study.html")}
        say_json({"schema": SCHEMA, "exit": int(status), **place, "study": record})
    else:
        show(study_lines(record, folder), passed=status == ExitStatus.PASSED)
    raise typer.Exit(status)
