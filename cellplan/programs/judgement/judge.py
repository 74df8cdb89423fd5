"""Judgement of a written program: every demand of the cell once more, on what a reader found in the files."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.geometry.arrays import Array
from cellplan.model.report.exported import ExportJob, ProgramRows, Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.units import DEGREES, MILLIMETRES
from cellplan.programs.elements.corners import row_shares
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.judgement.judge_path import path_findings, path_rows
from cellplan.programs.judgement.judge_speeds import joint_findings, motion_findings, position_findings
from cellplan.programs.rows.part_targets import ToolsOnPart
from cellplan.programs.rows.played import ExecutedProgram, ExecutedStretch
from cellplan.programs.rows.rows import full_rows
from cellplan.programs.seams.executed import executed_programs
from cellplan.programs.shared import Shared, played_digest
from cellplan.scene.scene import Scene

SAME: Final = 1e-12  # [rad] or [m] cycles that are played alike are judged once
HELD_TOL: Final = 1e-3  # [rad] or [m] that holding robots may be off by rounding, and where a cycle begins in a phase


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """The largest distance of the written rows, as they are played, from those of the run."""

    subject: str  # A joint as ``robot/joint``, or what is said of a tool or further holder
    largest: float  # in the unit
    unit: str  # ``deg`` or ``mm``
    at_s: float  # its instant in the run in [s]
    phase: str = ""  # the phase of that; empty for a program of one


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What was found."""

    findings: tuple[str, ...]  # demands that are not kept; a program with any is not written
    deviations: tuple[Deviation, ...] = ()  # of every joint, then of every tool and further holder on the part
    not_judged: tuple[str, ...] = ()  # what does not hold on the files alone, with the reason
    corners: tuple[Deviation, ...] = ()  # by how much rounded rows may put tools off, of every task
    rounded: tuple[int, int] = (0, 0)  # rows of all robots that are rounded, and all rows of them
    executed: tuple[ProgramRows, ...] = ()  # what was read, its seams as controllers execute them

    @property
    def passed(self) -> bool:
        """Whether every demand is kept."""
        return not self.findings


def judge(
    run: VerifiedRun,
    dialect: Dialect,
    job: ExportJob,
    read: tuple[ProgramRows, ...],
    *,
    lead: float = 0.0,
    shared: Shared | None = None,
) -> Judgement:
    """Judge what a reader found in the files of an export.

    The rows must be those that were written, to rounding. Then come, on the rows that were read: joint limits; errors
    of the tools on the part at the rows and between them, depth and further holders; the certified clearance; and,
    where a format states times, speeds, accelerations, jerk, feeds and loads as far as controllers play the rows as
    they are. Robots that are not exported move as in the run. Without times in the files positions are judged at the
    times of the rows that were written: no tool is then farther from its desired path than from the desired pose.

    Args:
        lead: Time in [s] by which the rows are later than those of the run, see ``resample.lead_time``.
        shared: What exports of the run share: rows that are played alike, to the last bit, are judged once.
    """
    findings = list(other_rows(dialect, job, read))
    if findings:
        return Judgement(findings=tuple(findings))
    executed = read
    if any(rows.seams for program in job.programs for rows in program.robots.values()):
        executed = executed_programs(job, dialect, full_rows(run), read)
    with without_cache():
        shared, deviations, corners = shared or Shared(run), list[Deviation](), list[Deviation]()
        for played in played_programs(run, dialect, job, executed, lead=lead):
            new_findings, new_deviations, new_corners = _judged_once(played, shared, dialect, job)
            findings += new_findings
            deviations += new_deviations
            corners += new_corners
    return Judgement(
        findings=tuple(dict.fromkeys(findings)),
        deviations=_largest(deviations),
        not_judged=tuple(_not_judged(dialect, job, read)),
        corners=_largest(corners),
        rounded=_rounded(job, read),
        executed=executed,
    )


def played_programs(
    run: VerifiedRun, dialect: Dialect, job: ExportJob, read: Sequence[ProgramRows], *, lead: float
) -> Iterator[ExecutedProgram]:
    """The programs as targets play them."""
    by_name = {program.name: program for program in full_rows(run)}
    for written, recovered in zip(job.programs, read, strict=True):
        is_executed = any(rows.tube is not None for rows in recovered.robots.values())
        yield ExecutedProgram.of(
            run,
            by_name[written.name],
            (recovered, recovered if is_executed else written),
            shares=row_shares(job, written),
            interpolation=dialect.interpolation,
            lead=lead,
        )


