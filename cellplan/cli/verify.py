"""``cellplan verify``: verify a run on disk again, or the programs that were made from it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.completion import run_folders
from cellplan.cli.export import promise_lines
from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, RunDir
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.cli.verbosity import log_effort
from cellplan.errors import ExitStatus, InputError, NotVerifiedError

SCHEMA = "cellplan.verify/1"

OfRun = Annotated[
    Path | None,
    typer.Option(
        "--run",
        metavar="DIR",
        help="For exported programs: the run they were made from (default: the run folder around them).",
        autocompletion=run_folders,
    ),
]


def verify(
    run: RunDir,
    cell: OriginalCell = None,
    of_run: OfRun = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Verify a run on disk again: files, inputs, tables and report, without planning.

    A folder of exported programs is verified too: its files are read back and judged against the run.

    Exit status: 0 verified, 1 a check fails, 2 not a run, changed or stale, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.pipeline.export.stored import is_export

        if is_export(run):
            _verify_export(run, of_run, cell=cell, as_json=as_json, quiet=quiet, allow_dirs=allow_dir or ())
            return
        if of_run is not None:
            raise InputError("--run: expected a folder of exported programs with it, got a run folder")
        from cellplan.cli.next_steps import export_line
        from cellplan.pipeline.gate.open_gate import open_gate
        from cellplan.report.text.failures import count_text
        from cellplan.report.text.run import figure_lines, motion_text, read_record

        with _failures(run, as_json=as_json), progress_listener(quiet=quiet) as progress:
            verified = open_gate(run, cell=cell, allow_dirs=allow_dir or (), progress=progress)
        record = read_record(run)
        log_effort(record)
    if as_json:
        about = {"folder": str(run), "cell": verified.cell.name, "run": verified.digest, "files": verified.file_count}
        compared = {"inputs": list(verified.inputs_compared), "remarks": list(verified.remarks)}
        status = {"status": "verified", "exit": int(ExitStatus.PASSED)}
        say_json({"schema": SCHEMA, **status, **about, **compared, "report": record})
        return
    lines = [
        f"{verified.cell.name}: verified",
        f"  unchanged files: {verified.file_count}",
        f"  unchanged inputs: {', '.join(verified.inputs_compared) or 'none compared'}",
        *(f"  note: {remark}" for remark in verified.remarks),
        f"  {count_text(record['checks'])}; {motion_text(record)}",
        *figure_lines(record, "the report"),
        export_line(run, cell, allow_dir or ()),
    ]
    show(lines, passed=True)


@contextmanager
def _failures(folder: Path, *, as_json: bool) -> Iterator[None]:
    """Give a machine one JSON object when a check fails, and end with the status of that."""
    try:
        yield
    except NotVerifiedError as error:
        if not as_json:
            raise
        failure = {"schema": SCHEMA, "status": "failed", "exit": int(error.status), "folder": str(folder)}
        say_json({**failure, "errors": error.findings})
        raise typer.Exit(error.status) from None


def _verify_export(
    folder: Path, run: Path | None, *, cell: Path | None, as_json: bool, quiet: bool, allow_dirs: Sequence[Path]
) -> None:
    """Verify a folder of exported programs against the run that they were made from."""
    from cellplan.pipeline.export.program import require_format
    from cellplan.pipeline.export.stored import read_stored_export, refuse_other_run, run_of_export
    from cellplan.pipeline.export.verify_export import verify_export
    from cellplan.pipeline.gate.open_gate import open_gate

    stored = read_stored_export(folder)
    source = run or run_of_export(folder)
    require_format(stored.form)
    with _failures(folder, as_json=as_json), progress_listener(quiet=quiet) as progress:
        other = partial(refuse_other_run, stored)
        verified = open_gate(source, cell=cell, allow_dirs=allow_dirs, refuse=other, progress=progress)
        found = verify_export(stored, verified, progress=progress)
    remarks = [*verified.remarks, *found.remarks]
    if as_json:
        status = {"status": "verified", "exit": int(ExitStatus.PASSED)}
        about = {"folder": str(folder), "cell": verified.cell.name, "run": verified.digest, "files": len(stored.files)}
        compared = {"inputs": list(verified.inputs_compared), "remarks": remarks}
        say_json({"schema": SCHEMA, **status, **about, **compared, "export": dict(stored.record)})
        return
    lines = [f"{verified.cell.name}: programs verified ({stored.form})", f"  run: {source}"]
    lines += [*promise_lines(stored.record), *(f"  note: {remark}" for remark in remarks)]
    show(lines, passed=True)
