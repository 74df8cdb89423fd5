"""Export: from a verified run to programs for controllers, judged once more as they were read back from their text.

Of several formats at once, what all of them need of the run is worked out once, and each is all or nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from cellplan.cache import without_cache
from cellplan.checks.verify import verify_motion, with_clearance
from cellplan.errors import InputError, NotVerifiedError
from cellplan.files.run.folder import EXPORT, RunFolder
from cellplan.model.motion.motion import JointTable
from cellplan.model.progress import Progress, silent
from cellplan.model.report.verified_run import VerifiedMotion, VerifiedRun
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.export.choice import Choice, refuse_unknown_robots
from cellplan.programs.export.exporters import ALL, chosen_formats, exporter_of, refuse_choice, require_format
from cellplan.programs.export.prepare import prepare
from cellplan.programs.export.record import Record, export_record, record_text, table_record
from cellplan.programs.export.refusals import EVERYTHING, Exported, refuse_unless_exportable, refuse_unless_writable
from cellplan.programs.export.written import write
from cellplan.programs.shared import Shared


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


def export_programs(
    run: VerifiedRun,
    folder: Path,
    *,
    formats: Sequence[str] = (ALL,),
    choice: Choice = EVERYTHING,
    progress: Progress = silent,
) -> tuple[Exported, ...]:
    """Write the programs of a verified run in several formats, each in a folder of its own: ``folder/csv`` and so on.

    What holds of the run whatever the format is worked out once, and rows that are read back alike from two formats, to
    the last bit, are judged once. A format that cannot take the run is refused and does not keep others from being
    written; whether that is an error is for the caller to say.

    Args:
        run: The verified run.
        folder: Where the folders of the formats go; older exports in these are replaced.
        formats: Names of formats; ``all`` for every one there is.
        choice: What of the run, and how; a format that cannot hold it is refused.
        progress: Called with the stage and the fraction done.

    Returns:
        What came of each format, in the order in which they were asked for.

    Raises:
        InputError: There is no such format or robot, or a folder must not or cannot be written.
    """
    chosen = chosen_formats(formats)
    refuse_unless_writable([folder / form for form in chosen], run.folder)
    refuse_unknown_robots(run.cell, choice.robots)
    with without_cache():  # a proof rests on the files themselves
        return tuple(_exports(Shared(run), folder, chosen, choice, progress))


def _exports(
    shared: Shared, folder: Path, formats: Mapping[str, bool], choice: Choice, progress: Progress
) -> Iterator[Exported]:
    """What comes of each format."""
    for form, is_named in formats.items():
        place = folder / form
        try:
            files, record = exported(shared.run, form, choice, shared=shared, progress=_of(form, progress))
        except (InputError, NotVerifiedError) as refusal:
            yield Exported(form=form, folder=place, is_named=is_named, refusal=refusal)
            continue
        write_export(place, files, record)
        yield Exported(form=form, folder=place, is_named=is_named, files=tuple(files), record=record)


def _of(form: str, progress: Progress) -> Progress:
    """Progress that names the format."""
    return lambda stage, share: progress(f"{form}: {stage}", share)


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
