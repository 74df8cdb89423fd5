"""``cellplan layout --repair``: what makes a failing cell pass."""

from pathlib import Path
from typing import Final, NoReturn

import typer

from cellplan.cli.output import say_json, show
from cellplan.cli.progress import progress_listener
from cellplan.errors import ExitStatus
from cellplan.guard import processors
from cellplan.io.cell.load import load_cell
from cellplan.io.run.folder import refuse_unless_replaceable
from cellplan.pipeline.layout.request import LayoutRequest
from cellplan.pipeline.repair.record import SCHEMA
from cellplan.pipeline.repair.repair import repair
from cellplan.pipeline.repair.result import advice_lines, write_repair

STATUSES: Final = {
    "passes": ExitStatus.PASSED,
    "repaired": ExitStatus.PASSED,
    "no_remedy": ExitStatus.CHECK_FAILED,
    "no_motion": ExitStatus.NO_SOLUTION,
}


def run_repair(
    request: LayoutRequest, output: Path | None, *, workers: int | None, as_json: bool, quiet: bool
) -> NoReturn:
    """Repair a cell, write and show what was found, and end the command.

    Args:
        request: What is repaired.
        output: Folder of the repair; None for the usual one.
        workers: Number of processes; None for one for each processor.
        as_json: Whether the record is shown as JSON.
        quiet: Whether no progress is shown.
    """
    folder = output or Path("outputs") / f"{load_cell(request.cell, allow_dirs=request.allow_dirs).name}-repair"
    refuse_unless_replaceable(folder)
    with progress_listener(quiet=quiet) as progress:
        found = repair(request, workers=workers or processors(), progress=progress)
        record = write_repair(found, request, folder)
    status = STATUSES[record["status"]]
    if as_json:
        place = {"folder": str(folder), "report_path": str(folder / "advice.html")}
        say_json({"schema": SCHEMA, "exit": int(status), **place, "advice": record})
    else:
        show(advice_lines(record, folder, request.cell), passed=status == ExitStatus.PASSED)
    raise typer.Exit(status)