def _judged_once(
    played: ExecutedProgram, shared: Shared, dialect: Dialect, job: ExportJob
) -> tuple[tuple[str, ...], tuple[Deviation, ...], tuple[Deviation, ...]]:
    """Findings, deviations and corners of one program, kept for programs that are played and judged alike."""

    def judgement() -> tuple[tuple[str, ...], tuple[Deviation, ...], tuple[Deviation, ...]]:
        findings = tuple(_program_findings(played, shared, dialect, job))
        is_timed = job.frame.promise is not Promise.PACED  # or else joints pass their places at times of their own
        deviations = tuple(_deviations(played, shared.scenes, of_joints=is_timed))
        return findings, deviations, tuple(_corners(played, shared))

    promise = job.frame.promise
    return shared.once((played_digest(played), promise, _is_played(dialect, promise), job.blend), judgement)


def _program_findings(played: ExecutedProgram, shared: Shared, dialect: Dialect, job: ExportJob) -> Iterator[str]:
    """Everything that is judged of one program."""
    yield from position_findings(played)
    promise = job.frame.promise
    if not promise.waits:
        is_played = _is_played(dialect, promise)
        yield from joint_findings(played, accelerations=is_played)
        if is_played:
            for stretch in judged_stretches(played):
                yield from motion_findings(played, stretch, shared.scenes[stretch.place])
    for stretch in judged_stretches(played):
        yield from _held_findings(played, stretch)
    for stretch in judged_stretches(played):
        where = f"{stretch.motion.name}: " if stretch.motion.name else ""
        yield from (where + finding for finding in path_findings(path_rows(played, stretch, shared)))


def _is_played(dialect: Dialect, promise: Promise) -> bool:
    """Whether controllers play the rows as they are: at their times, each on the cycle or none left out."""
    return promise is Promise.TIMED and (dialect.at_cycle or not dialect.is_thinned)


def _held_findings(played: ExecutedProgram, stretch: ExecutedStretch) -> Iterator[str]:
    """Robots that must stand still in a phase and are not where they stand in the run."""
    times = played.grid(stretch.begin, stretch.end)
    q = played.at(times)
    for name, table in stretch.motion.tables.items():
        off = np.abs(q[name] - table.q[0]).max(axis=0)
        if name not in stretch.motion.moving and np.any(off > HELD_TOL):
            joint = played.run.cell.robot(name).model.joints[int(np.argmax(off))]
            unit, scale = joint.display_unit
            yield (
                f"robot '{name}' holds from {stretch.begin:.3f} to {stretch.end:.3f} s: joint {joint.name} is "
                f"{scale * float(off.max()):.4g} {unit} from where it stands in the run"
            )


def judged_stretches(played: ExecutedProgram) -> Iterator[ExecutedStretch]:
    """Phases; a phase that is played as in a cycle before is left out."""
    known: dict[int, list[Mapping[str, Array]]] = {}
    for stretch in played.stretches():
        times = played.grid(stretch.begin, stretch.end)
        q = {"": (times - stretch.begin)[:, None], **played.at(times)}
        before = known.setdefault(stretch.place, [])
        if not any(_is_same(q, other) for other in before):
            before.append(q)
            yield stretch


def _is_same(one: Mapping[str, Array], other: Mapping[str, Array]) -> bool:
    """Whether rows of all robots are the same but for rounding."""
    return all(one[name].shape == other[name].shape and np.all(np.abs(one[name] - other[name]) <= SAME) for name in one)


