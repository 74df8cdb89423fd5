"""Strict reader of URScript with seams: what is written, but for spaces, comments and empty lines, nothing else."""

import re
from collections.abc import Callable, Sequence
from typing import Final, NamedTuple, NoReturn

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.joints import Angle, from_numbers
from cellplan.programs.elements.paced import ReadMove, rows_of_moves
from cellplan.programs.elements.text import line_error
from cellplan.programs.formats.urscript.rows import move_acceleration
from cellplan.programs.formats.urscript.seams import (
    TOOL_ACCELERATION,
    UR,
    frame_lines,
    part_name,
    routine_names,
    urscript_events,
)
from cellplan.programs.formats.urscript.statements import Statements, UrscriptStatement, compact
from cellplan.programs.formats.urscript.text import approach_call, require_turns
from cellplan.programs.formats.zones import with_shares

_NUMBER: Final = r"-?(?:0|[1-9][0-9]{0,2})\.[0-9]{1,12}"
_SIX: Final = rf"\[({_NUMBER}(?:,{_NUMBER}){{5}})\]"
_JOINTS: Final = re.compile(rf"(\w+)={_SIX}")
_POSE: Final = re.compile(rf"(\w+)=p{_SIX}")
_MOVEJ: Final = re.compile(r"movej\((\w+),a=([0-9.]+),v=([0-9.]+)(?:,r=([0-9.]+))?\)")
_TOOL: Final = re.compile(
    r"(movel|movec)\(pose_trans\((\w+),(\w+)\),(?:pose_trans\((\w+),(\w+)\),)?a=([0-9.]+),v=([0-9.]+),r=([0-9.]+)"
    r"(,mode=0)?\)"
)


class _Routine(NamedTuple):
    """A routine: where it is declared, and its statements."""

    head: UrscriptStatement
    statements: Sequence[UrscriptStatement]


