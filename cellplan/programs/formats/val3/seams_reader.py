"""Strict reader of VAL3 with seams: what is written, and harmless variants of it, nothing else."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.report.exported import ExportFrame, ProgramRows, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.paced import ReadMove, rows_of_moves
from cellplan.programs.elements.pages import read_programs
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.val3.code import Loop, Node
from cellplan.programs.formats.val3.data import Data
from cellplan.programs.formats.val3.names import JOINTS, PART, START, STOP, TOOL
from cellplan.programs.formats.val3.reader import ReadProject, read_project
from cellplan.programs.formats.val3.seams import (
    EVEN,
    NO_LIMIT,
    STAUBLI,
    libraries,
    part_of,
    part_values,
    points_name,
    routine_names,
    signal_data,
    tool_values,
    val3_events,
)
from cellplan.programs.formats.zones import with_shares

DECIMALS: Final = 9  # with which frames are compared
SAME: Final = 1e-6  # [m] or [-] of a frame


def read_val3_seams(
    frame: ExportFrame, files: Mapping[str, str], paths: Mapping[tuple[str | None, str], str]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions, seams with speeds, marks and process.

    A project has its folder by program and robot. An ``InputError`` has file and line.
    """
    return read_programs(frame, files, paths, _rows)


def _rows(frame: ExportFrame, robot: str, left: dict[str, str], path: str) -> tuple[RobotRows]:
    """Rows of one robot; takes the files of its project out of those that are left."""
    return (_SeamPlayer(frame, robot, read_project(left, path, libraries(frame, robot))).rows(),)


