"""VAL3 with seams: movel and movec at a stated speed to points in a frame of the part, a program for each seam.

The points of the program ``NAME`` are the array ``pNAME``, so that they can be touched up. They state no configuration:
the seam is entered by joints, and goes on as it is entered.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import floor
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame
from cellplan.model.units import MM
from cellplan.programs.elements.conventions import CONVENTIONS
from cellplan.programs.elements.frames import on_flange, require_rest
from cellplan.programs.elements.handshake import HandshakeStep, handshake_steps
from cellplan.programs.elements.joints import from_numbers
from cellplan.programs.elements.paced import Events, Move, blocks
from cellplan.programs.elements.pages import PagedProgram
from cellplan.programs.elements.text import fixed, safe_names
from cellplan.programs.formats.val3.names import (
    BASE,
    DATA,
    FLANGE,
    JOINTS,
    MOVE,
    NAME,
    PART,
    START,
    STOP,
    TOOL,
    WORDS,
    WORLD,
    link,
    signal_names,
)
from cellplan.programs.formats.val3.project_text import array_lines
from cellplan.programs.formats.zones import shares_off_seams, tool_zones

NO_LIMIT: Final = "99999"  # [mm/s] and [deg/s] of the tool: the axes are what limits
EVEN: Final = {"accel": "100", "decel": "100", "rmax": NO_LIMIT}  # of every motion descriptor
SPEED_DECIMALS: Final = 3  # of a millimetre in a second
ZONE_DECIMALS: Final = 3  # of a millimetre
SMALLEST_ZONE: Final = 0.05  # [mm] a smaller zone of joints is a stop; on a seam a stop would end the process
STAND: Final = "waitEndMove()"  # before signals, which would be set while the robot moves
CALL: Final = re.compile(r"call (?P<library>[A-Za-z]\w{0,14}):[A-Za-z]\w{0,14}\([-0-9., ]*\)", re.ASCII)
STAUBLI: Final = CONVENTIONS["staubli"]


def val3_events(frame: ExportFrame, robot: str) -> Events:
    """What stands between the moves of a robot, behind a stop."""
    names = signal_names(handshake_steps(frame, robot))
    return Events(
        frame=frame,
        robot=robot,
        signal=partial(signal_text, names=names),
        wait=lambda seconds: f"delay({fixed(seconds, 3)})",
        plain=lambda text: "".join(text.replace("[0]", "").split()),
    )


def signal_text(step: HandshakeStep, names: Mapping[tuple[bool, str], str]) -> str:
    """One step of a handshake."""
    name, state = names[step.waits, step.signal], "true" if step.is_on else "false"
    return f"wait({name}=={state})" if step.waits else f"{name}={state}"


def signal_data(frame: ExportFrame, robot: str) -> dict[str, str]:
    """Links of all signals of a robot by the names of their data: those of its process, and of its handshake."""
    events = val3_events(frame, robot)
    names = [line.partition("=")[0].strip() for line in process_lines(events) if "=" in line]
    steps = signal_names(handshake_steps(frame, robot))
    return {name: name for name in names} | {
        name: link(signal, is_input=is_input) for (is_input, signal), name in steps.items()
    }


def process_lines(events: Events) -> Iterator[str]:
    """Statements of the process of all tasks of a robot."""
    for task in events.frame.cell.tasks if events.form else ():
        if task.robot == events.robot and events.form:
            yield from (*events.form.lines(True, task.name), *events.form.lines(False, task.name))


def libraries(frame: ExportFrame, robot: str) -> list[str]:
    """Libraries whose routines begin and end the process of a robot, in the order of their names."""
    calls = (CALL.match(line) for line in process_lines(val3_events(frame, robot)))
    return sorted({call["library"] for call in calls if call})


def require_seams(frame: ExportFrame, robot: str) -> None:
    """Refuse a part that moves while a tool works, and routines and data that no project has."""
    for station in frame.stations.get(robot, ()):
        require_rest(robot, station)
    control = frame.robot(robot).control
    for line in process_lines(val3_events(frame, robot)):
        if control is not None and "=" not in line and not CALL.fullmatch(line):
            raise InputError(
                f"controllers.{control.id}.process: expected outputs (doName=true) or routines of libraries, with "
                f"numbers (call arc:on(1)), for val3, as its project has no others, got {line}"
            )


def routine_names(frame: ExportFrame, robot: str, project: str) -> dict[str, str]:
    """Name of the program of each task of a robot in a project; that of its points has a letter more."""
    tasks = [task.name for task in frame.cell.tasks if task.robot == robot]
    reserved = {*WORDS, START, STOP, project, *(name for name in DATA.split("|")), *signal_data(frame, robot)}
    reserved |= {*libraries(frame, robot)}
    return safe_names(tasks, longest=NAME - 2, reserved=reserved)


def points_name(routine: str) -> str:
    """Name of the data of the points of a routine."""
    return f"p_{routine}"


def pose_values(X: Array, father: str, decimals: int) -> dict[str, str]:
    """A pose in [m], shape (4, 4), as the attributes of a value."""
    named = zip(STAUBLI.labels, STAUBLI.numbers(X).tolist(), strict=True)
    return {**{item: fixed(value, decimals) for item, value in named}, "fatherId": father}


def tool_values(robot: Robot, decimals: int) -> dict[str, str]:
    """The tool of the cell on the flange of the controller."""
    return pose_values(on_flange(robot, robot.tool.X_FT), FLANGE, decimals)


def part_values(frame: ExportFrame, robot: str, decimals: int) -> list[dict[str, str]]:
    """The frames of the part, one for each station of a robot."""
    stations = frame.stations.get(robot, ())
    return [pose_values(np.eye(4) if one.X is None else one.X, BASE, decimals) for one in stations]


def part_of(frame: ExportFrame, robot: str, task: str) -> str:
    """The frame in which a robot works on a task."""
    return f"{PART}[{frame.stations[robot].index(frame.station(robot, task))}]"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SeamWriter:
    """The programs and data of a robot with seams."""

    frame: ExportFrame
    project: PagedProgram
    moves: Sequence[Move]
    names: Mapping[str, str]  # of the program of each task
    descriptors: dict[tuple[tuple[str, str], ...], int] = field(default_factory=dict)  # place of each by its values

    def programs(self) -> dict[str, list[str]]:
        """Code of ``start`` and of the program of each seam."""
        events = val3_events(self.frame, self.project.placed.name)
        start = list(events.before(bool(self.project.rows.marks)))
        programs = {START: start}
        for seam, moves in blocks(self.moves):
            code = list(self._code(events, None if seam is None else seam.task, moves))
            if seam is None:
                start += code
            else:
                programs[self.names[seam.task]] = code
                start.append(f"call {self.names[seam.task]}()")
        start.append(STAND)
        return programs

    def arrays(self) -> Iterator[str]:
        """Lines of all data, once the programs are made."""
        project, robot = self.project, self.project.placed.name
        decimals, rows = project.decimals, project.rows
        yield from array_lines(WORLD, "frame", [{"fatherId": BASE}])
        if parts := part_values(self.frame, robot, decimals):
            yield from array_lines(PART, "frame", parts)
        for name, target in signal_data(self.frame, robot).items():
            yield from array_lines(name, "dio", [{"link": target}])
        joints = project.numbers[~rows.on_seam].tolist()
        values = [{f"j{axis}": fixed(value, decimals) for axis, value in enumerate(row, start=1)} for row in joints]
        yield from array_lines(JOINTS, "jointRx", values)
        for seam in rows.seams if rows.X_PT is not None else ():
            father = part_of(self.frame, robot, seam.task)
            poses = rows.X_PT[seam.first + 1 : seam.last + 1]  # type: ignore[index]
            values = [pose_values(X, father, decimals) for X in poses]
            yield from array_lines(points_name(self.names[seam.task]), "pointRx", values)
        yield from array_lines(MOVE, "mdesc", [dict(values) for values in self.descriptors])
        yield from array_lines(TOOL, "tool", [tool_values(project.placed, decimals)])

    def _code(self, events: Events, task: str | None, moves: Sequence[Move]) -> Iterator[str]:
        """The moves of a program, and what stands after each."""
        rows, robot = self.project.rows, self.project.placed
        q = from_numbers(robot, self.project.numbers)
        zones = MM * tool_zones(robot, q, shares_off_seams(self.moves, rows))
        place = np.cumsum(~rows.on_seam) - 1
        for move in moves:
            if move.is_tool and move.seam is not None and task is not None:
                points = points_name(self.names[task])
                through = [] if move.middle is None else [move.middle]
                targets = ",".join(f"{points}[{row - move.seam.first - 1}]" for row in (*through, move.row))
                speed = {"vel": "100", "tmax": fixed(MM * move.feed, SPEED_DECIMALS)}
                motion = f"{'movec' if through else 'movel'}({targets}"
                descriptor = self._descriptor(speed, MM * move.zone, "Cartesian")
            else:
                motion = f"movej({JOINTS}[{place[move.row]}]"
                speed = {"vel": str(self.project.speeds[move.row]), "tmax": NO_LIMIT}
                descriptor = self._descriptor(speed, float(zones[move.row]), "joint")
            yield f"{motion},{TOOL}[0],{MOVE}[{descriptor}])"
            if texts := events.texts(task, move.switches):
                yield from (STAND, *texts)

    def _descriptor(self, speed: Mapping[str, str], zone: float, blend: str) -> int:
        """Place of a motion descriptor with a speed, and a zone in [mm]."""
        size = floor(zone * 10**ZONE_DECIMALS) / 10**ZONE_DECIMALS
        is_rounded = size >= SMALLEST_ZONE or (blend == "Cartesian" and size > 0.0)
        text = fixed(size, ZONE_DECIMALS) if is_rounded else "0"
        values = {"accel": EVEN["accel"], **speed, **EVEN}
        values |= {"blend": blend if is_rounded else "off", "leave": text, "reach": text}
        return self.descriptors.setdefault(tuple(values.items()), len(self.descriptors))
