"""Export: from a verified run to programs for controllers, judged once more as they were read back from their text."""

from collections import ChainMap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.checks.verify import verify_motion, with_clearance
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.input.findings import did_you_mean, listed
from cellplan.files.run.folder import EXPORT, PROGRAMS, RunFolder, refuse_unless_replaceable
from cellplan.model.motion.motion import JointTable
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import VerifiedMotion, VerifiedRun
from cellplan.programs.dialects import DIALECTS, ESCAPES
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.escapes import with_register
from cellplan.programs.export.choice import Choice
from cellplan.programs.export.prepare import prepare
from cellplan.programs.export.record import Record, export_record, record_text, table_record
from cellplan.programs.export.written import write
from cellplan.programs.formats.csv import DECIMALS as CSV_DECIMALS
from cellplan.programs.shared import Shared
from cellplan.programs.wide_table import read_wide_tables, render_wide_tables


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """A format that is no program of single robots: it is made from all of a run."""

    render: Callable[[VerifiedRun], dict[str, str]]  # text of every file of a run, by its path in the folder
    # what a reader of its own finds in these files: the tables of each motion, by robot
    read: Callable[[VerifiedRun, Mapping[str, str]], tuple[dict[str, JointTable], ...]]
    decimals: int  # of a second, degree or millimetre in these files


TABLES: Final[dict[str, Exporter]] = {
    "wide": Exporter(render=render_wide_tables, read=read_wide_tables, decimals=CSV_DECIMALS),
}
EXPORTERS: Final[Mapping[str, Dialect | Exporter]] = ChainMap(TABLES, DIALECTS)  # type: ignore[arg-type]


def require_format(name: str, *, option: str = "--format") -> None:
    """Refuse a format that does not exist; messages name the option that it belongs to."""
    if name not in EXPORTERS:
        hint = did_you_mean(name, EXPORTERS)
        raise InputError(f"{option}: expected one of {listed(EXPORTERS)}, got '{name}'{hint}")


def exporter_of(form: str, choice: Choice) -> Dialect | Exporter:
    """What writes and reads a format as it is chosen; ``InputError`` where it has no step registers."""
    dialect = EXPORTERS[form]
    if not choice.steps:
        return dialect
    if form not in ESCAPES or not isinstance(dialect, Dialect):
        raise InputError(f"--escape: expected one of the formats {listed(ESCAPES)}, got {form}")
    return with_register(dialect, ESCAPES[form])


def refuse_choice(form: str, choice: Choice) -> None:
    """Refuse what a format cannot do whatever the run; call it early, before any long work."""
    dialect = exporter_of(form, choice)
    if isinstance(dialect, Dialect):
        choice.refuse_for(dialect)
    elif choice != Choice():
        raise InputError(f"--format: expected no choice of robots, rows or targets with {form}, a table of all robots")


def default_folder(run: Path, form: str) -> Path:
    """Where programs are written by default: inside the run folder."""
    return run / PROGRAMS / form


def refuse_unless_exportable(folder: Path, run: Path) -> None:
    """Refuse what is part of the run, holds it, or holds anything but an export; call it before any long work."""
    place, source = folder.resolve(), run.resolve()
    inside = place.relative_to(source).parts if place.is_relative_to(source) else None
    if source.is_relative_to(place) or (inside is not None and (len(inside) < 2 or inside[0] != PROGRAMS)):
        raise InputError(f"{folder}: expected a folder outside the run, or below '{run / PROGRAMS}'")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / EXPORT).is_file():
        raise InputError(f"{folder}: contains files other than exported programs; choose another folder")
    refuse_unless_replaceable(folder)


def export_program(
    run: VerifiedRun,
    folder: Path,
    *,
    form: str = "csv",
    choice: Choice | None = None,
    progress: Progress = silent,
) -> tuple[str, ...]:
    """Write the programs of a verified run; the folder appears whole or not at all.

    The files are read back by their own reader before they are written, and every check is made on what was read.

    Args:
        run: The verified run.
        folder: Where the files go; an older export there is replaced.
        form: Name of the format.
        choice: Robots, targets, splitting and thinning; None for what is usual.
        progress: Called with the stage and the fraction done.

    Returns:
        The paths of the programs in the folder.

    Raises:
        InputError: There is no such format, it cannot hold what was chosen, something that it needs is not stated in
            the cell, or the folder cannot be written.
        NotVerifiedError: A check fails on what the files hold, or nothing can be promised of them.
    """
    require_format(form)
    refuse_unless_exportable(folder, run.folder)
    with without_cache():  # a proof rests on the files themselves
        files, record = exported(run, form, choice or Choice(), progress=progress)
    write_export(folder, files, record)
    return tuple(files)


def write_export(folder: Path, files: Mapping[str, str], record: Record) -> None:
    """Write the files of an export and its record; the folder appears whole or not at all."""
    with RunFolder(folder) as target:
        target.write_text(EXPORT, record_text(record))
        for name, text in files.items():
            target.write_text(name, text)


def exported(
    run: VerifiedRun, form: str, choice: Choice, *, shared: Shared | None = None, progress: Progress = silent
) -> tuple[dict[str, str], Record]:
    """The files of an export and its record, after all checks on what is read from them; ``shared`` may be None.

    Raises:
        InputError: The format cannot hold what was chosen, or something is not stated in the cell.
        NotVerifiedError: A check fails on what the files hold, or nothing can be promised of them.
    """
    dialect, shared = exporter_of(form, choice), shared or Shared(run)
    if isinstance(dialect, Dialect):
        prepared = prepare(run, dialect, choice, shared=shared, progress=progress)
        written = write(run, prepared, progress=progress)
        return written.files, export_record(run, prepared, written)
    refuse_choice(form, choice)
    files = dialect.render(run)
    verify_rounded(shared, dialect.read(run, files), decimals=dialect.decimals, progress=progress)
    return files, table_record(run, form, dialect.decimals, files)


def verify_rounded(
    shared: Shared, read: tuple[dict[str, JointTable], ...], *, decimals: int, progress: Progress
) -> None:
    """Make every check again on what the files hold, on the clock that they hold."""
    run = shared.run
    findings, phases = [], run.motion.plan.program[: len(run.motions)]
    for phase, motion, scene, tables in zip(phases, run.motions, shared.scenes, read, strict=True):
        _refuse_other_clock(motion, tables, tolerance=0.5 * 10.0**-decimals)
        clock = next(iter(tables.values())).times
        schedule = replace(motion.schedule, times=clock)
        rows = list(tables.values())
        report = verify_motion(scene, schedule, rows, moving=motion.moving, idle=phase.idle, progress=progress)
        report = with_clearance(report, scene, schedule, is_reported=False, progress=progress)
        findings += [f"rounded to {decimals} decimals: {check.message}" for check in report.checks if not check.passed]
    if findings:
        raise NotVerifiedError(findings)


def _refuse_other_clock(motion: VerifiedMotion, tables: Mapping[str, JointTable], *, tolerance: float) -> None:
    """Make sure that rounding moved no time by more than half a unit of the last decimal."""
    for table in tables.values():
        if len(table.times) != len(motion.schedule.times):
            raise InputError(
                f"program of '{table.robot}': expected {len(motion.schedule.times)} rows, got {len(table.times)}"
            )
        late = np.abs(table.times - motion.schedule.times)
        if np.any(late > tolerance + np.spacing(motion.schedule.times[-1])) or not np.all(np.diff(table.times) > 0.0):
            raise InputError(f"program of '{table.robot}': its times cannot be written with the decimals of the format")
