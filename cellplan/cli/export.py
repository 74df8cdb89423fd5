"""``cellplan export``: controller programs from a verified run."""

from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import FORMATS, one_of
from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, RunDir
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus, InputError

SCHEMA = "cellplan.exported/1"

Format = Annotated[
    str,
    typer.Option("--format", metavar="NAME", help="Format: csv.", show_default=False, autocompletion=one_of(FORMATS)),
]
Output = Annotated[
    Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder (default: RUN/programs/<format>).")
]
WithoutCell = Annotated[
    bool,
    typer.Option("--without-cell", help="Use the run's own copy of the cell, without comparison with the original."),
]


def export(  # noqa: PLR0913, PLR0917 - the options of the command
    run: RunDir,
    form: Format,
    output: Output = None,
    cell: OriginalCell = None,
    without_cell: WithoutCell = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Write controller programs, from a verified run only.

    The run is verified first, and the rounded numbers of the programs after that. Exit status: 0 written, 1 a check
    fails, 2 bad input, or a run that is changed or stale, 4 internal error. Nothing is written unless it is 0.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.pipeline.export import default_folder, export_program, refuse_unless_exportable, require_format
        from cellplan.pipeline.gate.open_gate import open_gate

        require_format(form)
        _require_choice(cell, without_cell=without_cell)
        folder = output or default_folder(run, form)
        refuse_unless_exportable(folder, run)
        with progress_listener(quiet=quiet) as progress:
            verified = open_gate(run, cell=cell, allow_dirs=allow_dir or (), progress=progress)
            files = export_program(verified, folder, form=form, progress=progress)
    if as_json:
        status = {"status": "exported", "exit": int(ExitStatus.PASSED)}
        about = {"folder": str(folder), "format": form, "run": verified.digest, "files": list(files)}
        say_json({"schema": SCHEMA, **status, **about, "remarks": list(verified.remarks)})
        return
    lines = [f"{verified.cell.name}: exported", *(f"  note: {remark}" for remark in verified.remarks)]
    show([*lines, f"programs: {folder}"], passed=True)


def _require_choice(cell: Path | None, *, without_cell: bool) -> None:
    """Require exactly one of the cell file that was solved and ``--without-cell``.

    Raises:
        InputError: Neither or both were given.
    """
    if cell is None and not without_cell:
        raise InputError(
            "--cell: expected the cell file that was solved, so that it and its files are compared with the run, got "
            "none; use --without-cell for the run's own copy of it"
        )
    if cell is not None and without_cell:
        raise InputError("--without-cell: expected no --cell beside it")
