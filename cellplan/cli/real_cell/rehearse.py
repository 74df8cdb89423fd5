"""``cellplan rehearse``: execute a solved program on cells with errors and correct it from measurements."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import cell_files
from cellplan.cli.options.request import option
from cellplan.cli.terminal.output import Result, result_of_folder
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus


@dataclass(frozen=True, slots=True, kw_only=True)
class RehearseOptions(shared.JobOptions):
    """What is executed on which cells, and where it is written."""

    SCHEMA = "cellplan.rehearse/1"

    cell: shared.CellFile
    errors: Annotated[Path, option("--errors FILE", "Errors of the real cell (YAML).", autocompletion=cell_files)]
    feedback: Annotated[
        bool, option("--feedback", "Correct the references from pass to pass until the true error converges.")
    ] = False
    in_pass: Annotated[
        bool, option("--in-pass", "Also execute with the measured error fed back from sample to sample.")
    ] = False
    rounds: Annotated[int, option("--rounds N", "Maximum number of corrections.")] = 20
    trials: Annotated[int | None, option("--trials N", "Number of sampled cells (default: as in the file).")] = None
    seed: Annotated[int | None, option("--seed N", "Seed of the samples (default: as in the file).")] = None
    settings: shared.Settings = ()
    output: Annotated[Path | None, option("-o, --output DIR", "Folder (default: outputs/<cell name>/rehearsal).")] = (
        None
    )
    plots: shared.PlotFormats = ()


def rehearse(options: RehearseOptions) -> Result:
    """Execute the solved program on perturbed cells and report the true errors of the tools on the part.

    Exit status: 0 the true errors are within tolerance (with --feedback: after correction), 1 they are not,
    2 bad input, 3 no solution, 4 internal error.
    """
    from cellplan.files.cell.load import load_cell
    from cellplan.files.cell_errors import load_errors
    from cellplan.files.run.folder import REHEARSAL, refuse_unless_replaceable
    from cellplan.jobs.rehearsal.rehearse import rehearse as rehearse_cell
    from cellplan.jobs.rehearsal.result import summary_lines, write_rehearsal
    from cellplan.report.plots.rendering import require_formats
    from cellplan.runs.overrides import with_draws, with_overrides

    require_formats(options.plots)
    cell = with_overrides(load_cell(options.cell, allow_dirs=options.allow_dirs), options.settings)
    errors = with_draws(load_errors(options.errors, cell), trials=options.trials, seed=options.seed)
    folder = options.output or Path("outputs") / cell.name / REHEARSAL
    refuse_unless_replaceable(folder)
    with progress_listener(quiet=options.quiet) as progress:
        rehearsal = rehearse_cell(
            cell, errors, feedback=options.feedback, in_pass=options.in_pass, rounds=options.rounds, progress=progress
        )
        record = write_rehearsal(rehearsal, folder, formats=options.plots, progress=progress)
    status = ExitStatus.PASSED if rehearsal.passed else ExitStatus.CHECK_FAILED
    lines, page = summary_lines(record, folder), folder / "rehearsal.html"
    return result_of_folder(options.schema, status, lines, page, says=record["status"], rehearsal=record)