def _deviations(played: ExecutedProgram, scenes: Sequence[Scene], *, of_joints: bool) -> Iterator[Deviation]:
    """How far a program is from the rows of the run, between which joints move evenly."""
    run = played.run
    times = played.grid(0.0, played.end)
    of_program, tables = played.at(times), list(run.programs.values())[played.place]
    of_run = {
        name: np.stack([np.interp(times, played.run_times, column) for column in table.q.T], axis=1)
        for name, table in tables.items()
    }
    for name in played.exported if of_joints else ():
        off = np.abs(of_program[name] - of_run[name])
        for index, joint in enumerate(run.cell.robot(name).model.joints):
            row, (unit, scale) = int(np.argmax(off[:, index])), joint.display_unit
            at_s = max(0.0, float(times[row]) - played.lead)
            yield Deviation(
                subject=f"{name}/{joint.name}",
                largest=scale * float(off[row, index]),
                unit=unit,
                at_s=at_s,
                phase=played.phase_at(float(times[row])),
            )
    for stretch in played.stretches():
        scene = scenes[stretch.place]
        working = [scheduled.task.name for scheduled in stretch.motion.schedule.tasks]
        tools = ToolsOnPart.of(scene.cell, scene.chains, tasks=working, robots=played.exported)
        if not tools.relations:
            continue
        inside = (times >= stretch.begin) & (times <= stretch.end)
        tips = [tools.tips({name: q[inside] for name, q in positions.items()}) for positions in (of_run, of_program)]
        for name, errors in zip(tools.names, tools.errors(*map(tools.poses, tips)), strict=True):
            for kind, (unit, scale) in enumerate((MILLIMETRES, DEGREES)):
                row = int(np.argmax(errors[:, kind]))
                at_s = float(times[inside][row]) - played.lead
                largest, phase = scale * float(errors[row, kind]), stretch.motion.name or ""
                yield Deviation(subject=name, largest=largest, unit=unit, at_s=at_s, phase=phase)


def _corners(played: ExecutedProgram, shared: Shared) -> Iterator[Deviation]:
    """By how much rounded rows may put the tools off, beside what they are off already."""
    has_tubes = any(rows.tube is not None for rows in played.rows.values())
    if not has_tubes and not any(np.any(shares > 0.0) for shares in played.shares.values()):
        return
    for stretch in judged_stretches(played):
        rows = path_rows(played, stretch, shared)
        times = rows.times + stretch.begin
        for scheduled in stretch.motion.schedule.tasks:
            margins = rows.tool_off(scheduled.task)
            for kind, (unit, scale) in enumerate((MILLIMETRES, DEGREES)):
                step = int(np.argmax(margins[:, kind]))
                yield Deviation(
                    subject=f"the tool of task '{scheduled.task.name}'",
                    largest=scale * float(margins[step, kind]),
                    unit=unit,
                    at_s=max(0.0, float(times[step]) - played.lead),
                    phase=stretch.motion.name or "",
                )


def _rounded(job: ExportJob, read: Sequence[ProgramRows]) -> tuple[int, int]:
    """Rows that are rounded, and all rows, of the robots that are exported."""
    shares = [
        row_shares(job, written)[name] if rows.rounding is None else rows.rounding
        for written, program in zip(job.programs, read, strict=True)
        for name, rows in program.robots.items()
    ]
    return sum(int(np.count_nonzero(share)) for share in shares), sum(map(len, shares))


def largest_of(deviations: Iterable[Deviation], kind: Callable[[Deviation], object]) -> list[Deviation]:
    """The largest of each kind, in the order in which they were found."""
    largest: dict[object, Deviation] = {}
    for deviation in deviations:
        key = kind(deviation)
        if key not in largest or deviation.largest > largest[key].largest:
            largest[key] = deviation
    return list(largest.values())


def _largest(deviations: Iterable[Deviation]) -> tuple[Deviation, ...]:
    """The largest of each subject and unit."""
    return tuple(largest_of(deviations, lambda deviation: (deviation.subject, deviation.unit)))


def _not_judged(dialect: Dialect, job: ExportJob, read: Sequence[ProgramRows]) -> Iterator[str]:
    """What holds of the run but not of the files alone."""
    if job.frame.promise is Promise.PACED:
        yield "accelerations, and speeds and loads off the seams: the controllers choose their own"
    elif job.frame.promise is Promise.SEQUENCE_ONLY:
        yield "speeds, accelerations, feeds and loads: the controllers choose their own times"
    elif not _is_played(dialect, job.frame.promise):
        yield "accelerations, jerk, feeds and loads: the controllers plan their own profile from row to row"
    if any(rows.times is None for program in read for rows in program.robots.values()):
        yield "times: the files state none"
