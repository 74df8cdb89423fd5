"""Strict reader of KRL with seams: what is written, and harmless variants of it, nothing else."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.report.exported import ExportFrame, ProgramRows, RobotRows
from cellplan.model.units import MM
from cellplan.programs.elements.joints import Axes, from_numbers, unit_of
from cellplan.programs.elements.paced import Events, ReadMove, Which, rows_of_moves
from cellplan.programs.elements.pages import read_programs
from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.krl.axes import external_axes, order_of_axes
from cellplan.programs.formats.krl.poses import KrlPose, read_pose
from cellplan.programs.formats.krl.seams import (
    MODES,
    PART,
    base_texts,
    krl_events,
    part_text,
    routine_names,
    tool_frame,
    tool_text,
)
from cellplan.programs.formats.krl.text import NAME, NUMBER, WHOLE, read_components, source_lines

Point = TypeVar("Point")
SAME: Final = 1e-6  # [m] or [-] of a frame whose numbers have five decimals
SETUP: Final = ("BAS(#INITMOV,0)", *MODES)
_TEXTS: Final = {
    "PTP": r"PTP\s+(\w+)(?:\s+(C_PTP))?",
    "LIN": r"LIN\s+(\w+)()(?:\s+(C_DIS))?",
    "CIRC": r"CIRC\s+(\w+)\s*,\s*(\w+)(?:\s+(C_DIS))?",
    "VEL_PTP": rf"BAS\s*\(\s*#VEL_PTP\s*,\s*({NUMBER})\s*\)",
    "VEL_CP": rf"\$VEL\s*\.\s*CP\s*=\s*({NUMBER})",
    "CPTP": r"\$APO\s*\.\s*CPTP\s*=\s*([0-9]+)",
    "CDIS": rf"\$APO\s*\.\s*CDIS\s*=\s*({NUMBER})",
    "ADVANCE": r"\$ADVANCE\s*=\s*([0-5])",
    "TOOL": r"\$TOOL\s*=\s*(.*)",
    "BASE": r"\$BASE\s*=\s*(.*)",
    "TRIGGER": r"TRIGGER\s+(.*)",
    "ACT_EX_AX": r"\$ACT_EX_AX\s*=\s*(.*)",
    "CALL": r"(\w+)\s*\(\s*\)",
}
_PATTERNS: Final = {kind: re.compile(text, re.IGNORECASE) for kind, text in _TEXTS.items()}
_DEF: Final = re.compile(r"DEF\s+(\w+)\s*\(\s*\)", re.IGNORECASE)
_DECL: Final = re.compile(r"DECL\s+(E6AXIS|E6POS|FRAME)\s+([A-Z]\w*)\s*=\s*\{\s*(.*?)\s*\}", re.IGNORECASE)


def read_seams(
    frame: ExportFrame, files: Mapping[str, str], paths: Mapping[tuple[str | None, str], str]
) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: positions, seams with speeds, marks and process.

    ``paths``: path of each module without its ending, by program and robot. An ``InputError`` has file and line.
    """
    return read_programs(frame, files, paths, _rows, ending=".src")


def _rows(frame: ExportFrame, robot: str, left: dict[str, str], path: str) -> tuple[RobotRows, ...]:
    """Rows of a robot, and of those that move in step with it; takes its files out of those that are left."""
    for file in (f"{path}.src", f"{path}.dat"):
        if file not in left:
            raise InputError(f"{file}: expected a file, got none")
    name = path.rpartition("/")[2]
    routines = _routines(source_lines(left.pop(f"{path}.src"), f"{path}.src"), f"{path}.src")
    data = _Data.of(source_lines(left.pop(f"{path}.dat"), f"{path}.dat"), f"{path}.dat", name)
    if next(iter(routines)) != name:
        raise InputError(f"{path}.src: expected DEF {name}() as the first routine, got {next(iter(routines))}")
    tasks = {routine.upper(): task for task, routine in routine_names(frame, robot, name).items()}
    player = _Player(frame=frame, robot=robot, data=data, tasks=tasks, events=krl_events(frame, robot))
    main, end = routines.pop(name)
    for statement in main:
        routine = statement.words[0] if statement.kind == "CALL" else None
        if routine in routines:
            player.enter(statement, str(routine))
            inner, _ = routines.pop(str(routine))
            for it in inner:
                player.play(it)
            player.leave()
        else:
            player.play(statement)
    for other in routines.values():
        raise other[1].error("routines that are called once", "one that is not")
    return player.rows(end)


