"""Prepared: all that a format is to write of a run, promised and shaped, before any text."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from cellplan.errors import InputError, LineRefusedError, NotVerifiedError, raise_findings
from cellplan.model.progress import Progress, silent
from cellplan.model.report.exported import ExportFrame, ExportJob, Moves, ProgramRows, Promise
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.model.units import DEG, MM
from cellplan.programs.elements.corners import units_of
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import speakers
from cellplan.programs.elements.joints import in_step
from cellplan.programs.elements.process import shared_outputs
from cellplan.programs.elements.timed_rows import cycle_of
from cellplan.programs.export.choice import THIN_DEG, THIN_MM, Choice, exported_robots
from cellplan.programs.export.refusals import frame_of, is_at_cycle, unmet_demands
from cellplan.programs.judgement.refused_lines import refused_lines
from cellplan.programs.judgement.round_rows import stops_left, with_rounding
from cellplan.programs.promises.orders import Orders
from cellplan.programs.promises.promises import Promised, choose_promise, controllers_of
from cellplan.programs.promises.skew import RunSkew, run_skew
from cellplan.programs.rows.feeds import feeds_in_step
from cellplan.programs.rows.part_targets import with_joints_of_arcs, with_part_poses
from cellplan.programs.rows.resample import lead_time, resampled
from cellplan.programs.rows.rows import essential_rows, full_rows
from cellplan.programs.rows.thin import ThinningLimits, thinned
from cellplan.programs.seams.choose import LineLimits, on_moving_parts, with_seams
from cellplan.programs.seams.executed import executed_programs
from cellplan.programs.shared import Shared

FINER: Final = 0.3  # [-] of the usual thinning, where no rounding keeps the demands with that: it adds rows, not stops
FEW_STOPS: Final = 0.1  # [-] of the rows that may be rounded: where more of them stay stops, more rows are tried
BOTH: tuple[Promise, ...] = (Promise.TIMED, Promise.SYNCHRONISED)  # promises that keep the rows of robots together


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PreparedExport:
    """What a format is to write."""

    dialect: Dialect  # the format
    job: ExportJob  # frame and rows, without notes
    promised: Promised  # what is promised
    requested: Promise | None  # the promise that was asked for; None where the best one was
    skew: RunSkew | None  # allowed start skew; None for one controller, or where the promise does not depend on it
    orders: tuple[Orders, ...]  # marks and what is certified between them, of each program; empty unless robots wait
    thinning: tuple[float, float] | None  # how far a tool in [mm] and a joint in [deg] may be off; None: all rows stay
    lead: float  # time in [s] by which the rows are later than those of the run
    shared: Shared  # what exports of the run share


class _NoLineError(NotVerifiedError):
    """No task of a run is left whose tool can move on lines and arcs."""


def prepare(
    run: VerifiedRun,
    dialect: Dialect,
    choice: Choice,
    *,
    shared: Shared | None = None,
    progress: Progress = silent,
    no_line: str | None = None,
) -> PreparedExport:
    """Choose promise, marks and rows of an export; ``shared`` is None for one export only.

    ``no_line`` says why no tool moves on lines where it is known that none can.

    Raises:
        InputError: The format cannot write this, or something is not stated in the cell.
        NotVerifiedError: No promise of the format can be kept with this motion.
    """
    choice.refuse_for(dialect)
    shared = shared or Shared(run)
    robots = exported_robots(run.cell, dialect, choice.robots)
    skew = run_skew(run) if Promise.TIMED in dialect.promises else None
    moves = choice.moves if no_line is None else Moves.JOINTS
    promised = choose_promise(run, dialect, robots, skew=skew, requested=choice.promise, moves=moves)
    if no_line is not None:
        is_in_step = promised.promise is Promise.SYNCHRONISED
        choice = replace(choice, moves=moves) if is_in_step else choice
        what = "no lines" if is_in_step else f"not {Promise.PACED}"
        promised = replace(promised, reasons=(*promised.reasons, f"{what}: {no_line}"))
    frame = frame_of(run, dialect, robots, promised.promise, choice)
    raise_findings(unmet_demands(run, dialect, frame, choice))
    has_waits = promised.promise.waits and len(speakers(frame)) > 1
    orders = shared.orders(progress) if has_waits else ()
    try:
        job, lead, remarks = _job(shared, dialect, choice, frame=frame, orders=orders)
    except _NoLineError as error:
        if choice.promise is Promise.PACED:
            raise
        return prepare(run, dialect, choice, shared=shared, progress=progress, no_line="; ".join(error.findings))
    is_rounded = dialect.is_rounded and not is_at_cycle(dialect, frame.promise)
    stops, count = stops_left(job) if is_rounded else (0, 0)
    if stops > FEW_STOPS * count and not choice.is_thinned and not dialect.has_seams(frame):
        finer = replace(choice, thin_mm=FINER * THIN_MM, thin_deg=FINER * THIN_DEG)
        other, _, said = _job(shared, dialect, finer, frame=frame, orders=orders)
        if stops_left(other)[0] < stops:
            job, choice, remarks = other, finer, said
    return PreparedExport(
        dialect=dialect,
        job=job,
        promised=replace(promised, remarks=(*promised.remarks, *remarks)),
        requested=choice.promise,
        skew=skew if promised.promise is Promise.TIMED else None,
        orders=orders,
        thinning=thinning_of(dialect, promised.promise, choice),
        lead=lead,
        shared=shared,
    )


def _job(
    shared: Shared, dialect: Dialect, choice: Choice, *, frame: ExportFrame, orders: Sequence[Orders]
) -> tuple[ExportJob, float, tuple[str, ...]]:
    """The rows of an export, rounded as far as the cell allows it; by how much they are later; remarks for the head."""
    programs, lead = _shaped(shared, dialect, choice, frame=frame, orders=orders)
    if dialect.states_poses(frame):
        programs = with_part_poses(frame, programs)
    job = ExportJob(frame=frame, programs=programs)
    if dialect.is_rounded and not is_at_cycle(dialect, frame.promise):
        as_poses = dialect.states_poses(frame) or dialect.has_seams(frame)
        read = None if as_poses else dialect.read(frame, dialect.render(job))
        job = with_rounding(dialect, job, shared=shared, read=read, orders=orders, lead=lead)
    if not dialect.has_seams(frame):
        every, essential = full_rows(shared.run), essential_rows(shared.run)
        return job, lead, tuple(feeds_in_step(job.programs, every, essential)) if dialect.states_poses(frame) else ()
    most = (THIN_MM if choice.thin_mm is None else choice.thin_mm) / MM
    job, by_joints = _with_lines(shared, dialect, job, orders, most=most)
    return job, lead, tuple(_moved_by_joints(frame, by_joints))


def _with_lines(
    shared: Shared, dialect: Dialect, job: ExportJob, orders: Sequence[Orders], *, most: float
) -> tuple[ExportJob, dict[str, str]]:
    """A job with lines and arcs, and why the tools of some tasks move by joints instead, by their names.

    ``NotVerifiedError`` where none may, as the moves are to be linear, and ``_NoLineError`` where all would have to.
    """
    frame, essential = job.frame, essential_rows(shared.run)
    full = _with_orders(full_rows(shared.run), orders)
    phases = [phase for program in essential for phase in program.work]
    raise_findings(error for phase in phases for error in shared_outputs(phase.cell, phase.tasks))
    by_joints: dict[str, str] = {}
    for task, holder in on_moving_parts(full, essential) if frame.promise.waits else ():
        if (robot := frame.cell.task(task).robot) in frame.robots and holder not in in_step(frame, robot):
            by_joints[task] = f"'{holder}' moves the part while the tool works"
    for entry in frame.cell.tasks:
        if entry.robot in frame.robots and entry.weave is not None and entry.weave.stands:
            by_joints[entry.name] = "it stands at the edges of its weave, which lines do not hold; write --format csv"
    if frame.moves is Moves.LINEAR and by_joints:
        raise NotVerifiedError([f"--moves linear: task '{name}': {reason}" for name, reason in by_joints.items()])
    limits = LineLimits(most, dialect.smallest_zone)
    while True:
        lines = with_seams(shared.scene, job, full, essential, limits=limits, by_joints=by_joints)
        if dialect.has_joint_seams and not frame.promise.waits:
            lines = replace(lines, programs=tuple(with_joints_of_arcs(frame, one) for one in lines.programs))
        if frame.moves is Moves.LINEAR:
            return lines, by_joints
        if not any(rows.seams for program in lines.programs for rows in program.robots.values()):
            raise _NoLineError([f"task '{task}': {reason}" for task, reason in by_joints.items()])
        try:
            executed = executed_programs(lines, dialect, full, dialect.read(frame, dialect.render(lines)))
            refused = refused_lines(shared, dialect, lines, executed, orders=orders)
        except LineRefusedError as error:
            refused = {error.task: error.reason}
        if not refused:
            return lines, by_joints
        by_joints |= refused


def _moved_by_joints(frame: ExportFrame, by_joints: Mapping[str, str]) -> Iterator[str]:
    """What is said of tasks whose tools move by joints."""
    for task, reason in by_joints.items():
        has_process = frame.cell.task(task).process is not None
        without = ", without statements of its process" if has_process else ""
        yield f"task '{task}' moves by joints, at no programmed speed{without}: {reason}"


def _shaped(
    shared: Shared, dialect: Dialect, choice: Choice, *, frame: ExportFrame, orders: Sequence[Orders]
) -> tuple[tuple[ProgramRows, ...], float]:
    """Rows of the robots that are exported, with marks, as the format holds them; and by how much they are later."""
    run, programs = shared.run, _with_orders(full_rows(shared.run), orders)
    thinning = thinning_of(dialect, frame.promise, choice)
    if is_at_cycle(dialect, frame.promise):
        cycles = {robot.name: cycle_of(robot) for robot in run.cell.robots}  # all start and end together
        programs = tuple(_only(program, frame.robots) for program in programs)
        return tuple(resampled(run.cell, program, cycles) for program in programs), lead_time(cycles)
    if thinning is not None:
        limits = ThinningLimits(
            turn=thinning[1] / DEG, slide=thinning[0] / MM, tool=thinning[0] / MM, shortest_time=dialect.shortest_time
        )
        scene, groups = shared.scene, row_groups(frame)
        rows_of_run = essential_rows(run)
        programs = tuple(
            thinned(scene, program, groups=groups, limits=limits, essential_rows=rows)
            for program, rows in zip(programs, rows_of_run, strict=True)
        )
    return tuple(_only(program, frame.robots) for program in programs), 0.0


def thinning_of(dialect: Dialect, promise: Promise, choice: Choice) -> tuple[float, float] | None:
    """How far a tool in [mm] and a turning joint in [deg] may be off; None where no row is left out."""
    return None if is_at_cycle(dialect, promise) else choice.thinning(dialect)


def row_groups(frame: ExportFrame) -> list[list[str]]:
    """Robots that keep the same rows: all of a controller where they are to stay together, or else those in step."""
    if frame.promise not in BOTH:
        return [list(unit) for unit in units_of(frame)]
    groups: dict[str, list[str]] = {}
    for name, controller in controllers_of(frame.cell, frame.robots).items():
        groups.setdefault(controller, []).append(name)
    return list(groups.values())


def _with_orders(programs: Sequence[ProgramRows], orders: Sequence[Orders]) -> tuple[ProgramRows, ...]:
    """Programs whose robots wait for one another, where they do."""
    if not orders:
        return tuple(programs)
    return tuple(_with_marks(program, order) for program, order in zip(programs, orders, strict=True))


def _with_marks(program: ProgramRows, orders: Orders) -> ProgramRows:
    """A program whose robots wait for one another."""
    return replace(program, robots={n: replace(rows, marks=orders.marks) for n, rows in program.robots.items()})


def _only(program: ProgramRows, robots: Sequence[str]) -> ProgramRows:
    """A program of some robots."""
    missing = [name for name in robots if name not in program.robots]
    if missing:
        raise InputError(f"program of '{missing[0]}': expected rows, got none")
    return replace(program, robots={name: program.robots[name] for name in robots})
