"""Refusals: what speaks against a recovery as the files of a run say already, before anything is computed."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

from cellplan.errors import InputError, raise_findings, refusals
from cellplan.files.input.findings import listed
from cellplan.files.run.content import RECOVER, RECOVERY
from cellplan.files.run.folder import refuse_unless_replaceable
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import ClockTable, Motion
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.report.verified_run import AnyRun, ReadRun
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.choice import Choice, exported_robots
from cellplan.programs.export.refusals import unmet_demands
from cellplan.programs.promises.promises import controllers_of

END: Final = 1e-9  # [s] by which a time may lie beyond the end: the rounding of a decimal


def default_folder(run: Path) -> Path:
    """Where the recovery of a run goes."""
    return run / RECOVER


def refuse_unless_recoverable(folder: Path, run: Path) -> None:
    """Refuse the run itself, and a folder that must not be written, before any work."""
    if folder.resolve() == run.resolve():
        raise InputError(f"{folder}: expected a folder of its own for the recovery, got the run's")
    if folder.exists() and folder.is_dir() and any(folder.iterdir()) and not (folder / RECOVERY).is_file():
        raise InputError(f"{folder}: expected an empty folder or a recovery, got something else")
    refuse_unless_replaceable(folder)


def refuse_recovery(
    run: ReadRun, *, at: float, frozen: Mapping[str, float], keep: Collection[str], formats: Iterable[str]
) -> None:
    """Refuse a recovery, and its programs in some formats, of which the files of a run say that they cannot be."""
    _require_within(run.end(), at, "--at")
    refuse_state(run.cell, run.clock(), at=at, frozen=frozen, keep=keep)
    raise_findings(refusals(*(partial(recovery_frame, run, form) for form in formats)))


def refuse_state(
    cell: Cell, motion: Motion | ClockTable, *, at: float, frozen: Mapping[str, float], keep: Collection[str]
) -> None:
    """Refuse what ``stopped_state`` cannot make, and robots that hold the part at different times; call it early."""
    names = [robot.name for robot in cell.robots]
    _require_time(motion, at, "--at")
    for option, given in (("--frozen", frozen), ("--keep", keep)):
        for name in given:
            if name not in names:
                raise InputError(f"{option}: expected the name of a robot ({listed(names)}), got '{name}'")
    for name, time in frozen.items():
        _require_time(motion, time, f"--frozen {name}")
    if cell.motion.locked:
        raise InputError("--at: expected a run in which no joint fails, got one with motion.locked_joints")
    times = standing_times(cell, at, frozen)
    holders = {name: times[name] for name in cell.positioners}
    if len(set(holders.values())) > 1:
        stated = listed(f"{name}@{time:g}" for name, time in holders.items())
        raise InputError(f"--frozen: expected one time for all robots that hold the part together, got {stated}")


def standing_times(cell: Cell, at: float, frozen: Mapping[str, float]) -> dict[str, float]:
    """Time of the program in [s] at which each robot stands, by its name."""
    return {robot.name: float(frozen.get(robot.name, at)) for robot in cell.robots}


def _require_time(motion: Motion | ClockTable, time: float, option: str) -> None:
    """Refuse a time at which the program has no rows."""
    _require_within(float(motion.times[-1]), time, option)
    for row, name in motion.gaps.items():
        if motion.times[row - 1] < time < motion.times[row]:
            raise InputError(
                f"{option}: expected a time at which the program has rows, got {time:g}, in the motion '{name}' that "
                "is not part of it"
            )


def _require_within(end: float, time: float, option: str) -> None:
    """Refuse a time before or after the program, whose last row is at ``end``; both in [s]."""
    if not -END <= time <= end + END:
        raise InputError(f"{option}: expected a time of the program, 0 to {end:g} s, got {time:g}")


def recovery_frame(run: AnyRun, form: str) -> ExportFrame:
    """What a reader may know of the programs of a recovery; call it early.

    ``InputError`` with all that the cell does not state, or where the format is a table of all robots.
    """
    if form not in DIALECTS:
        raise InputError(f"--for: expected a format of programs of single robots, got {form}, a table of all robots")
    cell, dialect = run.cell, DIALECTS[form]
    robots = exported_robots(cell, dialect, ())
    promise = _promise(cell, dialect, robots)
    frame = ExportFrame(cell=cell, robots=robots, programs=(None,), promise=promise)
    raise_findings(unmet_demands(run, dialect, frame, Choice()))
    return frame


def _promise(cell: Cell, dialect: Dialect, robots: Sequence[str]) -> Promise:
    """What can be promised of a recovery: robots of one controller go in step, or else they wait for one another."""
    in_step = len(robots) == len(cell.robots) > 1 and len(set(controllers_of(cell, robots).values())) == 1
    order = (Promise.SYNCHRONISED,) if in_step else ()
    return next(promise for promise in (*order, Promise.SEQUENCE_ONLY, Promise.TIMED) if promise in dialect.promises)