def _routines(lines: Sequence[Statement], file: str) -> dict[str, tuple[list[Statement], Statement]]:
    """Statements of each routine with its ``END``, by name, the main one first."""
    routines: dict[str, tuple[list[Statement], Statement]] = {}
    name, statements = "", list[Statement]()
    for line in lines:
        head = _DEF.fullmatch(line.text)
        if not name:
            if head is None or head[1] in routines or len(head[1]) > NAME:
                raise line.error(f"DEF and another name of at most {NAME} characters")
            name, statements = head[1], []
        elif line.text.upper() == "END":
            routines[name], name = (statements, line), ""
        else:
            statements.append(_kind(line))
    if name or not routines:
        raise InputError(f"{file}: expected END as the last statement")
    return routines


def _kind(line: Statement) -> Statement:
    """A statement with its kind; what stands between motions has none."""
    for kind, pattern in _PATTERNS.items():
        if match := pattern.fullmatch(line.text):
            return line._replace(kind=kind, words=match.groups())
    return line


@dataclass(frozen=True, slots=True, kw_only=True)
class _Data:
    """Declarations of a data file, by name in small letters."""

    joints: Mapping[str, Sequence[float]]
    poses: Mapping[str, KrlPose]
    lines: Mapping[str, Statement]

    @classmethod
    def of(cls, lines: Sequence[Statement], file: str, name: str) -> "_Data":
        """Those of its lines; an ``InputError`` has file and line."""
        if len(lines) < 2 or lines[0].text != f"DEFDAT {name}" or lines[-1].text.upper() != "ENDDAT":
            raise InputError(f"{file}: expected DEFDAT {name} as the first statement and ENDDAT as the last one")
        joints, poses, declared = dict[str, Sequence[float]](), dict[str, KrlPose](), dict[str, Statement]()
        for line in lines[1:-1]:
            match = _DECL.fullmatch(line.text)
            if match is None or match[2].lower() in declared or len(match[2]) > NAME:
                raise line.error("DECL E6AXIS, E6POS or FRAME with another name and a value in braces")
            declared[match[2].lower()] = line
            if match[1].upper() == "E6AXIS":
                joints[match[2].lower()] = read_components(line, match[3])[0]
            else:
                poses[match[2].lower()] = read_pose(line, match[3], is_frame=match[1].upper() == "FRAME")
        return cls(joints=joints, poses=poses, lines=declared)


