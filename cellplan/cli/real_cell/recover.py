"""``cellplan recover``: retract-and-home joint tables from where a cell has stopped."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.given_options import require_choice
from cellplan.cli.options.request import Options, option
from cellplan.cli.terminal.output import Result, notes
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverOptions(Options):
    """Where a cell has stopped, and where its recovery is written."""

    SCHEMA = "cellplan.recovery/1"

    run: shared.RunDir
    at: Annotated[float, option("--at S", "Time of the program at which the cell stands.")]
    frozen: Annotated[
        tuple[str, ...],
        option(
            "--frozen ROBOT@S",
            "This robot stands where it is at another time, such as kuka@1.30; may be repeated.",
        ),
    ] = ()
    keep: Annotated[tuple[str, ...], option("--keep ROBOT", "This robot is to stand still; may be repeated.")] = ()
    output: Annotated[Path | None, option("-o, --output DIR", "Folder (default: RUN/recover).")] = None
    cell: shared.OriginalCell = None
    without_cell: shared.WithoutCell = False
    as_json: shared.AsJson = False
    quiet: shared.Quiet = False
    allow_dirs: shared.AllowDirs = ()


def recover(options: RecoverOptions) -> Result:
    """Write joint tables that bring a stopped cell off the part and home.

    The run is verified first, and the tables of the recovery after they are written, as those of a run are. Exit
    status: 0 written, 1 a check fails, 2 bad input, or a run that is changed or stale, 3 no recovery was found (the
    reason is written, no tables), 4 internal error.
    """
    from cellplan.jobs.recover.recover import recover as recovered
    from cellplan.jobs.recover.result import default_folder, recovery_lines, refuse_unless_recoverable, write_recovery
    from cellplan.jobs.recover.state import refuse_state
    from cellplan.runs.gate.open_gate import open_gate

    at, frozen, keep = options.at, frozen_times(options.frozen), options.keep
    require_choice(options.cell, without_cell=options.without_cell)
    folder = options.output or default_folder(options.run)
    refuse_unless_recoverable(folder, options.run)
    with progress_listener(quiet=options.quiet) as progress:
        run = open_gate(
            options.run,
            cell=options.cell,
            allow_dirs=options.allow_dirs,
            refuse=lambda read: refuse_state(read.cell, read.motion, at=at, frozen=frozen, keep=keep),
            progress=progress,
        )
        recovery = recovered(run, at=at, frozen=frozen, keep=keep, progress=progress)
        record = write_recovery(recovery, folder)
    status = ExitStatus.PASSED if recovery.succeeded else ExitStatus.NO_SOLUTION
    verdict, *lines = recovery_lines(record)
    place = f"tables: {folder / 'tables'}" if recovery.succeeded else f"reason: {folder / 'recovery.json'}"
    about = {"exit": int(status), "folder": str(folder), "remarks": list(run.remarks)}
    return Result(status, [verdict, *notes(run.remarks), *lines, place], {**record, **about})


def frozen_times(texts: Sequence[str]) -> dict[str, float]:
    """Time in [s] by robot from texts such as ``kuka@1.30``."""
    times: dict[str, float] = {}
    for text in texts:
        name, sign, time = text.rpartition("@")
        try:
            seconds = float(time)
        except ValueError:
            seconds = math.nan
        if not sign or not name or not math.isfinite(seconds):
            raise InputError(f"--frozen: expected ROBOT@S, such as kuka@1.30, got '{text}'")
        if name in times:
            raise InputError(f"--frozen: expected each robot once, got '{name}' twice")
        times[name] = seconds
    return times
