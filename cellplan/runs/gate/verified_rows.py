"""Verification of the rows of a stored run: every check again, and all that its reports and pages say of them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from cellplan.checks.clearance.phase_ends import JudgedPhase, with_phase_ends
from cellplan.checks.joints.joins import with_joins
from cellplan.checks.task_rules import with_task_rules
from cellplan.checks.verify import verify
from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.files.input.findings import listed, shown
from cellplan.files.run.joint_tables import other_header_line, parse_header
from cellplan.files.run.stored import SERIES, StoredRun
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import Progress
from cellplan.model.report.report import Report
from cellplan.model.report.verified_run import VerifiedMotion
from cellplan.report.record.common import Provenance
from cellplan.report.record.phases import missing_moves
from cellplan.report.record.series import series
from cellplan.report.record.summary import ProgramRecords, program_records
from cellplan.runs.drawings.picture import drawings_by_place
from cellplan.runs.gate.compare_drawings import other_drawings
from cellplan.runs.gate.compare_page import other_pictures, page_findings, redrawn
from cellplan.runs.gate.compare_report import differences, misshapen_series
from cellplan.runs.gate.stored_rows import StoredRows
from cellplan.runs.plan.headers import table_headers
from cellplan.runs.plan.program import ProgramClock
from cellplan.runs.write_run import versions
from cellplan.scene.scene import Scene

MAX_DIFFERENCES: Final = 10  # of a report that are listed; the rest is counted


def verified_rows(
    rows: StoredRows, cell: Cell, *, progress: Progress
) -> tuple[tuple[VerifiedMotion, ...], tuple[str, ...]]:
    """Each phase of the rows, verified, and what to know before relying on them.

    Raises:
        InputError: A file of the run says something else than was found.
        NotVerifiedError: A check fails now.
    """
    stored, demanded = rows.stored, rows.program
    scenes = demanded.scenes(cell)
    motions = tuple(_verified(scene, rows, place, cell=cell, progress=progress) for place, scene in enumerate(scenes))
    phases = [
        JudgedPhase(scene=scene, schedule=motion.schedule, report=motion.report)
        for scene, motion in zip(scenes, motions, strict=True)
    ]
    reports = with_task_rules(cell, phases, with_joins(cell, with_phase_ends(cell, phases)))
    motions = tuple(replace(motion, report=report) for motion, report in zip(motions, reports, strict=True))
    _refuse_failing(stored, motions)
    rows.refuse_other_starts(cell)
    _refuse_other_headers(stored, cell, rows.clock, motions)
    provenance = Provenance(versions=stored.manifest.versions, digests={})
    records = program_records(motions, cell=cell, provenance=provenance)
    _refuse_other_report(stored, records, motions)
    remarks = (
        *_other_versions(stored),
        *_refuse_other_pages(stored, records, motions),
        *missing_moves(cell, {phase.label: phase.tasks for phase in demanded.plan.program}),
    )
    return motions, remarks


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
            f"{stored.file(place, 'report.json')}: {key}: expected {shown(new)}, got {shown(old)}; solve the cell again"
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
