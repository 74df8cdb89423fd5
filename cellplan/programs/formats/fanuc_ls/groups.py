"""Motion groups of FANUC controllers: which robot is which one, in which program, with which axes and frames."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError, LineRefusedError
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Moves, Promise
from cellplan.model.task.task import Frame
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.handshake import require_signals_like
from cellplan.programs.elements.joints import Axes, require_counted
from cellplan.programs.elements.pages import ProgramNames, page_names, robots_of
from cellplan.programs.formats.fanuc_ls.poses import configuration

KIND: Final = "fanuc"
EXTERNAL: Final = 3  # extended axes E1 to E3 of a group
TOOLS: Final = (1, 10)  # first and last number of a tool frame; 0 is none
FRAMES: Final = (0, 9)  # of a user frame; 0 is the world of the group
NAMES: Final = ProgramNames(36, frozenset({"AUX", "CON", "NUL", "PRN"}), r"(?:COM|LPT)[0-9]")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MotionGroup:
    """A robot as a group of its controller."""

    robot: Robot
    number: int  # of the group, from 1
    tool: int  # number of its tool frame
    base: int  # number of its user frame

    @property
    def order(self) -> tuple[int, ...]:
        """Places of its joints in the order in which their axes are written: those of the arm first."""
        axes = Axes.of(self.robot)
        return (*axes.arm, *axes.external)

    @property
    def axes(self) -> dict[str, str]:
        """Units of its axes by name, in this order: J1 to J6 of an arm, then E1 and on; J1 and on of a positioner."""
        axes, joints = Axes.of(self.robot), self.robot.model.joints
        count = len(axes.arm) or len(joints)
        names = [f"J{place + 1}" if place < count else f"E{place + 1 - count}" for place in range(len(joints))]
        return {name: joints[place].display_unit.name for name, place in zip(names, self.order, strict=True)}

    @property
    def pose_axes(self) -> dict[str, str]:
        """The same of a pose of its tool: place and turns, then E1 and on."""
        external = {name: unit for name, unit in self.axes.items() if name.startswith("E")}
        return {**dict.fromkeys("XYZ", "mm"), **dict.fromkeys("WPR", "deg"), **external}


class TpProgram(NamedTuple):
    """A program of a controller."""

    program: str | None  # which of the programs that are exported
    name: str  # its name, that of its file without the ending
    groups: tuple[MotionGroup, ...]  # that it moves, by rising number
    seams: Mapping[str, str]  # names of the programs of its seams, by task


def tp_programs(frame: ExportFrame, dialect: Dialect) -> list[TpProgram]:
    """All programs: one for each robot, or one that moves all robots of a controller in step.

    ``InputError`` without such a robot, or where robots in step are not at least two on one controller.
    """
    groups = {name: motion_group(frame, name) for name in robots_of(frame, dialect)}
    units: dict[str, tuple[MotionGroup, ...]] = {name: (group,) for name, group in groups.items()}
    if frame.promise is Promise.SYNCHRONISED:
        controllers = dict.fromkeys(control.id for name in groups if (control := frame.robot(name).control))
        if len(controllers) > 1 or len(groups) < 2:
            raise InputError(
                f"{dialect.name}: expected at least two robots on one controller for synchronised programs, got "
                f"{len(groups)} on {len(controllers)}"
            )
        units = {next(iter(controllers)): tuple(sorted(groups.values(), key=lambda group: group.number))}
    labels = {
        (program, unit): unit if len(frame.programs) == 1 else f"{unit}\0{program or ''}"  # no name holds it
        for program in frame.programs
        for unit in units
    }
    seams = {
        (label, task): f"{label}\0\0{task}"
        for (_, unit), label in labels.items()
        for group in units[unit]
        for station in frame.stations.get(group.robot.name, ())
        for task in station.tasks
    }
    names = {label: name.upper() for label, name in page_names([*labels.values(), *seams.values()], NAMES).items()}
    return [
        TpProgram(
            program, names[label], units[unit], {task: names[word] for (of, task), word in seams.items() if of == label}
        )
        for (program, unit), label in labels.items()
    ]


def seam_name(program: TpProgram, task: str, number: int) -> str:
    """Name of the program of a seam, which is passed for the first or a further time; no other one ends like that."""
    return program.seams[task] if number == 1 else f"{program.seams[task]}_{number:03d}"


def motion_group(frame: ExportFrame, name: str) -> MotionGroup:
    """The group of a robot, 1 for the only robot of a controller; ``InputError`` where it states none of several."""
    control, number, tool, base = frame.robot(name).control, 1, TOOLS[0], FRAMES[0]
    if control is not None:
        entries = [robot.control for robot in frame.cell.robots if robot.control is not None]
        count = sum(entry.id == control.id for entry in entries)
        if control.group is None and count > 1:
            raise InputError(
                f"robots.{name}.controller.group: expected the number of its motion group, as '{control.id}' moves "
                f"{count} robots, got none"
            )
        number = control.group or number
        tool = tool if control.tool_number is None else control.tool_number
        base = base if control.base_number is None else control.base_number
    return MotionGroup(robot=frame.robot(name), number=number, tool=tool, base=base)


def demands(frame: ExportFrame, _rows: Callable[[], int] = int) -> Iterator[Callable[[], object]]:
    """What these programs need of the cell, of robots on controllers of the kind and of those without a controller."""
    for name in frame.robots:
        robot = frame.robot(name)
        if robot.control is not None:
            if frame.cell.controllers[robot.control.id].kind != KIND:
                continue
            yield partial(require_counted, robot, KIND)
        yield partial(_require_frames, frame, name)
        yield partial(_require_signals, frame, name)
        yield partial(_require_axes, robot)
        has_task = any(task.robot == name for task in frame.cell.tasks)
        if frame.promise is Promise.PACED and has_task:
            yield partial(_require_stations, frame, name)
            yield partial(_require_tool, frame, name)
            yield partial(configuration, robot, np.zeros((1, len(robot.model.joints))))
        elif frame.promise is Promise.SYNCHRONISED and frame.moves is not Moves.JOINTS and has_task:
            yield partial(_require_tool, frame, name)


def _require_stations(frame: ExportFrame, robot: str) -> None:
    """Refuse linear moves on a part that another group holds."""
    control = frame.robot(robot).control
    for station in frame.stations.get(robot, ()):
        if station.holder is not None and control is not None:
            raise InputError(
                f"--moves linear: expected a part that no group of '{control.id}' holds, got '{station.holder}': "
                "fanuc_ls moves tools by joints there"
            )


def _require_tool(frame: ExportFrame, robot: str) -> None:
    """Refuse lines and arcs of a tool whose frame has no number."""
    control = frame.robot(robot).control
    if control is None or control.tool_number is None:
        key = f"robots.{robot}.controller.tool_number"
        raise InputError(f"{key}: expected the number of its tool frame, which moves on lines, got none")


def require_leader(frame: ExportFrame, groups: Sequence[MotionGroup], task: str) -> int:
    """Number of the group that holds the part of a task beside the arm; ``LineRefusedError`` for other groups."""
    holder = next((grasp.robot for grasp in frame.cell.part.held_by), None)
    others = [group for group in groups if group.robot.name != frame.cell.task(task).robot]
    is_on_part = frame.cell.task(task).relative_to is Frame.PART
    if not is_on_part or [group.robot.name for group in others] != [holder]:
        names = ", ".join(group.robot.name for group in others)
        raise LineRefusedError(
            task,
            f": COORD leads the tool in the frame of one group, expected the holder of the part beside the arm, got "
            f"{names}; write joints (--moves joints)",
        )
    return others[0].number


def _require_axes(robot: Robot) -> None:
    """Refuse more axes before an arm than a group has."""
    count = len(Axes.of(robot).external)
    if Axes.of(robot).arm and count > EXTERNAL:
        raise InputError(f"robots.{robot.name}: expected at most {EXTERNAL} axes before an arm, got {count}")


def _require_frames(frame: ExportFrame, robot: str) -> None:
    """Refuse a robot without its group, and numbers of frames that no controller has."""
    group, key = motion_group(frame, robot), f"robots.{robot}.controller"
    for word, number, (first, last) in (("tool_number", group.tool, TOOLS), ("base_number", group.base, FRAMES)):
        if not first <= number <= last:
            raise InputError(f"{key}.{word}: expected a number from {first} to {last}, got {number}")


def _require_signals(frame: ExportFrame, robot: str) -> None:
    """Refuse signals that are no numbers."""
    expected = "a whole number from 1, as FANUC controllers number their signals"
    require_signals_like(frame, robot, re.compile(r"[1-9][0-9]{0,4}").fullmatch, expected)
