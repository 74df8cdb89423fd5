"""``cellplan verify``: verify a run on disk again."""

import typer

from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, RunDir
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.cli.verbosity import log_effort
from cellplan.errors import ExitStatus, NotVerifiedError

SCHEMA = "cellplan.verify/1"


def verify(
    run: RunDir,
    cell: OriginalCell = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Verify a run on disk again: files, inputs, tables and report, without planning.

    Exit status: 0 verified, 1 a check fails, 2 not a run, changed or stale, 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.cli.next_steps import export_line
        from cellplan.pipeline.gate.open_gate import open_gate
        from cellplan.report.text.failures import count_text
        from cellplan.report.text.run import figure_lines, motion_text, read_record

        try:
            with progress_listener(quiet=quiet) as progress:
                verified = open_gate(run, cell=cell, allow_dirs=allow_dir or (), progress=progress)
        except NotVerifiedError as error:
            if not as_json:
                raise
            failure = {"schema": SCHEMA, "status": "failed", "exit": int(error.status), "folder": str(run)}
            say_json({**failure, "errors": error.findings})
            raise typer.Exit(error.status) from None
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
