"""Strict reader of TP programs: the written subset and harmless variants of it, nothing else."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.corners import LARGEST_SHARE
from cellplan.programs.elements.handshake import HandshakeStep, handshake_steps, lowering_step
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.fanuc_ls.groups import TpProgram
from cellplan.programs.formats.fanuc_ls.text import TpFile, TpPoint, read_file

MOST_MS: Final = 32_000  # [ms] of a motion; known from practice
MILLISECONDS: Final = {"msec": 1.0, "sec": 1000.0}


def read_fanuc_ls(
    frame: ExportFrame, files: Mapping[str, str], programs: Sequence[TpProgram]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions, marks, and times of groups that move in step.

    An ``InputError`` has file and line.
    """
    left = dict(files)
    rows: dict[str | None, dict[str, RobotRows]] = {name: {} for name in frame.programs}
    for program in programs:
        player = _TpPlayer(frame=frame, program=program)
        player.play_all(left)
        rows[program.program] |= {group.robot.name: player.rows(place) for place, group in enumerate(program.groups)}
        if len({len(one.marks) for one in rows[program.program].values()}) > 1:
            raise InputError(f"{program.name}.ls: expected as many marks as the programs of the other robots have")
    if left:
        raise InputError(f"{min(left)}: expected no such file in this export")
    return tuple(
        ProgramRows(name=name, robots={robot: of_robot[robot] for robot in frame.robots if robot in of_robot})
        for name, of_robot in rows.items()
    )


