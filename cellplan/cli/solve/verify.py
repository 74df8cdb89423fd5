"""``cellplan verify``: verify a run on disk again, or the programs that were made from it."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import run_folders
from cellplan.cli.options.request import option
from cellplan.cli.solve.exported import promise_lines
from cellplan.cli.terminal.output import Result, notes
from cellplan.cli.terminal.progress import progress_listener
from cellplan.cli.terminal.verbosity import log_effort
from cellplan.errors import ExitStatus, InputError, NotVerifiedError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cellplan.model.report.verified_run import VerifiedRun


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifyOptions(shared.JobOptions):
    """What is verified."""

    SCHEMA = "cellplan.verify/1"

    run: shared.RunDir
    cell: shared.OriginalCell = None
    controllers: shared.Controllers = None
    of_run: Annotated[
        Path | None,
        option(
            "--run DIR",
            "For exported programs: the run they were made from (default: the run folder around them).",
            autocompletion=run_folders,
        ),
    ] = None


def verify(options: VerifyOptions) -> Result:
    """Verify a run on disk again: files, inputs, tables and report, without planning.

    A folder of exported programs is verified too: its files are read back and judged against the run.

    Exit status: 0 verified, 1 a check fails, 2 not a run, changed or stale, 4 internal error.
    """
    from cellplan.programs.export.stored import is_export

    try:
        if is_export(options.run):
            return _verified_programs(options)
        if options.of_run is not None:
            raise InputError("--run: expected a folder of exported programs with it, got a run folder")
        return _verified_run(options)
    except NotVerifiedError as error:
        if not options.as_json:
            raise
        about = {"schema": options.schema, "status": "failed", "exit": int(error.status), "folder": str(options.run)}
        return Result(error.status, (), {**about, "errors": error.findings})


def _verified_run(options: VerifyOptions) -> Result:
    from cellplan.cli.next_steps import export_line
    from cellplan.report.text.run import count_text, figure_lines, motion_text, read_record
    from cellplan.runs.gate.open_gate import open_gate

    with progress_listener(quiet=options.quiet) as progress:
        run = open_gate(options.run, **shared.sources(options), progress=progress)
    record = read_record(options.run)
    log_effort(record)
    lines = [
        f"{run.cell.name}: verified",
        f"  unchanged files: {run.file_count}",
        f"  unchanged inputs: {', '.join(run.inputs_compared) or 'none compared'}",
        *notes(run.remarks),
        f"  {count_text(record['checks'])}; {motion_text(record)}",
        *figure_lines(record, "the report"),
        export_line(options.run, options.cell, options.allow_dirs),
    ]
    about = _about(options, run, run.file_count, run.remarks)
    return Result(ExitStatus.PASSED, lines, {**about, "report": record})


def _verified_programs(options: VerifyOptions) -> Result:
    """Verify a folder of exported programs against the run that they were made from."""
    from cellplan.programs.export.exporters import require_format
    from cellplan.programs.export.stored import read_stored_export, refuse_other_run, run_of_export
    from cellplan.runs.gate.open_gate import open_gate

    stored = read_stored_export(options.run)
    source = options.of_run or run_of_export(options.run)
    require_format(stored.form)
    with progress_listener(quiet=options.quiet) as progress:
        other = partial(refuse_other_run, stored)
        run = open_gate(source, **shared.sources(options), refuse=other, progress=progress)
        from cellplan.jobs.recover.escape import verify_escape
        from cellplan.programs.export.verify_export import verify_export

        judge = verify_escape if "escape" in stored.record else verify_export
        outcome = judge(stored, run, progress=progress)
    remarks = [*run.remarks, *outcome.remarks]
    lines = [f"{run.cell.name}: programs verified ({stored.form})", f"  run: {source}"]
    lines += [*promise_lines(stored.record), *notes(remarks)]
    about = _about(options, run, len(stored.files), remarks)
    return Result(ExitStatus.PASSED, lines, {**about, "export": dict(stored.record)})


def _about(options: VerifyOptions, run: "VerifiedRun", files: int, remarks: "Sequence[str]") -> dict[str, object]:
    status = {"schema": options.schema, "status": "verified", "exit": int(ExitStatus.PASSED)}
    about = {"folder": str(options.run), "cell": run.cell.name, "run": run.digest, "files": files}
    return {**status, **about, "inputs": list(run.inputs_compared), "remarks": list(remarks)}
