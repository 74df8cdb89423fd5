"""``cellplan rehearse``: execute a solved program on cells with errors and correct it from measurements."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import cell_files
from cellplan.cli.options import AllowDirs, AsJson, CellFile, PlotFormats, Quiet, Settings
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus

SCHEMA = "cellplan.rehearse/1"

ErrorsFile = Annotated[
    Path,
    typer.Option(
        "--errors",
        metavar="FILE",
        help="Errors of the real cell (YAML).",
        show_default=False,
        autocompletion=cell_files,
    ),
]
Feedback = Annotated[
    bool, typer.Option("--feedback", help="Correct the references from pass to pass until the true error converges.")
]
InPass = Annotated[
    bool, typer.Option("--in-pass", help="Also execute with the measured error fed back from sample to sample.")
]
Rounds = Annotated[int, typer.Option("--rounds", metavar="N", help="Maximum number of corrections.")]
Trials = Annotated[
    int | None, typer.Option("--trials", metavar="N", help="Number of sampled cells (default: as in the file).")
]
Seed = Annotated[int | None, typer.Option("--seed", metavar="N", help="Seed of the samples (default: as in the file).")]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder (default: outputs/<cell name>/rehearsal).")
]


def rehearse(  # noqa: PLR0913, PLR0917 - the options of the command
    cell: CellFile,
    errors: ErrorsFile,
    feedback: Feedback = False,
    in_pass: InPass = False,
    rounds: Rounds = 20,
    trials: Trials = None,
    seed: Seed = None,
    settings: Settings = None,
    output: Output = None,
    plots: PlotFormats = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Execute the solved program on perturbed cells and report the true errors of the tools on the part.

    Exit status: 0 the true errors are within tolerance (with --feedback: after correction), 1 they are not,
    2 bad input, 3 no solution, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.io.cell.load import load_cell
        from cellplan.io.cell_errors import load_errors
        from cellplan.io.run.folder import REHEARSAL, refuse_unless_replaceable
        from cellplan.pipeline.overrides import with_draws, with_overrides
        from cellplan.pipeline.rehearsal.rehearse import rehearse as rehearse_cell
        from cellplan.pipeline.rehearsal.result import summary_lines, write_rehearsal
        from cellplan.report.plots.rendering import require_formats

        require_formats(plots or ())
        changed = with_overrides(load_cell(cell, allow_dirs=allow_dir or ()), settings or ())
        stated = with_draws(load_errors(errors, changed), trials=trials, seed=seed)
        folder = output or Path("outputs") / changed.name / REHEARSAL
        refuse_unless_replaceable(folder)
        with progress_listener(quiet=quiet) as progress:
            rehearsal = rehearse_cell(
                changed, stated, feedback=feedback, in_pass=in_pass, rounds=rounds, progress=progress
            )
            record = write_rehearsal(rehearsal, folder, formats=plots or (), progress=progress)
    status = ExitStatus.PASSED if rehearsal.passed else ExitStatus.CHECK_FAILED
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "rehearsal.html")}
        say_json({"schema": SCHEMA, "status": record["status"], "exit": int(status), **place, "rehearsal": record})
    else:
        show(summary_lines(record, folder), passed=rehearsal.passed)
    raise typer.Exit(status)
