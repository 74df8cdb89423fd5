"""``cellplan recover``: retract-and-home joint tables from where a cell has stopped."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from cellplan.cli.export import WithoutCell, require_choice
from cellplan.cli.options import AllowDirs, AsJson, OriginalCell, Quiet, RunDir
from cellplan.cli.output import json_failure, say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus, InputError

SCHEMA = "cellplan.recovery/1"

At = Annotated[
    float, typer.Option("--at", metavar="S", help="Time of the program at which the cell stands.", show_default=False)
]
Frozen = Annotated[
    list[str] | None,
    typer.Option(
        "--frozen",
        metavar="ROBOT@S",
        help="This robot stands where it is at another time, such as kuka@1.30; may be repeated.",
        show_default=False,
    ),
]
Keep = Annotated[
    list[str] | None,
    typer.Option("--keep", metavar="ROBOT", help="This robot is to stand still; may be repeated.", show_default=False),
]
Output = Annotated[Path | None, typer.Option("-o", "--output", metavar="DIR", help="Folder (default: RUN/recover).")]


def recover(  # noqa: PLR0913, PLR0917 - the options of the command
    run: RunDir,
    at: At,
    frozen: Frozen = None,
    keep: Keep = None,
    output: Output = None,
    cell: OriginalCell = None,
    without_cell: WithoutCell = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    allow_dir: AllowDirs = None,
) -> None:
    """Write joint tables that bring a stopped cell off the part and home.

    The run is verified first, and the tables of the recovery after they are written, as those of a run are. Exit
    status: 0 written, 1 a check fails, 2 bad input, or a run that is changed or stale, 3 no recovery was found (the
    reason is written, no tables), 4 internal error.
    """
    with json_failure(SCHEMA, desired=as_json):
        from cellplan.pipeline.gate.open_gate import open_gate
        from cellplan.pipeline.recover.recover import recover as recovered
        from cellplan.pipeline.recover.state import refuse_state
        from cellplan.pipeline.recover.write import default_folder, refuse_unless_recoverable, write_recovery
        from cellplan.report.text.recovery import recovery_lines

        times = frozen_times(frozen or ())
        require_choice(cell, without_cell=without_cell)
        folder = output or default_folder(run)
        refuse_unless_recoverable(folder, run)
        with progress_listener(quiet=quiet) as progress:
            verified = open_gate(
                run,
                cell=cell,
                allow_dirs=allow_dir or (),
                refuse=lambda read: refuse_state(read.cell, read.motion, at=at, frozen=times, keep=keep or ()),
                progress=progress,
            )
            found = recovered(verified, at=at, frozen=times, keep=keep or (), progress=progress)
            record = write_recovery(found, folder)
    status = ExitStatus.PASSED if found.found else ExitStatus.NO_SOLUTION
    if as_json:
        say_json({**record, "exit": int(status), "folder": str(folder), "remarks": list(verified.remarks)})
    else:
        notes = [f"  note: {remark}" for remark in verified.remarks]
        lines = recovery_lines(record)
        below = [f"tables: {folder / 'tables'}"] if found.found else [f"reason: {folder / 'recovery.json'}"]
        show([*lines[:1], *notes, *lines[1:], *below], passed=found.found)
    if not found.found:
        raise typer.Exit(status)


def frozen_times(texts: Sequence[str]) -> dict[str, float]:
    """Time in [s] by robot from texts such as ``kuka@1.30``.

    Raises:
        InputError: A text is another one, or a robot stands twice.
    """
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
