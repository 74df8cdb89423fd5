"""``cellplan recover``: retract-and-home joint tables from where a cell has stopped."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

from cellplan.cli.options import shared
from cellplan.cli.options.completion import one_of
from cellplan.cli.options.given_options import require_choice
from cellplan.cli.options.request import option
from cellplan.cli.terminal.output import Result, notes
from cellplan.cli.terminal.progress import progress_listener
from cellplan.errors import ExitStatus, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class RecoverOptions(shared.JobOptions):
    """Where a cell has stopped, and where its recovery is written."""

    SCHEMA = "cellplan.recovery/1"

    run: shared.RunDir
    at: Annotated[float, option("--at S", "Time of the program at which the cell stands.")]
    frozen: Annotated[
        tuple[str, ...],
        option(
            "--frozen ROBOT@S", "This robot stands where it is at another time, such as kuka@1.30; may be repeated."
        ),
    ] = ()
    keep: Annotated[tuple[str, ...], option("--keep ROBOT", "This robot is to stand still; may be repeated.")] = ()
    speed: Annotated[
        str | None,
        option(
            "--speed PERCENT",
            "Speed of all moves in percent of what joints can do, such as 25%; that of program.transfer when absent.",
        ),
    ] = None
    tcp_speed: Annotated[
        float | None,
        option(
            "--tcp-speed MM_S", "Largest speed of any tool tip, flange and point of a held part in mm/s, such as 250."
        ),
    ] = None
    formats: Annotated[
        tuple[str, ...],
        option(
            "--for FORMATS",
            "Write programs in these formats too, such as rapid,krl; may be repeated.",
            autocompletion=one_of("cellplan.programs.dialects:DIALECTS"),
        ),
    ] = ()
    output: Annotated[Path | None, option("-o, --output DIR", "Folder (default: RUN/recover).")] = None
    cell: shared.OriginalCell = None
    without_cell: shared.WithoutCell = False
    controllers: shared.Controllers = None


def recover(options: RecoverOptions) -> Result:
    """Write joint tables, and programs, that bring a stopped cell off the part and home.

    The run is verified first, and the tables of the recovery after they are written, as those of a run are; programs
    too. Exit status: 0 written, 1 a check fails, 2 bad input, or a run that is changed or stale, 3 no recovery was
    found (the reason is written, no tables), 4 internal error.
    """
    from cellplan.files.cell.reader_process import begin_reading

    begin_reading(options.cell)
    from cellplan.jobs.recover.refusals import default_folder, refuse_recovery, refuse_unless_recoverable
    from cellplan.programs.export.exporters import formats_for
    from cellplan.runs.gate.open_gate import open_gate

    at, frozen, keep = options.at, frozen_times(options.frozen), options.keep
    require_choice(options.cell, without_cell=options.without_cell)
    limits = speed_limits(options.speed, options.tcp_speed)
    folder = options.output or default_folder(options.run)
    refuse_unless_recoverable(folder, options.run)
    formats = formats_for(options.formats)
    refuse = partial(refuse_recovery, at=at, frozen=frozen, keep=keep, formats=formats)
    with progress_listener(quiet=options.quiet) as progress:
        run = open_gate(options.run, **shared.sources(options), refuse=refuse, progress=progress)
        from cellplan.jobs.recover.programs import recovery_programs
        from cellplan.jobs.recover.recover import recover as recovered
        from cellplan.jobs.recover.result import recovery_lines, write_recovery
        from cellplan.jobs.view.write import write_view_of_blocked
        from cellplan.report.page.render import VIEW_PAGE

        transfer = run.cell.program.transfer.changed(**limits)
        recovery = recovered(run, at=at, frozen=frozen, keep=keep, transfer=transfer, progress=progress)
        programs = {form: recovery_programs(run, recovery, form) for form in formats if recovery.succeeded}
        record = write_recovery(recovery, folder, programs)
        page = folder / VIEW_PAGE
        is_shown = recovery.blocked is not None and write_view_of_blocked(recovery.blocked, page)
    status = ExitStatus.PASSED if recovery.succeeded else ExitStatus.NO_SOLUTION
    verdict, *lines = recovery_lines(record)
    stored = [f"programs: {folder / 'programs'}"] if programs else []
    place = f"tables: {folder / 'tables'}" if recovery.succeeded else f"reason: {folder / 'recovery.json'}"
    about = {"exit": int(status), "folder": str(folder), "remarks": list(run.remarks)}
    shown = [f"3-D page of the best try: {page}"] if is_shown else []
    return Result(status, [verdict, *notes(run.remarks), *lines, place, *stored, *shown], {**record, **about})


def speed_limits(speed: str | None, tcp_speed: float | None) -> dict[str, float]:
    """What is given of ``program.transfer``: by a text such as ``25%``, and by a speed in mm/s."""
    from cellplan.model.settings.entry import FASTEST_MM_S
    from cellplan.model.settings.program import LEAST_PERCENT

    limits: dict[str, float] = {}
    if speed is not None:
        try:
            limits["speed_percent"] = percent = float(speed.removesuffix("%"))
        except ValueError:
            percent = math.nan
        if not LEAST_PERCENT <= percent <= 100.0:
            raise InputError(f"--speed: expected {LEAST_PERCENT:g} to 100 percent, such as 25%, got '{speed}'")
    if tcp_speed is not None:
        if not 0.0 < tcp_speed <= FASTEST_MM_S:
            raise InputError(f"--tcp-speed: expected a speed above 0 up to {FASTEST_MM_S:g} mm/s, got {tcp_speed:g}")
        limits["tcp_mm_s"] = tcp_speed
    return limits


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
