"""Verification before export: a run on disk is opened only when all of its content is verified again."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from cellplan.cache import without_cache
from cellplan.checks.clearance.phase_ends import JudgedPhase, with_phase_ends
from cellplan.checks.joints.joins import with_joins
from cellplan.checks.task_rules import with_task_rules
from cellplan.checks.verify import verify
from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.files.input.findings import listed, shown
from cellplan.files.run.joint_tables import other_header_line, parse_header
from cellplan.files.run.stored import CELL, SERIES, StoredRun, read_stored_run
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import ACCESS_TOKEN, ReadMotion, ReadRun, VerifiedMotion, VerifiedRun
from cellplan.planning.modes import homeless
from cellplan.report.record.common import Provenance
from cellplan.report.record.phases import missing_moves
from cellplan.report.record.series import series
from cellplan.report.record.summary import ProgramRecords, program_records
from cellplan.runs.drawings.picture import drawings_by_place
from cellplan.runs.gate.compare_drawings import other_drawings
from cellplan.runs.gate.compare_page import other_pictures, page_findings, redrawn
from cellplan.runs.gate.compare_report import differences, misshapen_series
from cellplan.runs.gate.stored_cell import load_stored_cell
from cellplan.runs.gate.stored_rows import StoredRows, read_rows
from cellplan.runs.plan.demanded import DemandedProgram
from cellplan.runs.plan.headers import table_headers
from cellplan.runs.plan.program import ProgramClock
from cellplan.runs.write_run import versions
from cellplan.scene.scene import Scene

MAX_DIFFERENCES: Final = 10  # of a report that are listed; the rest is counted


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
        refuse: Called when all is read and before anything is verified; raises what speaks against the use of the run.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: The folder is not a whole, unchanged run, or an input has changed.
        NotVerifiedError: The run failed, or a check fails now.
    """
    stored = read_stored_run(Path(folder))
    _refuse_failed(stored)
    source = load_stored_cell(stored, cell=cell, allow_dirs=allow_dirs, controllers=controllers)
    demanded = _demanded(source.cell, stored)
    rows = read_rows(stored, source.cell, demanded)
    if refuse is not None:
        refuse(replace(_read_run(stored, source.cell, demanded, rows), names=source.names))
    scenes = demanded.scenes(source.cell)
    motions = tuple(
        _verified(scene, rows, place, cell=source.cell, progress=progress) for place, scene in enumerate(scenes)
    )
    phases = [
        JudgedPhase(scene=scene, schedule=motion.schedule, report=motion.report)
        for scene, motion in zip(scenes, motions, strict=True)
    ]
    reports = with_task_rules(source.cell, phases, with_joins(source.cell, with_phase_ends(source.cell, phases)))
    motions = tuple(replace(motion, report=report) for motion, report in zip(motions, reports, strict=True))
    _refuse_failing(stored, motions)
    rows.refuse_other_starts(source.cell)
    _refuse_other_headers(stored, source.cell, rows.clock, motions)
    provenance = Provenance(versions=stored.manifest.versions, digests={})
    records = program_records(motions, cell=source.cell, provenance=provenance)
    _refuse_other_report(stored, records, motions)
    return VerifiedRun(
        folder=stored.folder,
        digest=stored.digest,
        cell=source.cell,
        motion=rows.motion,
        motions=motions,
        file_count=len(stored.manifest.files),
        inputs_compared=source.compared,
        remarks=(
            *source.remarks,
            *_other_versions(stored),
            *_refuse_other_pages(stored, records, motions),
            *missing_moves(source.cell, {phase.label: phase.tasks for phase in demanded.plan.program}),
        ),
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
    return _read_run(stored, cell, demanded, read_rows(stored, cell, demanded))


def _read_run(stored: StoredRun, cell: Cell, demanded: DemandedProgram, rows: StoredRows) -> ReadRun:
    """The run as it is before anything is verified."""
    phases = zip(demanded.plan.program[: len(demanded.cells)], rows.clock.schedules, strict=False)
    motions = tuple(ReadMotion(name=phase.label, schedule=schedule) for phase, schedule in phases)
    return ReadRun(folder=stored.folder, digest=stored.digest, cell=cell, motion=rows.motion, motions=motions)


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


def _verified(scene: Scene, rows: StoredRows, place: int, *, cell: Cell, progress: Progress) -> VerifiedMotion:
    """Make all checks again on the rows of one phase."""
    clock, mode = rows.clock, cell.motion.mode
    phase, schedule = clock.plan.program[place], clock.schedules[place]
    tables = rows.of_phase(place)
    report = verify(scene, schedule, list(tables.values()), moving=phase.moving, idle=phase.idle, progress=progress)
    report = replace(report, mode=str(mode), phases=clock.timed_phases, phase=phase.label)
    return VerifiedMotion(
        name=phase.label, cell=scene.cell, moving=phase.moving, schedule=schedule, tables=tables, report=report
    )


def _refuse_other_headers(
    stored: StoredRun, cell: Cell, clock: ProgramClock, motions: Sequence[VerifiedMotion]
) -> None:
    """Refuse a table whose header names other accelerations than its rows have or another zero, or says more.

    Other versions may name neither, and may have other lines.
    """
    is_same = _is_of_this_version(stored)
    phases = clock.plan.program[: len(motions)]
    headers = table_headers(cell, phases, [motion.report for motion in motions], digests={})
    for robot, text in stored.tables.items():
        file = stored.file("", f"tables/{robot}.csv")
        header = parse_header(text, file)
        for key in ("accelerations", "zero"):
            got, expected = getattr(header, key), getattr(headers[robot], key)
            if got != expected and (got or is_same):
                raise InputError(f"{file}: {key}: expected {shown(expected)}, got {shown(got)}")
        line = other_header_line(text, file) if is_same else None
        if line is not None:
            raise InputError(f"{file}:{line}: unexpected header line; solve the cell again")


def _refuse_failing(stored: StoredRun, motions: Sequence[VerifiedMotion]) -> None:
    """Refuse a run of which a check fails now, whatever its report says."""
    findings = []
    for motion in motions:
        where = stored.file("", "tables") + (f": {motion.name}" if len(motions) > 1 else "")
        findings += [f"{where}: {check.message}" for check in motion.report.checks if not check.passed]
        findings += [f"{where}: {what}: not a number" for what in _unproved(motion.report)]
    if findings:
        raise NotVerifiedError(findings)


def _unproved(report: Report) -> Iterator[str]:
    """Figures that are no figures: what cannot be compared with its limit is not proved."""
    for check in report.checks:
        if not math.isfinite(check.value) or math.isnan(check.limit):
            yield f"{check.name} of {check.subject}"
    for kind, minimum in report.clearance.minima.items():
        if minimum.minimum is not None and not math.isfinite(minimum.minimum):
            yield f"clearance {kind}"


def _refuse_other_report(stored: StoredRun, records: ProgramRecords, motions: Sequence[VerifiedMotion]) -> None:
    """Refuse reports that say something else than was found."""
    is_same = _is_of_this_version(stored)
    findings = []
    for place, record in records.by_place.items():
        findings += [
            f"{stored.file(place, 'report.json')}: {key}: expected {shown(new)}, got {shown(old)}"
            for key, old, new in differences(stored.report(place), record, same_program=is_same)
        ]
    for motion in motions:
        findings += _series_findings(stored, motion, is_same=is_same)
    _refuse_because(stored, findings)


def _series_findings(stored: StoredRun, motion: VerifiedMotion, *, is_same: bool) -> Iterator[str]:
    """Differences between the series of one run and those of its tables."""
    place = motion.name or ""
    got, expected = stored.series(place), series(motion.report)
    different = list(differences(got, expected, same_program=is_same))
    different += misshapen_series(got, len(expected["times_s"]) - 1) if is_same else []
    for key, old, new in different:
        yield f"{stored.file(place, SERIES)}: {key}: expected {shown(new)}, got {shown(old)}"


def _refuse_other_pages(
    stored: StoredRun, records: ProgramRecords, motions: Sequence[VerifiedMotion]
) -> tuple[str, ...]:
    """Refuse pages that say something else than was found; remarks about what may be rounding or another version."""
    if not _is_of_this_version(stored):
        return ("the page and the texts of the report were not compared: another version of cellplan wrote them",)
    plots = redrawn(motions)
    drawings = drawings_by_place(records.cells[""], motions)
    _refuse_because(stored, list(page_findings(stored, records, plots, drawings)))
    other = [*other_pictures(stored, plots), *other_drawings(stored, drawings)]
    remark = f"some pictures differ from those rendered here, by rounding or by editing: {listed(other)}"
    return (remark,) if other else ()


def _is_of_this_version(stored: StoredRun) -> bool:
    """Whether this version of cellplan says of itself that it made the run."""
    return stored.manifest.versions.get("cellplan") == versions()["cellplan"]


def _refuse_because(stored: StoredRun, findings: Sequence[str]) -> None:
    """Refuse a run when there are findings about its files, of which the first are listed."""
    if findings:
        more = len(findings) - MAX_DIFFERENCES
        listed_first = list(findings[:MAX_DIFFERENCES]) + (
            [f"{stored.folder}: and {more} more differences"] if more > 0 else []
        )
        raise InvalidFileError([InputError(finding) for finding in listed_first])


def _other_versions(stored: StoredRun) -> Iterator[str]:
    """Programs that have another version now than when the run was made; what counts is the verification of now."""
    now = versions()
    for name, version in stored.manifest.versions.items():
        if now.get(name, "none") != version:
            yield f"made with {name} {version}, verified with {name} {now.get(name, 'none')}"
