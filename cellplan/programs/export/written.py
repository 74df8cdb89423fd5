"""Written: the files of an export, read back by the reader of their format and judged as they were read."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cellplan.errors import InputError, NotVerifiedError
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise, RobotRows
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.elements.timed_rows import cycle_of
from cellplan.programs.export.notes import export_notes
from cellplan.programs.export.prepare import PreparedExport
from cellplan.programs.export.refusals import is_at_cycle
from cellplan.programs.judgement.judge import Judgement, judge, played_programs
from cellplan.programs.promises.orders import certify_written
from cellplan.programs.rows.margins import robot_corners
from cellplan.programs.rows.part_targets import joints_of_part_poses

STAGE: Final = "checking what was written"
RATIO_NOISE: Final = 1e-9  # [-] of a step that is the cycle of a controller


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Written:
    """The files of an export."""

    job: ExportJob  # what was written, with its notes
    files: dict[str, str]  # text by path
    judgement: Judgement  # what was found in what was read back


def write(run: VerifiedRun, prepared: PreparedExport, *, progress: Progress = silent) -> Written:
    """Render the files of an export, read them back, and judge what was read; then say so in their heads.

    Raises:
        InputError: Something cannot be written in this format.
        NotVerifiedError: A check fails on what was read.
    """
    read = read_files(prepared, prepared.dialect.render(prepared.job))
    written = with_notes(run, prepared, judged(run, prepared, read, progress=progress))
    if not same_rows(read, read_files(prepared, written.files)):
        raise InputError(f"{prepared.dialect.name}: expected the same rows with notes in the files as without")
    return written


def with_notes(run: VerifiedRun, prepared: PreparedExport, judgement: Judgement) -> Written:
    """The files of an export that say in their heads what was found in them."""
    job = replace(prepared.job, notes=export_notes(run, prepared, judgement))
    return Written(job=job, files=prepared.dialect.render(job), judgement=judgement)


def read_files(prepared: PreparedExport, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """What the reader of the format finds in files; an ``InputError`` has file and line."""
    return prepared.dialect.read(prepared.job.frame, files)


def judged(
    run: VerifiedRun, prepared: PreparedExport, read: tuple[ProgramRows, ...], *, progress: Progress = silent
) -> Judgement:
    """Make all checks on what was read; ``NotVerifiedError`` where one fails."""
    if prepared.dialect.states_poses(prepared.job.frame):
        read = joints_of_part_poses(prepared.job.frame, prepared.job.programs, read)
    progress(STAGE, 0.0)
    judgement = judge(run, prepared.dialect, prepared.job, read, lead=prepared.lead, shared=prepared.shared)
    progress(STAGE, 1.0)
    findings = list(judgement.findings)
    if not findings and prepared.orders:
        played = played_programs(run, prepared.dialect, prepared.job, judgement.executed, lead=prepared.lead)
        known = prepared.shared.known_orders
        corners = [robot_corners(program) for program in played]
        findings += certify_written(run, prepared.orders, judgement.executed, corners, known=known, progress=progress)
    if findings:
        named = [f"{prepared.dialect.name}: {finding}" for finding in findings]
        raise NotVerifiedError([*named, *_unresolved(run, prepared, named), *_stated_coarsely(run, prepared)])
    return judgement


def _unresolved(run: VerifiedRun, prepared: PreparedExport, findings: Sequence[str]) -> Iterator[str]:
    """A detail of findings of accelerations: steps of the run that are longer than the cycle of a controller."""
    shortest = min(cycle_of(run.cell.robot(name)) for name in prepared.job.frame.robots)
    step = run.cell.motion.step
    is_timed = prepared.job.frame.promise is Promise.TIMED
    if is_timed and step > (1.0 + RATIO_NOISE) * shortest and any("acceleration" in finding for finding in findings):
        yield f"  motion.step_s: {step:g} is stated; steps of {shortest:g}, a controller's cycle, resolve accelerations"


def _stated_coarsely(run: VerifiedRun, prepared: PreparedExport) -> Iterator[str]:
    """Details of findings: what the cell states of the robots that makes rows coarse."""
    dialect, robots = prepared.dialect, [run.cell.robot(name) for name in prepared.job.frame.robots]
    for robot in robots if dialect.kinds else ():
        decimals = None if robot.control is None else robot.control.decimals
        if decimals is not None and decimals < dialect.decimals:
            key = f"robots.{robot.name}.controller.decimals"
            yield f"  {key}: {decimals} are stated, the usual ones of {dialect.name} are {dialect.decimals}"
    if is_at_cycle(dialect, prepared.job.frame.promise):
        cycles = {robot.name: cycle_of(robot) for robot in robots if robot.name in run.cell.positioners}
        if len(set(cycles.values())) > 1:
            shown = " and ".join(f"{1e3 * cycle:g} ms of {name}" for name, cycle in cycles.items())
            yield f"  cycle_ms: {shown}: holders of one part that share a cycle strain it less between rows"


def same_rows(one: Sequence[ProgramRows], other: Sequence[ProgramRows]) -> bool:
    """Whether two readings of programs are equal to the last bit."""
    return len(one) == len(other) and all(
        mine.name == yours.name
        and list(mine.robots) == list(yours.robots)
        and all(_same(mine.robots[name], yours.robots[name]) for name in mine.robots)
        for mine, yours in zip(one, other, strict=True)
    )


def _same(one: RobotRows, other: RobotRows) -> bool:
    """Whether the rows of a robot are equal."""
    pairs = (
        (getattr(one, name), getattr(other, name))
        for name in ("X_PT", "q", "times", "qd", "process", "rounding", "feeds", "middles", "configuration")
    )
    return (
        one.marks == other.marks
        and one.seams == other.seams
        and all(
            (a is None and b is None)
            or (a is not None and b is not None and np.array_equal(a, b, equal_nan=a.dtype.kind == "f"))
            for a, b in pairs
        )
    )
