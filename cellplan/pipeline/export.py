"""Export: from a verified run to files for controllers, judged once more on the rounded numbers they hold."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.cache import nothing_kept
from cellplan.checks.verify import verify
from cellplan.errors import InputError, NotVerifiedError
from cellplan.export.csv import DECIMALS as CSV_DECIMALS
from cellplan.export.csv import read_csv, render_csv
from cellplan.io.input.files import digest
from cellplan.io.input.findings import did_you_mean, listed
from cellplan.io.run.folder import EXPORT, PROGRAMS, RunFolder, refuse_unless_replaceable
from cellplan.model.motion import JointTable
from cellplan.model.progress import Progress, silent
from cellplan.model.report import CAUTION
from cellplan.model.verified_run import VerifiedMotion, VerifiedRun
from cellplan.pipeline.plan.demanded import DemandedProgram
from cellplan.pipeline.wide_table import read_wide_tables, render_wide_tables
from cellplan.pipeline.write_run import versions
from cellplan.report.record.controller import zero_text
from cellplan.scene.scene import Scene

SCHEMA: Final = "cellplan.export/1"


@dataclass(frozen=True, slots=True, kw_only=True)
class Exporter:
    """A format.

    Attributes:
        render: Text of every file of a run, by its path in the folder of the export.
        read: What a reader of its own finds in these files: the tables of each motion, by robot.
        decimals: Of a second, degree or millimetre in these files.
    """

    render: Callable[[VerifiedRun], dict[str, str]]
    read: Callable[[VerifiedRun, Mapping[str, str]], tuple[dict[str, JointTable], ...]]
    decimals: int


EXPORTERS: Final[Mapping[str, Exporter]] = {
    "csv": Exporter(render=render_csv, read=read_csv, decimals=CSV_DECIMALS),
    "wide": Exporter(render=render_wide_tables, read=read_wide_tables, decimals=CSV_DECIMALS),
}


def require_format(name: str) -> None:
    """Refuse a format that does not exist.

    Raises:
        InputError: There is none of that name.
    """
    if name not in EXPORTERS:
        hint = did_you_mean(name, EXPORTERS)
        raise InputError(f"--format: expected one of {listed(EXPORTERS)}, got '{name}'{hint}")


def default_folder(run: Path, form: str) -> Path:
    """Where programs are written by default: inside the run folder."""
    return run / PROGRAMS / form


def refuse_unless_exportable(folder: Path, run: Path) -> None:
    """Refuse a place that programs must not be written to; call it early, before any long work.

    Raises:
        InputError: The place is part of the run, holds the run, or holds something else than an export.
    """
    place, source = folder.resolve(), run.resolve()
    inside = place.relative_to(source).parts if place.is_relative_to(source) else None
    if source.is_relative_to(place) or (inside is not None and (len(inside) < 2 or inside[0] != PROGRAMS)):
        raise InputError(f"{folder}: expected a folder outside the run, or below '{run / PROGRAMS}'")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / EXPORT).is_file():
        raise InputError(f"{folder}: contains files other than exported programs; choose another folder")
    refuse_unless_replaceable(folder)


def export_program(
    run: VerifiedRun, folder: Path, *, form: str = "csv", progress: Progress = silent
) -> tuple[str, ...]:
    """Write the programs of a verified run; the folder appears whole or not at all.

    The files are read back by their own reader before they are written, and every check is made on what was read.

    Args:
        run: The verified run.
        folder: Where the files go; an older export there is replaced.
        form: Name of the format.
        progress: Called with the stage and the fraction done.

    Returns:
        The paths of the programs in the folder.

    Raises:
        InputError: There is no such format, or the folder cannot be written.
        NotVerifiedError: A check fails on the rounded numbers.
    """
    require_format(form)
    refuse_unless_exportable(folder, run.folder)
    exporter = EXPORTERS[form]
    files = exporter.render(run)
    with nothing_kept():  # a proof rests on the files themselves
        _verify_rounded(run, exporter.read(run, files), decimals=exporter.decimals, progress=progress)
    with RunFolder(folder) as target:
        target.write_text(EXPORT, _record(run, files, form=form, decimals=exporter.decimals))
        for name, text in files.items():
            target.write_text(name, text)
    return tuple(files)


def _verify_rounded(
    run: VerifiedRun, read: tuple[dict[str, JointTable], ...], *, decimals: int, progress: Progress
) -> None:
    """Make every check again on what the files hold, on the clock that they hold."""
    demanded, scenes = None, [Scene.from_cell(run.cell)] * len(run.motions)
    if run.cell.program is not None:
        demanded = DemandedProgram.of(run.cell)
        scenes = demanded.scenes(run.cell)
    findings = []
    for place, (motion, scene, tables) in enumerate(zip(run.motions, scenes, read, strict=True)):
        _refuse_other_clock(motion, tables, tolerance=0.5 * 10.0**-decimals)
        clock = next(iter(tables.values())).times
        schedule = replace(motion.schedule, times=clock)
        idle = None if demanded is None else demanded.plan.program[place].idle
        report = verify(scene, schedule, list(tables.values()), moving=motion.moving, idle=idle, progress=progress)
        findings += [f"rounded to {decimals} decimals: {check.message}" for check in report.checks if not check.passed]
    if findings:
        raise NotVerifiedError(findings)


def _refuse_other_clock(motion: VerifiedMotion, tables: Mapping[str, JointTable], *, tolerance: float) -> None:
    """Make sure that rounding moved no time by more than half a unit of the last decimal."""
    for table in tables.values():
        late = np.abs(table.times - motion.schedule.times)
        if np.any(late > tolerance + np.spacing(motion.schedule.times[-1])) or not np.all(np.diff(table.times) > 0.0):
            raise InputError(f"program of '{table.robot}': its times cannot be written with the decimals of the format")


def _record(run: VerifiedRun, files: Mapping[str, str], *, form: str, decimals: int) -> str:
    """What was exported, from which run."""
    record = {
        "schema": SCHEMA,
        "cell": run.cell.name,
        "format": form,
        "decimals": decimals,
        "run": run.digest,
        "versions": versions(),
        "zero": {robot.name: zero_text(robot.model) for robot in run.cell.robots},
        "files": {name: digest(text.encode()) for name, text in files.items()},
        "caution": CAUTION,
    }
    return json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n"
