"""Programs of a recovery: its rows in the format of a controller, read back and judged as the recovery is."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np

from cellplan.cache import without_cache
from cellplan.errors import NotVerifiedError
from cellplan.geometry.transforms import Array
from cellplan.jobs.recover.legs import Leg, Track, leg_findings, recovery_legs, recovery_rows
from cellplan.jobs.recover.recover import Recovery
from cellplan.jobs.recover.refusals import recovery_frame
from cellplan.jobs.recover.state import RunPlaces
from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ExportFrame, ExportJob, Interpolation, ProgramRows, Promise, RobotRows
from cellplan.model.report.verified_run import VerifiedRun
from cellplan.programs.dialects import DIALECTS
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import speakers
from cellplan.programs.elements.joints import in_step
from cellplan.programs.elements.timed_rows import cycle_of
from cellplan.programs.export.notes import READ_BACK
from cellplan.programs.export.refusals import is_at_cycle
from cellplan.programs.judgement.compare_rows import other_rows
from cellplan.programs.promises.promises import waits
from cellplan.programs.rows.interpolant import HermiteRows, resting, row_velocities
from cellplan.programs.rows.resample import lead_time, resampled
from cellplan.programs.rows.thin import bends

WITHIN: Final = 2e-5  # [rad] or [m] that joints may be off where rows are left out
SAME_TIME: Final = 1e-7  # [s] rows nearer than this are one
PARTS: Final = 10  # parts of a step of a cubic that are taken as even
ONE_CLOCK: Final = "times of the tables: all robots start together, on controllers with one clock"
REMARKS: Final = {
    Promise.TIMED: ONE_CLOCK,
    Promise.SYNCHRONISED: "same row at the same time; the controller may take longer than planned",
    Promise.SEQUENCE_ONLY: "the controller makes the speed between rows; all robots of the cell wait at the marks",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RecoveryPrograms:
    """A recovery in one format."""

    recovery: Recovery
    places: RunPlaces  # the phases of the run, for a cell as slow as the recovery
    legs: tuple[Leg, ...]  # what lies between two waits
    job: ExportJob  # what was written
    lead: float  # time in [s] by which its rows are later than those of the tables
    by_hand: tuple[str, ...]  # robots of whose waits no format writes any
    files: Mapping[str, str]  # text by path

    @property
    def record(self) -> dict[str, object]:
        """What ``recovery.json`` says of it."""
        rows = self.job.programs[0].robots
        return {
            "promise": str(self.job.frame.promise),
            "robots": list(rows),
            "marks": {name: list(robot_rows.marks) for name, robot_rows in rows.items()},
            "by_hand": list(self.by_hand),
        }

    def findings(self, dialect: Dialect, files: Mapping[str, str]) -> list[str]:
        """What does not hold of files as they are read; an ``InputError`` has file and line."""
        read, recovery = dialect.read(self.job.frame, files), self.recovery
        findings = list(other_rows(dialect, self.job, read))
        if not findings:
            rows = recovery_rows(recovery.phases)
            tracks = [(leg, _tracks(dialect, self, read, leg, rows)) for leg in self.legs]
            findings += leg_findings(self.places, recovery.state, recovery.phases, tracks)
        return findings


def recovery_programs(run: VerifiedRun, recovery: Recovery, form: str) -> RecoveryPrograms:
    """A recovery that was found, in one format.

    Raises:
        InputError: The format cannot hold it, or something is not stated in the cell.
        NotVerifiedError: Another order of the robots is not clear, or a check fails on what was read.
    """
    frame, dialect = recovery_frame(run, form), DIALECTS[form]
    places = replace(RunPlaces.of(run), cell=recovery.cell)
    with without_cache():
        legs = _legs(places, recovery, frame.promise)
        program, lead = _program(places.cell, frame, dialect, legs, recovery_rows(recovery.phases))
        by_hand = tuple(robot.name for robot in run.cell.robots if not waits(run.cell, robot.name))
        by_hand = by_hand if frame.promise is Promise.SEQUENCE_ONLY and len(run.cell.robots) > 1 else ()
        job = ExportJob(frame=frame, programs=(program,), notes=tuple(_notes(run, recovery, frame, by_hand)))
        programs = RecoveryPrograms(
            recovery=recovery,
            places=places,
            legs=legs,
            job=job,
            lead=lead,
            by_hand=by_hand,
            files=dialect.render(job),
        )
        findings = programs.findings(dialect, programs.files)
    if findings:
        raise NotVerifiedError([f"recovery as {form}: {finding}" for finding in findings])
    return programs


def _notes(run: VerifiedRun, recovery: Recovery, frame: ExportFrame, by_hand: Sequence[str]) -> Iterator[str]:
    """Notes for the heads of the files."""
    yield f"cell {run.cell.name}, recovery from {recovery.state.at:g} s of its program"
    yield from (
        f"{name} stands where it is at {time:g} s"
        for name, time in recovery.state.times.items()
        if time != recovery.state.at
    )
    yield f"promise: {frame.promise}"
    yield REMARKS[frame.promise]
    yield from (f"no format writes the waits of {name}: program them by hand" for name in by_hand)
    yield "every row is a stop" if frame.promise is not Promise.TIMED else "every row of the tables"
    yield f"run {run.digest}"
    yield READ_BACK


def _legs(places: RunPlaces, recovery: Recovery, promise: Promise) -> tuple[Leg, ...]:
    """Legs of a recovery: between waits, or whole phases where robots keep one clock."""
    if promise is Promise.SEQUENCE_ONLY:
        return recovery_legs(places, recovery.state, recovery.phases)
    ends = np.cumsum([0, *(len(phase.q) - 1 for phase in recovery.phases)]).tolist()
    return tuple(Leg(phase=place, first=first, last=last) for place, (first, last) in enumerate(pairwise(ends)))


def _program(
    cell: Cell, frame: ExportFrame, dialect: Dialect, legs: Sequence[Leg], rows: Array
) -> tuple[ProgramRows, float]:
    """The rows as a format holds them, and the time in [s] by which they are later."""
    every, promise, robots = list(range(len(rows))), frame.promise, dict[str, RobotRows]()
    for name in frame.robots:
        q = np.hstack([rows[:, cell.columns(other)] for other in in_step(frame, name)])
        selected = every if promise is Promise.TIMED else _bend_rows(q, legs)
        waits_there = promise is Promise.SEQUENCE_ONLY and len(speakers(frame)) > 1
        ends = [0, *(leg.last for leg in legs)] if waits_there else []
        robots[name] = _rows(cell, name, rows[selected], np.array(selected), [selected.index(row) for row in ends])
    program = ProgramRows(name=None, robots=robots)
    if is_at_cycle(dialect, promise):
        cycles = {robot.name: cycle_of(robot) for robot in cell.robots}
        on_cycle = resampled(cell, program, cycles).robots
        return replace(program, robots={name: on_cycle[name] for name in frame.robots}), lead_time(cycles)
    return program, 0.0


def _bend_rows(q: Array, legs: Sequence[Leg]) -> list[int]:
    """Rows that stay: the ends of all legs, and those at which joints change their direction."""
    return sorted({leg.first + row for leg in legs for row in bends(q[leg.first : leg.last + 1], WITHIN)})


def _rows(cell: Cell, name: str, q: Array, selected: Array, marks: Sequence[int]) -> RobotRows:
    """Some rows of a robot with their times, at each of which it stops unless the format states times."""
    model, times, q_robot = cell.robot(name).model, selected * cell.motion.step, q[:, cell.columns(name)]
    qd = row_velocities(times, q_robot, rests=resting(q_robot), lower=model.lower, upper=model.upper)
    return RobotRows(
        robot=name, q=q_robot, times=times, qd=qd, marks=tuple(marks), process=np.zeros(len(q_robot), dtype=bool)
    )


def _tracks(
    dialect: Dialect, programs: RecoveryPrograms, read: Sequence[ProgramRows], leg: Leg, rows: Array
) -> dict[str, Track]:
    """What each robot passes in a leg: as its program was read, or as in the tables where it has none."""
    cell, lead, tracks = programs.places.cell, programs.lead, dict[str, Track]()
    step = cell.motion.step
    begin, end = leg.first * step + lead, leg.last * step + lead
    for robot in cell.robots:
        of_robot = read[0].robots.get(robot.name)
        if of_robot is None:
            clock = np.arange(leg.first, leg.last + 1, dtype=float) * step + lead
            tracks[robot.name] = Track(clock, rows[leg.first : leg.last + 1, cell.columns(robot.name)])
            continue
        written = programs.job.programs[0].robots[robot.name]
        times: Array = np.asarray(written.times if of_robot.times is None else of_robot.times, dtype=float)
        qd: Array = np.asarray(written.qd if of_robot.qd is None else of_robot.qd, dtype=float)
        curve = HermiteRows(times=times, q=of_robot.q, qd=qd)
        is_cubic = dialect.interpolation is Interpolation.CUBIC
        if is_cubic:
            times = np.interp(np.arange(PARTS * (len(times) - 1) + 1) / PARTS, np.arange(len(times)), times)
        inner = times[(times > begin + SAME_TIME) & (times < end - SAME_TIME)]
        at = np.concatenate([[begin], inner, [end]])
        even = np.stack([np.interp(at, curve.times, column) for column in curve.q.T], axis=1)
        tracks[robot.name] = Track(at, curve.at(at) if is_cubic else even)
    return tracks
