"""Verification before export: a run on disk is opened only when all of its content is verified again."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

from cellplan.cache import without_cache
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.findings import listed
from cellplan.files.run.clock_table import last_time, parse_clock
from cellplan.files.run.stored import CELL, CLOCK, StoredRun, read_stored_run
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import ACCESS_TOKEN, ReadRun, VerifiedRun
from cellplan.planning.modes import homeless
from cellplan.runs.gate.stored_cell import load_stored_cell
from cellplan.runs.gate.stored_rows import StoredRows, read_rows
from cellplan.runs.plan.demanded import DemandedProgram


@without_cache()  # a proof rests on the files themselves
def open_gate(
    folder: Path | str,
    *,
    cell: Path | str | None = None,
    controllers: Path | str | None = None,
    allow_dirs: Sequence[Path] = (),
    refuse: Callable[[ReadRun], object] | None = None,
    progress: Progress = silent,
) -> VerifiedRun:
    """Verify a run on disk with this version of the program; the result can be exported.

    Every file must be as it was written and every input as it was read. The tables are read back, all checks are made
    again by a kinematics that shares nothing with the planner, and the report must agree with the results.

    Args:
        folder: The run folder.
        cell: The cell file that was solved; None when it is not available.
        controllers: A file of names of tasks, signals, tools and frames that take the place of those of the cell.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.
        refuse: Called when the cell is read, before anything is verified; raises what speaks against use of the run.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The folder is not a whole, unchanged run, or an input has changed.
        NotVerifiedError: The run failed, or a check fails now.
    """
    stored = read_stored_run(Path(folder))
    _refuse_failed(stored)
    source = load_stored_cell(stored, cell=cell, allow_dirs=allow_dirs, controllers=controllers)
    demanded = _demanded(source.cell, stored)
    read = cache(partial(read_rows, stored, source.cell, demanded))
    if refuse is not None:
        refuse(replace(_read_run(stored, source.cell, demanded, read), names=source.names))
    from cellplan.runs.gate.verified_rows import verified_rows  # what is refused until here needs none of it

    rows = read()
    motions, remarks = verified_rows(rows, source.cell, progress=progress)
    return VerifiedRun(
        folder=stored.folder,
        digest=stored.digest,
        cell=source.cell,
        motion=rows.motion,
        motions=motions,
        file_count=len(stored.manifest.files),
        inputs_compared=source.compared,
        remarks=(*source.remarks, *remarks),
        names=source.names,
        token=ACCESS_TOKEN,
    )


def read_run(stored: StoredRun, cell: Cell) -> ReadRun:
    """What the files of a run that passed say, before anything in them is verified.

    Args:
        cell: The cell of the run, compared with its sources.
    """
    _refuse_failed(stored)
    demanded = _demanded(cell, stored)
    return _read_run(stored, cell, demanded, cache(partial(read_rows, stored, cell, demanded)))


def _read_run(stored: StoredRun, cell: Cell, demanded: DemandedProgram, read: Callable[[], StoredRows]) -> ReadRun:
    """The run as it is before anything is verified."""
    file = stored.file("", f"tables/{CLOCK}.csv")
    return ReadRun(
        folder=stored.folder,
        digest=stored.digest,
        cell=cell,
        motions=tuple(demanded.labels),
        phases=demanded.plan.program,
        end=lambda: last_time(stored.clock, file),
        clock=lambda: parse_clock(stored.clock, file).table,
        rows=lambda: read().motion,
    )


def _refuse_failed(stored: StoredRun) -> None:
    """Refuse a run that failed when it was solved."""
    if stored.manifest.status != "passed":
        failed = [
            check for check in stored.record.get("checks", []) if isinstance(check, dict) and not check.get("passed")
        ]
        first = f": {failed[0].get('message')}" if failed else ""
        raise NotVerifiedError([f"{stored.folder}: the run failed{first}; it has no tables to verify"])


def _demanded(cell: Cell, stored: StoredRun) -> DemandedProgram:
    """The program that the stored phases must be: all tasks of the cell, or the one that was chosen."""
    file = stored.file("", "report.json")
    only = None if cell.program.is_home_to_home else _only_task(cell, stored, file)
    demanded = DemandedProgram.of(cell, only=only)
    phases = demanded.plan.program
    unknown = sorted({name for phase in phases for name in homeless(cell, phase)})
    if demanded.stages:
        unknown = [robot.name for robot in cell.robots if robot.home is None]
    if unknown:
        raise InputError(
            f"{stored.file('', CELL)}: robots: expected an explicit home of every idle robot, got auto for "
            f"{listed(unknown)}"
        )
    if demanded.labels != list(stored.records):
        raise InputError(f"{file}: expected the phases of the mode {cell.motion.mode}, got {listed(stored.records)}")
    return demanded


def _only_task(cell: Cell, stored: StoredRun, file: str) -> str | None:
    """Name of the only task that was chosen; None for all."""
    tasks = list(stored.record["tasks"])
    every = [task.name for task in cell.tasks]
    if tasks != every and (len(tasks) != 1 or tasks[0] not in every):
        raise InputError(f"{file}: tasks: expected {listed(every)} or one of them, got {listed(map(str, tasks))}")
    return None if tasks == every else str(tasks[0])