class SeamReader:
    """Follows the program of one robot."""

    def __init__(self, frame: ExportFrame, robot: Robot, statements: Statements) -> None:
        """Begin before the first statement of the program."""
        self._frame, self._robot, self._all = frame, robot, statements
        self._events = urscript_events(frame, robot.name)
        self._tasks = {name: task for task, name in routine_names(frame, robot.name).items()}
        self._joints: dict[str, Array] = {}
        self._poses: dict[str, Array] = {}
        self._declared: dict[str, UrscriptStatement] = {}
        self._moves: list[ReadMove] = []
        self._radii: list[float] = []
        self._between: list[list[str]] = [[]]

    def rows(self) -> RobotRows:
        """All rows; the statements up to the end of the program are taken. An ``InputError`` has file and line."""
        for line in frame_lines(self._frame, self._robot):
            self._all.take(line)
        while self._declare(self._all.peek()):
            self._all.place += 1
        routines: dict[str, _Routine] = {}
        while (head := self._all.peek()).text.startswith("def "):
            name = head.text.removeprefix("def ").removesuffix("():")
            if name not in self._tasks or name in routines:
                raise self._error(head, "the routine of a task of the robot, once")
            self._all.place += 1
            routines[name] = _Routine(head, self._block())
        for statement in self._block(until_end=True):
            name = statement.text.removesuffix("()")
            if statement.text.endswith("()") and name in routines:
                for inner in routines.pop(name).statements:
                    self._play(inner, self._tasks[name])
            else:
                self._play(statement, None)
        for routine in routines.values():
            raise self._error(routine.head, "routines that are called once")
        for name, statement in self._declared.items():
            raise self._error(statement, f"points that are used ({name})")
        if not self._moves:
            raise self._error(self._all.peek(), "movej")
        return rows_of_moves(self._events, with_shares(self._robot, self._moves, self._radii), self._between)

    def _declare(self, statement: UrscriptStatement) -> bool:
        """Take in a declared point; whether it is one."""
        joints, pose = _JOINTS.fullmatch(statement.text), _POSE.fullmatch(statement.text)
        match = joints or pose
        if match is None:
            return False
        if match[1] in self._declared:
            raise self._error(statement, "another name")
        numbers = np.array([float(text) for text in match[2].split(",")])
        self._declared[match[1]] = statement
        if joints:
            require_turns(self._robot.model.joint_names, numbers[None], row_of=[f"{self._all.file}:{statement.line}"])
            self._joints[match[1]] = from_numbers(self._robot, numbers[None], angle=Angle.RADIANS)[0]
        else:
            self._poses[match[1]] = UR.pose(numbers * np.array([MM] * 3 + [1.0] * 3))
        return True

    def _block(self, *, until_end: bool = False) -> list[UrscriptStatement]:
        """Statements up to an ``end``, which is taken unless it is that of the program; a wait is one statement."""
        statements: list[UrscriptStatement] = []
        while (statement := self._all.peek()).text != "end":
            self._all.place += 1
            if statement.text.startswith("while "):
                parts = [statement.text]
                while self._all.peek().text != "end":
                    parts.append(self._all.peek().text)
                    self._all.place += 1
                self._all.place += 1
                statement = statement._replace(text="\n".join([*parts, "end"]))
            statements.append(statement)
        self._all.place += not until_end
        return statements

    def _play(self, statement: UrscriptStatement, task: str | None) -> None:
        """Follow one statement."""
        if joint := _MOVEJ.fullmatch(statement.text):
            self._add(self._joint_move(statement, joint, task), float(joint[4] or 0.0))
        elif tool := _TOOL.fullmatch(statement.text):
            self._add(self._tool_move(statement, tool, task), 0.0)
        else:
            if not self._events.knows(task, statement.text):
                raise self._error(statement, "a statement that these programs have")
            self._between[-1].append(statement.text)

    def _add(self, move: ReadMove, radius: float) -> None:
        """A move."""
        self._moves.append(move)
        self._radii.append(radius)
        self._between.append([])

    def _joint_move(self, statement: UrscriptStatement, words: re.Match[str], task: str | None) -> ReadMove:
        """A motion of the joints to a point."""
        if not self._moves and f"a={words[2]},v={words[3]}" != compact(approach_call()):
            raise self._error(statement, f"movej(…, {approach_call()}) to the first row")
        largest = max(joint.velocity for joint in self._robot.model.joints)
        if not 0.0 < float(words[3]) <= largest:
            raise self._error(statement, f"a speed above 0 and up to {largest:.3f} rad/s")
        if self._moves and words[2] != f"{move_acceleration(self._robot):.3f}":
            raise self._error(statement, f"a={move_acceleration(self._robot):.3f}")
        q = self._point(statement, words[1], self._joints)
        return ReadMove(refuse=self._refusal(statement), task=task, q=q, speed=float(words[3]))

    def _tool_move(self, statement: UrscriptStatement, words: re.Match[str], task: str | None) -> ReadMove:
        """A line or an arc of the tool."""
        is_arc = words[1] == "movec"
        if is_arc is not (words[5] is not None and words[9] is not None) or is_arc is not (words[5] is not None):
            raise self._error(statement, "movel with one point, or movec with two and mode=0")
        if task is None:
            raise self._error(statement, "lines and arcs in the routine of a task")
        part = part_name(self._frame, self._robot.name, task)
        if any(name not in {None, part} for name in (words[2], words[4])):
            raise self._error(statement, f"points in {part}, as the cell states it")
        if float(words[6]) != TOOL_ACCELERATION or not float(words[7]) > 0.0:
            raise self._error(statement, f"a={TOOL_ACCELERATION:.3f} and a speed above 0")
        names = [name for name in (words[3], words[5]) if name is not None]
        return ReadMove(
            refuse=self._refusal(statement),
            task=task,
            q=np.full(len(self._robot.model.joints), np.nan),
            poses=tuple(self._point(statement, name, self._poses) for name in names),
            feed=float(words[7]),
            zone=float(words[8]),
        )

    def _point(self, statement: UrscriptStatement, name: str, points: dict[str, Array]) -> Array:
        """A declared point, used once."""
        if name not in points or name not in self._declared:
            raise self._error(statement, "a point that is declared for such a motion and used once")
        del self._declared[name]
        return points[name]

    def _error(self, statement: UrscriptStatement, expected: str) -> Exception:
        """The error that something else is expected at a statement."""
        return line_error(self._all.file, statement.line, expected, statement.shown)

    def _refusal(self, statement: UrscriptStatement) -> Callable[[str, str | None], NoReturn]:
        """What refuses a statement."""

        def refuse(expected: str, got: str | None) -> NoReturn:
            raise line_error(self._all.file, statement.line, expected, got or statement.shown)

        return refuse