class _SeamPlayer:
    """Follows the programs of a project statement by statement."""

    def __init__(self, frame: ExportFrame, robot: str, project: ReadProject) -> None:
        """Begin before the first statement; the data are those of the cell."""
        self._frame, self._robot, self._project = frame, frame.robot(robot), project
        self._events = val3_events(frame, robot)
        name = project.path.rpartition("/")[2]
        self._tasks = {routine: task for task, routine in routine_names(frame, robot, name).items()}
        self._used: dict[str, int] = {}
        self._moves: list[ReadMove] = []
        self._zones: list[float] = []  # of moves of joints in [m]
        self._between: list[list[str]] = [[]]
        self._stands = True
        self._require_data()

    def _require_data(self) -> None:
        """Tool, frames and signals are those of the cell."""
        robot = self._robot.name
        expected = {TOOL: ("tool", [tool_values(self._robot, DECIMALS)])}
        if parts := part_values(self._frame, robot, DECIMALS):
            expected[PART] = ("frame", parts)
        for name, (kind, values) in expected.items():
            data = self._data(name, kind)
            if data.size != len(values):
                raise data.error(f"{len(values)} values", str(data.size))
            for mine, yours in zip(data.values, values, strict=True):
                if np.abs(_pose(mine) - _pose(yours)).max() > SAME:
                    raise data.error(f"{name} as the cell has it", " ".join(mine.values()))
        for name, target in signal_data(self._frame, robot).items():
            data = self._data(name, "dio")
            if data.values[0].get("link") != target:
                raise data.error(f"the link {target}", str(data.values[0].get("link")))

    def _data(self, name: str, kind: str) -> Data:
        """Data of a project by name and type."""
        data = self._project.data.get(name)
        if data is None or data.kind != kind:
            raise InputError(f"{self._project.path}: expected data {name} of the type {kind}")
        return data

    def rows(self) -> RobotRows:
        """All rows, once everything was followed."""
        programs = dict(self._project.programs)
        start, stop = programs.pop(START), programs.pop(STOP)
        if len(stop.code) != 1:
            raise stop.end.error("resetMotion() once in stop", f"{len(stop.code)} statements")
        for node in (*stop.code, *start.code):
            if (_statement(node).kind == "RESET") is not (node in stop.code):
                raise _statement(node).error("resetMotion() alone in stop")
        for node in start.code:
            statement = _statement(node)
            if statement.kind != "CALL":
                self._play(node, None)
                continue
            name = str(statement.words[0])
            if name not in programs or name not in self._tasks:
                raise statement.error("the program of a task of the robot, once")
            for inner in programs.pop(name).code:
                self._play(inner, self._tasks[name])
        if programs:
            raise InputError(f"{self._project.path}/{min(programs)}.pgx: expected a program that start calls")
        for name, data in self._project.data.items():
            if data.kind in {"jointRx", "pointRx"} and self._used.get(name, 0) != data.size:
                raise data.error("motions to all of its values", f"{self._used.get(name, 0)} of {data.size}")
        if not self._stands or not self._moves:
            raise start.end.error("motions and waitEndMove()", "the end")
        return rows_of_moves(self._events, with_shares(self._robot, self._moves, self._zones), self._between)

    def _play(self, node: Node, task: str | None) -> None:
        """Follow one statement."""
        statement = _statement(node)
        if isinstance(node, Loop) or statement.kind == "CALL":
            raise statement.error("motions and signals, one after the other")
        if statement.kind == "STAND":
            self._stands = True
        elif statement.kind in {"MOVE", "LINE", "ARC"}:
            self._moves.append(self._move(statement, task))
            self._between.append([])
            self._stands = False
        else:
            if not self._stands or not self._events.knows(task, statement.text):
                raise statement.error("signals of the process or of a handshake, after waitEndMove()")
            self._between[-1].append(statement.text)

    def _move(self, statement: Statement, task: str | None) -> ReadMove:
        """A motion to the next value of its data."""
        points = {"MOVE": 1, "LINE": 1, "ARC": 2}[statement.kind]
        *names, tool, move = [str(word) for word in statement.words[::2]]
        indices = [int(index or 0) if (index or "0").isdecimal() else -1 for index in statement.words[1::2]]
        descriptors = self._data(move, "mdesc")
        if tool != TOOL or indices[points] != 0 or not 0 <= indices[-1] < descriptors.size:
            raise statement.error(f"{TOOL}[0] and a motion descriptor of {move}")
        descriptor = descriptors.values[indices[-1]]
        is_joint = statement.kind == "MOVE"
        blend, zone = descriptor.get("blend", "off"), max(float(descriptor.get(it, "0")) for it in ("leave", "reach"))
        if blend not in {"off", "joint" if is_joint else "Cartesian"} or (blend != "off") is not (zone > 0.0):
            raise statement.error(f"a blend {'joint' if is_joint else 'Cartesian'} with leave or reach, or off")
        self._zones.append(zone / MM if is_joint else 0.0)
        expected = JOINTS if is_joint else points_name(routine_names_of(self._tasks, task))
        values = [self._value(statement, name, index, expected) for name, index in zip(names, indices, strict=False)]
        usual = EVEN | ({"tmax": NO_LIMIT} if is_joint else {"vel": "100"})
        if any(descriptor.get(key, text) != text for key, text in usual.items()):
            raise statement.error(f"a motion descriptor with {' '.join(f'{it}={text}' for it, text in usual.items())}")
        if is_joint:
            numbers = np.array([[float(values[0].get(f"j{axis}", "0")) for axis in range(1, 7)]])
            q, speed = from_numbers(self._robot, numbers)[0], float(descriptor.get("vel", "100"))
            return ReadMove(refuse=statement.refuse, task=task, q=q, speed=speed)
        if task is None or any(value["fatherId"] != part_of(self._frame, self._robot.name, task) for value in values):
            raise statement.error("points of a task in its frame of the part, in its program")
        return ReadMove(
            refuse=statement.refuse,
            task=task,
            q=np.full(len(self._robot.model.joints), np.nan),
            poses=tuple(_pose(value) for value in values),
            feed=float(descriptor.get("tmax", "0")) / MM,
            zone=zone / MM,
        )

    def _value(self, statement: Statement, name: str, index: int, expected: str) -> Mapping[str, str]:
        """The next value of some data."""
        data = self._project.data.get(name)
        if name != expected or data is None or data.kind != ("jointRx" if name == JOINTS else "pointRx"):
            raise statement.error(f"values of {expected}", name)
        if index != self._used.get(name, 0) or index >= data.size:
            raise statement.error(f"{name}[{self._used.get(name, 0)}]: all values in order")
        self._used[name] = index + 1
        return data.values[index]


def routine_names_of(tasks: Mapping[str, str], task: str | None) -> str:
    """Name of the program of a task; empty for none."""
    return next((routine for routine, of in tasks.items() if of == task), "")


def _pose(value: Mapping[str, str]) -> Array:
    """The pose of a value in [m], shape (4, 4)."""
    return STAUBLI.pose(np.array([float(value.get(label, "0")) for label in STAUBLI.labels]))


def _statement(node: Node) -> Statement:
    """A statement, or that with which a loop begins."""
    return node.head if isinstance(node, Loop) else node