@dataclass(slots=True, kw_only=True)
class _TpPlayer:
    """Follows a program statement by statement."""

    frame: ExportFrame
    program: TpProgram
    points: list[TpPoint] = field(default_factory=list)  # that were moved to
    durations: list[float] = field(default_factory=list)  # of these motions in [ms]; 0 where none is stated
    passed: list[bool] = field(default_factory=list)  # whether they end in CNT
    marks: list[int] = field(default_factory=list)  # motions with a handshake
    settings: set[tuple[str, int]] = field(default_factory=set)  # frames that were selected, by group
    pages: int = 0  # that were called
    step: int = 0  # instructions of a handshake that were met
    lowered: Statement | None = None  # where its output was lowered before the first motion
    unused: dict[int, TpPoint] = field(default_factory=dict)  # points of the file that are still to come

    def play_all(self, left: dict[str, str]) -> None:
        """Follow the main program and its pages; their files are taken out of those that are left."""
        main = self._opened(left, self.program.name)
        for statement in main.statements:
            if statement.kind == "CALL":
                self._call(statement, left)
            elif self.pages:
                raise statement.error("nothing but calls of pages behind the first one")
            else:
                self._play(statement)
        self._close(main)
        if not self.points:
            raise main.end.error("at least one motion", "none")
        if self.lowered and not self.marks:
            raise self.lowered.error("a handshake at a row, as its output is lowered", "none")

    def rows(self, place: int) -> RobotRows:
        """Rows of one of its groups."""
        group = self.program.groups[place]
        values = np.array([[*point.poses[group.number].values] for point in self.points])
        numbers = np.empty_like(values)
        numbers[:, group.order] = values
        times: Array | None = None
        if self._in_step:
            times = np.cumsum(self.durations) / MILLISECONDS["sec"]
        rounding = np.where(self.passed, LARGEST_SHARE, 0.0)
        return RobotRows(
            robot=group.robot.name,
            q=from_numbers(group.robot, numbers),
            times=times,
            marks=tuple(self.marks),
            rounding=rounding,
        )

    @property
    def _in_step(self) -> bool:
        return self.frame.promise is Promise.SYNCHRONISED

    @property
    def _handshake(self) -> tuple[HandshakeStep, ...]:
        """What is done at a mark."""
        return () if self._in_step else handshake_steps(self.frame, self.program.groups[0].robot.name)

    def _call(self, statement: Statement, left: dict[str, str]) -> None:
        """A page, which is played in the place of its call."""
        expected = f"{self.program.name}_{self.pages + 1:03d}"
        if (self.points and not self.pages) or self.unused or self.step or statement.words[0] != expected:
            raise statement.error(f"CALL {expected} in a program without motions of its own")
        self.pages += 1
        page = self._opened(left, expected)
        for inner in page.statements:
            if inner.kind not in {"J", "OUT", "WAIT"}:
                raise inner.error("nothing but motions and handshakes in a page")
            self._play(inner)
        if not page.points:
            raise page.end.error("at least one motion", "none")
        self._close(page)

    def _opened(self, left: dict[str, str], name: str) -> TpFile:
        """A file whose points are those of the groups."""
        file, groups = read_file(left, name), {group.number: group for group in self.program.groups}
        if file.groups != set(groups):
            listed = ", ".join(map(str, groups))
            raise file.head.error(f"DEFAULT_GROUP of motion group {listed}", ", ".join(map(str, file.groups)))
        for point in file.points.values():
            if set(point.poses) != set(groups):
                raise point.statement.error(f"GP{', GP'.join(map(str, groups))}, and no other group")
            for number, pose in point.poses.items():
                group = groups[number]
                if (pose.base, pose.tool) != (group.base, group.tool):
                    raise point.statement.error(f"UF : {group.base}, UT : {group.tool} of GP{number}")
                if list(pose.axes.items()) != list(group.axes.items()):
                    axes = ", ".join(f"{name} in {unit}" for name, unit in group.axes.items())
                    raise point.statement.error(f"{axes} of GP{number}, and no other axis")
        self.unused = dict(file.points)
        return file

    def _play(self, statement: Statement) -> None:
        """Follow one statement."""
        if self.step and statement.kind not in {"OUT", "WAIT"}:
            raise statement.error(f"the rest of the handshake ({self._expected()})")
        if statement.kind == "J":
            self._move(statement)
        elif statement.kind in {"OUT", "WAIT"}:
            self._signal(statement)
        else:
            self._select(statement)

    def _select(self, statement: Statement) -> None:
        """A frame of a group, selected once before the first motion."""
        number, value = int(statement.words[0] or 1), int(statement.words[1] or 0)
        group = next((group for group in self.program.groups if group.number == number), None)
        key = (statement.kind, number)
        if group is None or key in self.settings or self.points:
            raise statement.error("the frames of each group, each once before the first motion")
        stated = group.base if statement.kind == "UFRAME" else group.tool
        if value != stated:
            raise statement.error(f"{statement.kind}_NUM={stated} as the cell states it")
        self.settings.add(key)

    def _move(self, statement: Statement) -> None:
        """A motion to a point of the file that was not used before."""
        point, speed, unit, ending = (str(word) for word in statement.words)
        if len(self.settings) < 2 * len(self.program.groups):
            raise statement.error("UFRAME_NUM and UTOOL_NUM of each group before the first motion")
        if int(point) not in self.unused:
            raise statement.error("a point of this file, each once", f"P[{point}]")
        is_timed = self._in_step and bool(self.points)
        if (unit in MILLISECONDS) is not is_timed:
            raise statement.error("a duration in sec or msec" if is_timed else "a speed in %", f"{speed}{unit}")
        value = float(speed) * MILLISECONDS.get(unit, 1.0)
        if not (0.0 < value <= MOST_MS if is_timed else value in range(1, 101)):
            raise statement.error(f"1 to {MOST_MS} ms" if is_timed else "a whole speed of 1 to 100 %", f"{speed}{unit}")
        if ending != "FINE" and int(ending.removeprefix("CNT")) > 100:
            raise statement.error("FINE, or CNT0 to CNT100", ending)
        self.points.append(self.unused.pop(int(point)))
        self.durations.append(value if is_timed else 0.0)
        self.passed.append(ending != "FINE")

    def _signal(self, statement: Statement) -> None:
        """An instruction of a handshake."""
        expected, row = self._handshake, len(self.points) - 1
        step = HandshakeStep(statement.kind == "WAIT", str(int(statement.words[0] or 0)), statement.words[1] == "ON")
        if expected and not self.lowered:
            first = lowering_step(self.frame, self.program.groups[0].robot.name)
            if row >= 0 or self.pages or step != first:
                raise statement.error(f"DO[{first.signal}]=OFF before the first motion")
            self.lowered = statement
            return
        if not expected or row < 0 or self.passed[row] or row in self.marks:
            raise statement.error("signals only once behind FINE at a mark")
        if step != expected[self.step]:
            raise statement.error(f"the handshake of the cell ({self._expected()})")
        self.step = (self.step + 1) % len(expected)
        if self.step == 0:
            self.marks.append(row)

    def _expected(self) -> str:
        """The next instruction of a handshake."""
        step = self._handshake[self.step]
        return f"{'WAIT DI' if step.waits else 'DO'}[{step.signal}]={'ON' if step.is_on else 'OFF'}"

    def _close(self, file: TpFile) -> None:
        """Make sure that a file ends in order."""
        if self.step:
            raise file.end.error(f"the rest of the handshake ({self._expected()})")
        for number, point in self.unused.items():
            raise point.statement.error("points that are used", f"P[{number}]")
        if self.passed and self.passed[-1]:
            raise file.end.error("FINE at the last row", "CNT")
