"""The gate before export: a run on disk passes only when everything in it is found to be true once more."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from cellplan.cache import nothing_kept
from cellplan.checks.verify import verify
from cellplan.errors import InputError, InvalidFileError, NotVerifiedError
from cellplan.io.input.findings import listed, shown
from cellplan.io.run.joint_tables import (
    TableHeader,
    other_header_line,
    parse_header,
    parse_table,
    program_digest,
    table_body,
)
from cellplan.io.run.stored import CELL, SERIES, StoredRun, read_stored_run
from cellplan.model.cell import Cell
from cellplan.model.idle import not_in_program
from cellplan.model.motion import JointTable, Schedule
from cellplan.model.phase import Phase
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Report
from cellplan.model.verified_run import SEAL, VerifiedMotion, VerifiedRun
from cellplan.pipeline.gate.compare_page import drawn_again, other_pictures, page_findings
from cellplan.pipeline.gate.compare_report import differences, misshapen_series
from cellplan.pipeline.gate.stored_cell import load_stored_cell
from cellplan.pipeline.write_run import versions
from cellplan.planning.modes import homeless, plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.report.record.accelerations import table_line
from cellplan.report.record.idle import missing_moves
from cellplan.report.record.run import Provenance, Record
from cellplan.report.record.series import series
from cellplan.report.record.write import run_record, summary_record
from cellplan.scene.scene import Scene

MOST_DIFFERENCES: Final = 10  # of a report that are told; the rest is counted
START_ROOM: Final = 1e-9  # [rad] or [m] tables and cells have twelve decimals of a degree, millimetre or metre


def open_gate(
    folder: Path, *, cell: Path | None = None, allow_dirs: Sequence[Path] = (), progress: Progress = silent
) -> VerifiedRun:
    """Verify a run on disk, by this version of the program, and hand it out for export.

    Every file must be as it was written and every input as it was read. The tables are read back, all checks are made
    again by a kinematics that shares nothing with the planner, and the report must say what was found.

    Args:
        folder: The run folder.
        cell: The cell file that was solved; None when it is not at hand.
        allow_dirs: Folders, beside the cell's own, that the files it names may lie in.
        progress: Who wants to know how far it is.

    Raises:
        InputError: The folder is not a whole, unchanged run, or an input has changed.
        NotVerifiedError: The run failed, or a check fails now.
    """
    with nothing_kept():  # a proof rests on the files themselves
        return _opened(folder, cell=cell, allow_dirs=allow_dirs, progress=progress)


def _opened(folder: Path, *, cell: Path | None, allow_dirs: Sequence[Path], progress: Progress) -> VerifiedRun:
    """The run, once everything in it was found to be true."""
    stored = read_stored_run(folder)
    _refuse_failed(stored)
    source = load_stored_cell(stored, cell=cell, allow_dirs=allow_dirs)
    scene = Scene.from_cell(source.cell)
    plans = _plans(source.cell, stored)
    motions = tuple(_verified(scene, stored, plan, progress=progress) for plan in plans)
    _refuse_failing(stored, motions)
    for plan, motion in zip(plans, motions, strict=True):
        _refuse_other_start(stored, plan, source.cell, tables=motion.tables)
        _refuse_other_accelerations(stored, motion)
    _refuse_other_report(stored, source.cell, motions)
    of_pages = _refuse_other_pages(stored, source.cell, motions)
    return VerifiedRun(
        folder=folder,
        digest=stored.digest,
        cell=source.cell,
        motions=motions,
        file_count=len(stored.manifest.files),
        inputs_compared=source.compared,
        remarks=(
            *source.remarks,
            *_other_versions(stored),
            *of_pages,
            *missing_moves(source.cell, {plan.task: plan.tasks for plan in plans}),
        ),
        seal=SEAL,
    )


def _refuse_failed(stored: StoredRun) -> None:
    """Refuse a run that failed when it was solved."""
    if stored.manifest.status != "passed":
        failed = [
            check for check in stored.record.get("checks", []) if isinstance(check, dict) and not check.get("passed")
        ]
        first = f": {failed[0].get('message')}" if failed else ""
        raise NotVerifiedError([f"{stored.folder}: the run failed{first}; it has no tables to verify"])


def _plans(cell: Cell, stored: StoredRun) -> tuple[Phase, ...]:
    """The runs that the stored ones must be: all tasks of the cell, or the one that was chosen."""
    tasks = list(stored.record["runs"] if "runs" in stored.record else stored.record["tasks"])
    every = [task.name for task in cell.tasks]
    file = stored.file("", "report.json")
    if tasks != every and (len(tasks) != 1 or tasks[0] not in every):
        raise InputError(f"{file}: tasks: expected {listed(every)} or one of them, got {listed(map(str, tasks))}")
    plans = plan_phases(cell, only=None if tasks == every else tasks[0]).program
    unknown = sorted({name for plan in plans for name in homeless(cell, plan)})
    if unknown:
        raise InputError(
            f"{stored.file('', CELL)}: robots: expected the home of every idle robot written out, got auto for "
            f"{listed(unknown)}"
        )
    places = [plan.task or "" for plan in plans]
    if places != list(stored.records):
        raise InputError(f"{file}: expected the runs of the mode {cell.motion.mode}, got {listed(stored.records)}")
    return plans


def _verified(scene: Scene, stored: StoredRun, plan: Phase, *, progress: Progress) -> VerifiedMotion:
    """Read the tables of one run back and make all checks again."""
    cell, place = scene.cell, plan.task or ""
    schedule = schedule_tasks(cell, [build_toolpath(cell.task(name), cell.part, cell.origin) for name in plan.tasks])
    tables = _tables(cell, stored, plan)
    _refuse_other_clock(stored, place, schedule, tables=tables)
    report = verify(scene, schedule, list(tables.values()), moving=plan.moving, progress=progress)
    return VerifiedMotion(name=plan.task, moving=plan.moving, schedule=schedule, tables=tables, report=report)


def _tables(cell: Cell, stored: StoredRun, plan: Phase) -> dict[str, JointTable]:
    """The joint tables of one run, each under the header it must have."""
    place = plan.task or ""
    texts = stored.tables[place]
    names = [robot.name for robot in cell.robots]
    if sorted(texts) != sorted(names):
        got = listed(sorted(texts))
        raise InputError(f"{stored.file(place, 'tables')}: expected one table for each of {listed(names)}, got {got}")
    texts = {name: texts[name] for name in names}
    manifest = stored.manifest
    program = program_digest(texts)
    expected = TableHeader(
        cell=cell.name,
        mode=str(cell.motion.mode),
        verdict="passed",
        digests={"cell": manifest.inputs[manifest.cell_file], "program": program},
        remark=not_in_program(cell, plan.tasks),
    )
    found = {}
    for name, text in texts.items():
        file = stored.file(place, f"tables/{name}.csv")
        found[name] = parse_table(text, file)
        _refuse_other_header(parse_header(text, file), expected, file)
        if found[name].robot != name:
            raise InputError(f"{file}: robot: expected '{name}', got '{found[name].robot}'")
        if found[name].joints != cell.robot(name).model.joint_names:
            joints = listed(cell.robot(name).model.joint_names)
            raise InputError(f"{file}: expected the joints {joints} in this order, got {listed(found[name].joints)}")
    if stored.records[place].get("digests") != {"program": program}:
        raise InputError(f"{stored.file(place, 'report.json')}: digests.program: is not that of the tables beside it")
    return found


def _refuse_other_header(header: TableHeader, expected: TableHeader, file: str) -> None:
    """Refuse a table of another run, of another cell, or with another verdict than passed."""
    for key in ("cell", "mode", "verdict", "remark"):
        got, desired = getattr(header, key), getattr(expected, key)
        if got != desired:
            raise InputError(f"{file}: {key}: expected {shown(desired)}, got {shown(got)}")
    for name in dict.fromkeys([*expected.digests, *header.digests]):
        if header.digests.get(name) != expected.digests.get(name):
            raise InputError(f"{file}: {name} digest: is not that of this run; tables of different runs do not mix")


def _refuse_other_accelerations(stored: StoredRun, motion: VerifiedMotion) -> None:
    """Refuse a table whose header names other accelerations than its rows have, or holds lines that say more.

    Other versions may name no accelerations, and may have other lines.
    """
    place = motion.name or ""
    is_same = stored.manifest.versions.get("cellplan") == versions()["cellplan"]
    for robot, text in stored.tables[place].items():
        file = stored.file(place, f"tables/{robot}.csv")
        said, found = parse_header(text, file).accelerations, table_line(motion.report.accelerations, robot)
        if said != found and (said or is_same):
            raise InputError(f"{file}: accelerations: expected {shown(found)}, got {shown(said)}")
        line = other_header_line(text, file) if is_same else None
        if line is not None:
            raise InputError(f"{file}:{line}: is not a header line that cellplan writes there; solve the cell again")


def _refuse_other_clock(stored: StoredRun, place: str, schedule: Schedule, *, tables: Mapping[str, JointTable]) -> None:
    """Refuse a table whose instants are not those of the cell, and name the first line that is not."""
    for name, table in tables.items():
        file = stored.file(place, f"tables/{name}.csv")
        if len(table.times) != len(schedule.times):
            raise InputError(
                f"{file}: expected {len(schedule.times)} rows as the cell's clock has, got {len(table.times)}"
            )
        late = np.flatnonzero(table.times != schedule.times)
        if len(late):
            row = int(late[0])
            line = _line(stored.tables[place][name], row)
            desired, got = float(schedule.times[row]), float(table.times[row])
            raise InputError(f"{file}:{line}: time_s: expected {desired!r} as the cell's clock has, got {got!r}")


def _refuse_other_start(stored: StoredRun, plan: Phase, cell: Cell, *, tables: Mapping[str, JointTable]) -> None:
    """Refuse a table that does not begin at the start posture of the cell; those of idle robots were checked."""
    place = plan.task or ""
    for robot in cell.robots:
        off = np.abs(tables[robot.name].q[0] - robot.start)
        if robot.name not in plan.idle and not np.all(off <= START_ROOM):
            joint = robot.model.joint_names[int(np.argmax(off))]
            file = stored.file(place, f"tables/{robot.name}.csv")
            line = _line(stored.tables[place][robot.name], 0)
            raise InputError(f"{file}:{line}: {joint}: expected the start posture of the cell, got another one")


def _line(text: str, row: int) -> int:
    """Line of a row of numbers in the text of a table."""
    return text.count("\n", 0, len(text) - len(table_body(text))) + 2 + row


def _refuse_failing(stored: StoredRun, motions: Sequence[VerifiedMotion]) -> None:
    """Refuse a run of which a check fails now, whatever its report says."""
    findings = []
    for motion in motions:
        where = stored.file(motion.name or "", "tables")
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


def _refuse_other_report(stored: StoredRun, cell: Cell, motions: Sequence[VerifiedMotion]) -> None:
    """Refuse reports that say something else than was found."""
    provenance = Provenance(versions=stored.manifest.versions, digests={})
    found: dict[str, Record] = {
        motion.name or "": run_record(motion.report, cell=cell, provenance=provenance) for motion in motions
    }
    said: dict[str, Record] = dict(stored.records)
    if "runs" in stored.record:
        said[""] = stored.record
        reports = {str(motion.name): motion.report for motion in motions}
        found[""] = summary_record(reports, cell=cell, provenance=provenance)
    is_same = _is_of_this_version(stored)
    findings = []
    for place, record in said.items():
        findings += [
            f"{stored.file(place, 'report.json')}: {key}: {shown(old)} stands there, {shown(new)} was found"
            for key, old, new in differences(record, found[place], same_program=is_same)
        ]
    for motion in motions:
        findings += _series_findings(stored, motion, is_same=is_same)
    _refuse_because(stored, findings)


def _series_findings(stored: StoredRun, motion: VerifiedMotion, *, is_same: bool) -> Iterator[str]:
    """Differences between the series of one run and those of its tables."""
    place = motion.name or ""
    said, found = stored.series(place), series(motion.report)
    different = list(differences(said, found, same_program=is_same))
    different += misshapen_series(said, len(found["times_s"]) - 1) if is_same else []
    for key, old, new in different:
        yield f"{stored.file(place, SERIES)}: {key}: {shown(old)} stands there, {shown(new)} was found"


def _refuse_other_pages(stored: StoredRun, cell: Cell, motions: Sequence[VerifiedMotion]) -> tuple[str, ...]:
    """Refuse pages that say something else than was found; remarks about what may be rounding or another version."""
    if not _is_of_this_version(stored):
        return ("the page and the words of the report were not compared: another version of cellplan wrote them",)
    drawn = drawn_again(cell, motions)
    _refuse_because(stored, list(page_findings(stored, cell, motions, drawn)))
    other = list(other_pictures(stored, drawn))
    told = f"drawn here, some pictures look different, by rounding or by hand: {listed(other)}"
    return (told,) if other else ()


def _is_of_this_version(stored: StoredRun) -> bool:
    """Whether this version of cellplan says of itself that it made the run."""
    return stored.manifest.versions.get("cellplan") == versions()["cellplan"]


def _refuse_because(stored: StoredRun, findings: Sequence[str]) -> None:
    """Refuse a run when there are findings about its files, of which the first are told."""
    if findings:
        more = len(findings) - MOST_DIFFERENCES
        told = list(findings[:MOST_DIFFERENCES]) + (
            [f"{stored.folder}: and {more} more differences"] if more > 0 else []
        )
        raise InvalidFileError([InputError(finding) for finding in told])


def _other_versions(stored: StoredRun) -> Iterator[str]:
    """Programs that have another version now than when the run was made; what counts is the verification of now."""
    now = versions()
    for name, version in stored.manifest.versions.items():
        if now.get(name, "none") != version:
            yield f"made with {name} {version}, verified with {name} {now.get(name, 'none')}"