@dataclass(slots=True, kw_only=True)
class _Player:
    """Follows a program statement by statement."""

    frame: ExportFrame
    robot: str
    data: _Data
    tasks: Mapping[str, str]  # tasks by the names of their routines in capitals
    events: Events
    task: str | None = None  # of the routine that is followed
    moves: list[ReadMove] = field(default_factory=list)
    between: list[list[str]] = field(default_factory=lambda: [[]])
    used: set[str] = field(default_factory=set)
    settings: dict[str, float] = field(default_factory=dict)  # speeds and zones of the routine that is followed
    setup: list[str] = field(default_factory=list)  # what was set before the first motion
    # what still has to set the frame of the task whose routine is followed; None before the first of it
    bases: list[str] | None = None
    positioners: list[Sequence[float]] = field(default_factory=list)  # their axes at each row
    triggers: list[Statement] = field(default_factory=list)  # of outputs that the next motion switches ahead

    def enter(self, statement: Statement, routine: str) -> None:
        """Begin the routine of a task."""
        if routine.upper() not in self.tasks:
            raise statement.error("the routine of a task of the robot", routine)
        self.task, self.settings, self.bases = self.tasks[routine.upper()], {}, None

    def leave(self) -> None:
        """Go on with the main routine."""
        _triggered(self, None)
        self.task, self.settings = None, {}

    def play(self, statement: Statement) -> None:
        """Follow one statement."""
        if statement.kind in {"PTP", "LIN", "CIRC"}:
            self._require_setup(statement)
            self.moves.append(self._joint_move(statement) if statement.kind == "PTP" else self._tool_move(statement))
            self.between.append([])
        elif statement.kind in {"VEL_PTP", "VEL_CP", "CPTP", "CDIS"}:
            value = float(statement.words[0] or 0)
            if not 0.0 < value <= (np.inf if statement.kind in {"VEL_CP", "CDIS"} else 100.0):
                raise statement.error("a value above 0, of shares up to 100")
            self.settings[statement.kind] = value
        elif statement.kind == "TRIGGER":
            self.triggers.append(statement)
        elif statement.kind in {"BASE", "ACT_EX_AX"} and self.task is not None:
            self._set_base(statement)
        elif _is_setting(statement):
            self._set(statement)
        else:
            self._take(statement)

    def _take(self, statement: Statement) -> None:
        """A statement of a process or of a handshake."""
        if not self.events.knows(self.task, statement.text):
            raise statement.error("a statement that these programs have")
        self.between[-1].append(statement.text)

    def _set(self, statement: Statement) -> None:
        """What is set once, before the first motion."""
        key = re.sub(r"\s+", "", statement.text.upper())
        if self.moves or self.task is not None or key.partition("=")[0] in {it.partition("=")[0] for it in self.setup}:
            raise statement.error("each setting once, before the first motion")
        if statement.kind == "TOOL":
            placed = self.frame.robot(self.robot)
            if key != f"$TOOL={tool_text(placed)}".upper():
                raise statement.error(f"{tool_text(placed)} as the cell states it", key.partition("=")[2])
            self._require_frame(statement, tool_text(placed), tool_frame(placed))
        elif statement.kind == "BASE" and key != "$BASE=$NULLFRAME":
            raise statement.error("$BASE=$NULLFRAME before the first motion")
        self.setup.append(key)

    def _require_setup(self, at: Statement) -> None:
        """Refuse a motion before everything is set that motions need."""
        keys = {key.partition("=")[0] for key in self.setup}
        for key in (*SETUP, "$ADVANCE", "$TOOL", "$BASE"):
            if key not in self.setup and key not in keys:
                raise at.error(f"{key} to be set before the first motion", "none")

    def _set_base(self, statement: Statement) -> None:
        """The frame of the task whose routine is followed."""
        if self.task is None or self.bases == []:
            raise statement.error("the frame of a task once, in its routine")
        if self.bases is None:
            self.bases = base_texts(self.frame, self.robot, self.task)
        expected = self.bases.pop(0)
        if re.sub(r"\s+", "", statement.text.upper()) != expected.upper():
            raise statement.error(f"{expected.removeprefix('$BASE=')} as the cell states it", statement.text)
        if statement.kind == "BASE":
            part = part_text(self.frame, self.robot, self.task)
            self._require_frame(statement, part, self.frame.station(self.robot, self.task).X)

    def _require_frame(self, statement: Statement, expected: str, X: Array | None) -> None:
        """A tool or a part as the cell has it: known by its number, or as the frame that is declared."""
        if expected.endswith("]"):
            return
        name = expected.lower()
        if name not in self.data.poses or self.data.poses[name].status_and_turn is not None:
            raise statement.error("a frame that is declared")
        if X is None or np.abs(self.data.poses[name].X - X).max() > SAME:
            raise self.data.lines[name].error(f"{expected} as the cell has it")
        self.used.add(name)

    def _joint_move(self, statement: Statement) -> ReadMove:
        """A motion of the joints to a point."""
        _triggered(self, None)
        if "VEL_PTP" not in self.settings:
            raise statement.error("a speed of the joints before")
        values = self._point(statement, 0, self.data.joints)
        placed, order = self.frame.robot(self.robot), order_of_axes(self.frame, self.robot)
        count = len(Axes.of(placed).arm) + external_axes(self.frame, self.robot)
        if any(values[count:]) or not np.all(np.isfinite(values)):
            raise statement.error(f"a point with values for the {count} axes of the robot and for no other")
        self.positioners.append(values[len(order) : count])
        written = np.zeros((1, len(order)))
        written[0, order] = values[: len(order)]
        is_rounded = statement.words[1] is not None
        if is_rounded and "CPTP" not in self.settings:
            raise statement.error("$APO.CPTP to be set before C_PTP")
        share = self.settings["CPTP"] / WHOLE if is_rounded else 0.0
        q, speed = from_numbers(placed, written)[0], self.settings["VEL_PTP"]
        return ReadMove(refuse=statement.refuse, task=self.task, q=q, share=share, speed=speed)

    def _tool_move(self, statement: Statement) -> ReadMove:
        """A line or an arc of the tool."""
        if self.bases != [] or self.task is None or "VEL_CP" not in self.settings:
            raise statement.error("lines and arcs in the routine of a task, behind $BASE and $VEL.CP")
        if statement.words[2] is not None and "CDIS" not in self.settings:
            raise statement.error("$APO.CDIS to be set before C_DIS")
        process = _triggered(self, self.task)
        places = (0, 1) if statement.kind == "CIRC" else (0,)
        poses = [self._point(statement, place, self.data.poses) for place in places]
        placed = self.frame.robot(self.robot)
        axes, external = Axes.of(placed), np.array(poses[-1].external)
        first, count = len(axes.external), external_axes(self.frame, self.robot)
        unused = [number for pose in poses for number in pose.external[count:]]
        if any(pose.status_and_turn is None for pose in poses) or any(unused):
            raise statement.error("points that are declared as E6POS, with external axes that the robot has")
        self.positioners += [pose.external[first:count] for pose in poses]
        written = np.zeros((1, len(placed.model.joints)))
        written[0, list(axes.external)] = external[: len(axes.external)]
        q = from_numbers(placed, written)[0]
        q[list(axes.arm)] = np.nan
        return ReadMove(
            refuse=statement.refuse,
            task=self.task,
            q=q,
            poses=tuple(pose.X for pose in poses),
            configurations=tuple(pose.status_and_turn or () for pose in poses),
            feed=self.settings["VEL_CP"],
            zone=self.settings["CDIS"] / MM if statement.words[2] is not None else 0.0,
            process=process,
        )

    def _point(self, statement: Statement, place: int, points: Mapping[str, Point]) -> Point:
        """A declared point, used once."""
        name = str(statement.words[place]).lower()
        if name not in points or name in self.used:
            raise statement.error("a point that is declared for such a motion and used once", name.upper())
        self.used.add(name)
        return points[name]

    def rows(self, end: Statement) -> tuple[RobotRows, ...]:
        """All rows, once everything was followed."""
        for name, line in self.data.lines.items():
            if name not in self.used and not name.startswith(PART.lower()):
                raise line.error("points that are used", name.upper())
        _triggered(self, None)
        if not self.moves:
            raise end.error("at least one motion", "none")
        arm = rows_of_moves(self.events, self.moves, self.between)
        written, robots, first = np.array(self.positioners), [arm], 0
        for name in unit_of(self.frame.cell, self.robot)[1:]:
            order = order_of_axes(self.frame, name)
            numbers = np.zeros((len(written), len(order)))
            numbers[:, order] = written[:, first : first + len(order)]
            q = from_numbers(self.frame.robot(name), numbers)
            robots.append(RobotRows(robot=name, q=q, rounding=arm.rounding, marks=arm.marks))
            first += len(order)
        return tuple(robots)


def _triggered(player: _Player, task: str | None) -> Which | None:
    """Which end of the process of a task the outputs say that the next motion switches ahead."""
    triggers, player.triggers = player.triggers, []
    return player.events.triggered(task, [one.text for one in triggers], triggers[0].refuse) if triggers else None


def _is_setting(statement: Statement) -> bool:
    """Whether a statement sets what is set once."""
    return statement.kind in {"TOOL", "BASE", "ADVANCE"} or re.sub(r"\s+", "", statement.text.upper()) in SETUP
