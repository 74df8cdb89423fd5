"""Strict reader of jobs: the written subset and harmless variants of it, nothing else."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.paced import ReadMove, rows_of_moves
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.inform.jobs import JobFrame, inform_events, job_names, level_radii, tasks_of
from cellplan.programs.formats.inform.positions import are_on_one_circle, joints_of
from cellplan.programs.formats.inform.text import JobFile, JobPosition, read_job

ARC: Final = 3  # motions of an arc: to its start, where the tool is already, through a point, and to its end


class Motion(NamedTuple):
    """A motion of a job."""

    statement: Statement
    positions: tuple[JobPosition, ...]  # its end; before it the point through which an arc leads
    level: int  # position level of its end; 0 for a stop

    def behind(self, through: "Motion") -> "Motion":
        """The motion through a point to its end."""
        return self._replace(positions=(*through.positions, *self.positions))


def read_inform(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read the files of an export back; an ``InputError`` has file and line."""
    left, programs = dict(files), []
    mains, _ = job_names(frame)
    for program in frame.programs:
        rows = {name: _RobotReader(frame, frame.robot(name), left).rows(mains[program, name]) for name in frame.robots}
        if len({len(one.marks) for one in rows.values()}) > 1:
            raise InputError(f"{mains[program, frame.robots[-1]]}.JBI: expected as many marks as the other robots have")
        programs.append(ProgramRows(name=program, robots=rows))
    if left:
        raise InputError(f"{min(left)}: expected no such file in this export")
    return tuple(programs)


class _RobotReader:
    """Follows the jobs of one robot."""

    def __init__(self, frame: ExportFrame, robot: Robot, left: dict[str, str]) -> None:
        """Take the files that are left."""
        self._frame, self._robot, self._left = frame, robot, left
        self._tasks = dict(tasks_of(frame, robot.name))
        self._radii = level_radii(frame, robot.name)
        self._moves: list[ReadMove] = []
        self._between: list[list[str]] = [[]]

    def rows(self, name: str) -> RobotRows:
        """The rows of a main job and of those of seams that it calls, each once."""
        base = JobFrame.of(self._robot, None)
        job = read_job(self._left, name, base)
        for item in motions_of(job):
            called = item.words[0] if isinstance(item, Statement) and item.kind == "CALL" else None
            task = self._tasks.pop(called, None) if called else None
            if called and task:
                seam = JobFrame.of(self._robot, self._frame.station(self._robot.name, task))
                self._follow(motions_of(read_job(self._left, called, seam)), seam, task)
            else:
                self._follow([item], base, None)
        events = inform_events(self._frame, self._robot.name)
        if not self._moves:
            raise job.end.error("at least two motions", "none")
        rows = rows_of_moves(events, self._moves, self._between)
        return replace(rows, process=None) if self._frame.promise is Promise.SEQUENCE_ONLY else rows

    def _follow(
        self, items: Iterator[Motion | Statement] | Sequence[Motion | Statement], frame: JobFrame, task: str | None
    ) -> None:
        """Motions of a job in a frame, and the statements behind each."""
        for item in items:
            if isinstance(item, Statement):
                self._between[-1].append(item.text)
            else:
                self._moves.append(self._read(item, frame, task))
                self._between.append([])

    def _read(self, motion: Motion, frame: JobFrame, task: str | None) -> ReadMove:
        """A motion with its joints, or with its poses."""
        statement, end = motion.statement, motion.positions[-1]
        is_joint = statement.kind == "MOVJ"

        q = joints_of(self._robot, frame.X_WC @ end.X, end.stated) if is_joint else np.full(len(end.stated), np.nan)
        if q is None:
            raise end.statement.error(f"a position that the arm reaches in its configuration {end.stated.tolist()}")
        return ReadMove(
            refuse=statement.refuse,
            task=task,
            q=q,
            poses=() if is_joint else tuple(position.X for position in motion.positions),
            configurations=None if is_joint else tuple(position.stated.tolist() for position in motion.positions),
            feed=np.nan if is_joint else float(str(statement.words[1])) / MM,
            zone=0.0 if is_joint else self._zone(motion),
            share=LARGEST_SHARE if motion.level and (is_joint or not len(self._radii)) else 0.0,
            speed=float(str(statement.words[1])) if is_joint else np.nan,
        )

    def _zone(self, motion: Motion) -> float:
        """Distance in [m] from its end within which a line or an arc is rounded, where it is known."""
        most = max(len(self._radii), 1)
        if motion.level > most:
            raise motion.statement.error(f"a position level of at most {most}, as position_levels_mm states them")
        return float(self._radii[motion.level - 1]) if motion.level and len(self._radii) else 0.0


def motions_of(job: JobFile) -> Iterator[Motion | Statement]:
    """Motions of a job, and its other statements, in their order; each position is used by one motion."""
    unused, statements = dict(job.positions), job.statements
    here: Motion | None = None
    circle: list[JobPosition] = []  # start, point and end of the arc right before
    is_behind_arc, place = False, 0
    while place < len(statements):
        statement, kinds = statements[place], [one.kind for one in statements[place : place + 1 + ARC]]
        if statement.kind in {"CALL", ""}:
            yield statement
            circle, place = [], place + 1
            continue
        motion = _motion(statement, unused)
        if is_behind_arc and here and kinds == ["MOVL", *["MOVC"] * ARC] and _repeats(motion, here):
            is_behind_arc, circle, place = False, [], place + 1
            continue
        if statement.kind != "MOVC":
            circle, place = [], place + 1
        elif circle and here and kinds[1:2] == ["MOVC"]:
            through, end = motion, _motion(statements[place + 1], unused)
            _require_one_speed(through, here.statement, end.statement)
            points = [*circle, through.positions[-1], end.positions[-1]]
            if not are_on_one_circle(np.array([point.X[:3, 3] for point in points])):
                raise statement.error("MOVL between arcs of two circles")
            motion, circle, place = end.behind(through), points[-ARC:], place + 2
        elif here and not is_behind_arc and kinds[1:ARC] == ["MOVC"] * 2 and _repeats(motion, here):
            through, end = (_motion(inner, unused) for inner in statements[place + 1 : place + ARC])
            _require_one_speed(through, statement, end.statement)
            circle, place = [one.positions[-1] for one in (motion, through, end)], place + ARC
            motion = end.behind(through)
        else:
            raise statement.error("MOVC to where the tool is, through a point and to the end; MOVL between arcs")
        here, is_behind_arc = motion, bool(circle)
        yield motion
    if unused:
        raise next(iter(unused.values())).statement.error("each position used by one motion", "none that uses it")


def _require_one_speed(through: Motion, *others: Statement) -> None:
    """Refuse a point of an arc that is not passed, and motions of one circle at several speeds."""
    if through.level != 1 or {one.words[1] for one in others} != {through.statement.words[1]}:
        raise through.statement.error("a point of an arc with PL=1, at the speed of its start")


def _motion(statement: Statement, unused: dict[int, JobPosition]) -> Motion:
    """A motion to a position that no other one used."""
    number = int(str(statement.words[0]))
    if number not in unused:
        raise statement.error("a position that is declared, and used once")
    return Motion(statement, (unused.pop(number),), int(str(statement.words[-1])))


def _repeats(motion: Motion, here: Motion) -> bool:
    """Whether a motion leads to where the last one ended, rounded or not as that one."""
    return motion.positions[-1].is_that_of(here.positions[-1]) and motion.level == here.level
