"""Reader of URScript programs: statements of our own subset, one on each line, and the handshakes among them."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.joints import ARM, Angle, from_numbers
from cellplan.programs.elements.text import line_error, mismatch_error
from cellplan.programs.elements.timed_rows import cycle_of, file_path, require_paths
from cellplan.programs.formats.urscript.rows import APPROACH_SPEED, move_acceleration
from cellplan.programs.formats.urscript.seams_reader import SeamReader
from cellplan.programs.formats.urscript.statements import Statements, UrscriptStatement, compact
from cellplan.programs.formats.urscript.text import (
    ENDING,
    approach_call,
    decimals_of_urscript,
    function_names,
    handshake_lines,
    lowering,
    most_rows,
    require_turns,
    servo_call,
    stop_call,
)
from cellplan.programs.formats.zones import tool_shares

_SPEED: Final = r"(?!0\.0+(?![0-9]))(?:0|[1-9][0-9]{0,3})\.[0-9]{3}"
_RADIUS: Final = r"(?!0\.0+(?![0-9]))[0-9]\.[0-9]{4}"


def read_urscript(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read files back, strictly but for spaces, comments and empty lines; an ``InputError`` has file and line."""
    keys = [(program, robot) for program in frame.programs for robot in frame.robots]
    paths = {key: file_path(key[0], f"{key[1]}{ENDING}") for key in keys}
    require_paths(files, tuple(paths.values()))
    names, programs = function_names(frame), []
    for program in frame.programs:
        robots = {}
        for robot in frame.robots:
            path = paths[program, robot]
            statements = Statements(files[path], path)
            statements.take(f"def {names[program, robot]}():")
            if frame.promise is Promise.PACED:
                robots[robot] = SeamReader(frame, frame.robot(robot), statements).rows()
            else:
                statements.call_routines(most_rows(frame))
                read = _timed if frame.promise is Promise.TIMED else _sequence
                robots[robot] = read(frame, frame.robot(robot), statements)
            statements.take("end")
            statements.end()
        programs.append(ProgramRows(name=program, robots=robots))
    return tuple(programs)


class _Points:
    """Joint positions of rows as they are found.

    Attributes:
        lines: Line of each row.
        numbers: Its positions in [rad].
    """

    def __init__(self, frame: ExportFrame, robot: Robot, file: str) -> None:
        """Begin with no row."""
        self.robot, self.file = robot, file
        self.lines: list[int] = []
        self.numbers: list[list[float]] = []
        decimals = decimals_of_urscript(frame, robot)
        number = rf"(?!-0\.0+(?![0-9]))-?(?:0|[1-9][0-9]{{0,2}})\.[0-9]{{{decimals}}}"
        self.pattern = rf"\[({number}(?:,{number}){{{ARM - 1}}})\]"
        self.expected = f"{ARM} positions with {decimals} decimals"

    def add(self, statements: Statements, pattern: re.Pattern[str], what: str) -> re.Match[str]:
        """Take in the row of the next instruction, which has to match the pattern."""
        statement = statements.peek()
        match = pattern.fullmatch(statement.text)
        if match is None:
            raise line_error(self.file, statement.line, f"{what} with {self.expected}", statement.shown)
        statements.place += 1
        self.lines.append(statement.line)
        self.numbers.append([float(text) for text in match[1].split(",")])
        return match

    def rows(self, *, times: bool, marks: tuple[int, ...] = ()) -> RobotRows:
        """All rows, none beyond two turns."""
        where = [f"{self.file}:{line}" for line in self.lines]
        numbers = np.array(self.numbers)
        require_turns(self.robot.model.joint_names, numbers, row_of=where)
        cycle_ms = round(1000.0 * cycle_of(self.robot))
        return RobotRows(
            robot=self.robot.name,
            q=from_numbers(self.robot, numbers, angle=Angle.RADIANS),
            times=np.arange(len(numbers)) * cycle_ms / 1000.0 if times else None,
            marks=marks,
        )


def _timed(frame: ExportFrame, robot: Robot, statements: Statements) -> RobotRows:
    """Rows of a program that follows them at the cycle of its controller."""
    points = _Points(frame, robot, statements.file)
    servo = re.compile(rf"servoj\({points.pattern},{re.escape(compact(servo_call(frame, robot)))}\)")
    _approach(points, statements)
    while statements.peek().text.startswith("servoj"):
        points.add(statements, servo, f"servoj([…], {servo_call(frame, robot)})")
    if len(points.lines) < 2:
        raise line_error(statements.file, statements.peek().line, "servoj", statements.peek().shown)
    statements.take(stop_call(robot))
    return points.rows(times=True)


def _approach(points: _Points, statements: Statements) -> None:
    """The move to the first row."""
    pattern = re.compile(rf"movej\({points.pattern},{re.escape(compact(approach_call()))}\)")
    points.add(statements, pattern, f"movej([…], {approach_call()})")


def _sequence(frame: ExportFrame, robot: Robot, statements: Statements) -> RobotRows:
    """Rows and marks of a program that moves from row to row."""
    points, marks, radii = _Points(frame, robot, statements.file), list[int](), [0.0]
    speeds = [APPROACH_SPEED]
    acceleration = re.escape(f"{move_acceleration(robot):.3f}")
    move = re.compile(rf"movej\({points.pattern},a={acceleration},v=({_SPEED})(?:,r=({_RADIUS}))?\)")
    first = statements.peek()
    is_met = not first.text.startswith("movej")
    if is_met:
        statements.take(lowering(frame, robot.name) if handshake_lines(frame, robot.name) else "movej")
    _approach(points, statements)
    is_blended, at = False, statements.all[statements.place - 1]
    while (statement := statements.peek()).text != "end":
        if statement.text.startswith("movej"):
            match = points.add(statements, move, f"movej([…], a={move_acceleration(robot):.3f}, v=…)")
            _require_speed(robot, float(match[2]), statement, statements.file)
            is_blended, at = match[3] is not None, statement
            radii.append(float(match[3] or 0.0))
            speeds.append(float(match[2]))
            continue
        if is_blended or not is_met:
            raise line_error(statements.file, statement.line, "movej, or end", statement.shown)
        _meet(frame, robot, statements)
        marks.append(len(points.lines) - 1)
    if is_blended:
        raise line_error(statements.file, at.line, "a stop at the last row, without r", at.shown)
    if is_met and not marks:
        raise mismatch_error(statements.file, first.line, "a handshake at a row, as its output is lowered", "none")
    rows = points.rows(times=False, marks=tuple(marks))
    return replace(rows, rounding=tool_shares(robot, rows.q, np.array(radii)), speeds=np.array(speeds))


def _require_speed(robot: Robot, speed: float, statement: UrscriptStatement, file: str) -> None:
    """Make sure that a speed is none beyond those of all joints."""
    largest = max(joint.velocity for joint in robot.model.joints)
    if speed > largest:
        raise line_error(file, statement.line, f"a speed of {largest:.3f} rad/s at most", statement.shown)


def _meet(frame: ExportFrame, robot: Robot, statements: Statements) -> None:
    """The handshake of a robot at a mark."""
    lines = handshake_lines(frame, robot.name)
    if not lines:
        statement = statements.peek()
        raise line_error(statements.file, statement.line, "movej, or end", statement.shown)
    for line in lines:
        statements.take(line)
