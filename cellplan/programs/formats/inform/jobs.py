"""Jobs of a controller: which robot has which, in which frame, with which tool, and what they need of the cell."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Moves, Promise, Station
from cellplan.model.task.task import CirclePath, Task
from cellplan.model.units import MM
from cellplan.programs.elements.frames import controller_base, require_rest
from cellplan.programs.elements.handshake import HandshakeStep, require_signals_like
from cellplan.programs.elements.joints import Axes
from cellplan.programs.elements.paced import Events
from cellplan.programs.elements.process import ProcessForm
from cellplan.programs.elements.text import fixed, safe_names
from cellplan.programs.formats.inform.positions import configuration

KIND: Final = "yaskawa"
LONGEST_NAME: Final = 32
TOOLS: Final = (0, 63)  # first and last number of a tool; old controllers have 0 to 23
FRAMES: Final = (1, 63)  # of a user frame, likewise
SHORTEST_WAIT: Final = 0.01  # [s]
FASTEST: Final = 1500.0  # [mm/s] of a line or an arc
SPEED_DECIMALS: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JobFrame:
    """The frame in which the positions of a job are stated, with its tool and its group.

    Attributes:
        number: Number of the user frame; None for the robot's own.
        tool: Number of the tool.
        group: Number of the group.
        X_WC: The frame in the world in [m], shape (4, 4).
    """

    number: int | None
    tool: int
    group: int
    X_WC: Array

    @classmethod
    def of(cls, robot: Robot, station: Station | None) -> "JobFrame":
        """That of a station, or of the base of the controller."""
        control, X_WC = robot.control, controller_base(robot)
        if station is not None and station.X is not None:
            X_WC = X_WC @ station.X
        return cls(
            number=None if station is None else station.number,
            tool=(control.tool_number if control else None) or 0,
            group=(control.group if control else None) or 1,
            X_WC=X_WC,
        )

    @property
    def name(self) -> str:
        """How a job names it."""
        return "ROBOT" if self.number is None else f"USER {self.number}"


def job_names(frame: ExportFrame) -> tuple[dict[tuple[str | None, str], str], dict[str, str]]:
    """Names of the main jobs by program and robot, and of the jobs of seams by task."""
    mains = {
        (program, robot): f"{robot}\0" if len(frame.programs) == 1 else f"{robot}\0{program or ''}"  # no name holds it
        for program in frame.programs
        for robot in frame.robots
    }
    tasks = [task.name for task in frame.cell.tasks if task.robot in frame.robots]
    forms = (ProcessForm.of(controller) for controller in frame.cell.controllers.values())
    reserved = {name for form in forms if form for name in form.routines}
    names = safe_names([*mains.values(), *tasks], longest=LONGEST_NAME, reserved=reserved)
    return {key: names[label].upper() for key, label in mains.items()}, {task: names[task].upper() for task in tasks}


def level_radii(frame: ExportFrame, robot: str) -> Array:
    """Distances from a point in [m] within which lines and arcs with PL=1, 2 and so on are rounded; none if unknown."""
    control = frame.robot(robot).control
    return np.array([] if control is None else frame.cell.controllers[control.id].position_levels_mm, dtype=float) / MM


def inform_events(frame: ExportFrame, robot: str) -> Events:
    """What stands between the moves of a robot."""
    cure = "allow more (tolerance)" if len(level_radii(frame, robot)) else "state position_levels_mm of its controller"
    return Events(
        cure=cure,
        frame=frame,
        robot=robot,
        signal=signal_text,
        wait=lambda seconds: f"TIMER T={fixed(max(seconds, SHORTEST_WAIT), 2)}",
        plain=lambda text: " ".join(text.upper().split()),
    )


def signal_text(step: HandshakeStep) -> str:
    """One instruction of a handshake."""
    state = "ON" if step.is_on else "OFF"
    return f"WAIT IN#({step.signal})={state}" if step.waits else f"DOUT OT#({step.signal}) {state}"


def speed_text(feed: float, task: str) -> str:
    """A speed in [mm/s] with one decimal, of one in [m/s]; ``InputError`` where it has none."""
    text = fixed(MM * feed, SPEED_DECIMALS)
    if abs(float(text) - MM * feed) > 1e-6 or not 0.0 < float(text) <= FASTEST:
        raise InputError(
            f"tasks.{task}.process.feed_mm_s: expected whole tenths of a millimetre per second up to {FASTEST:g}, as "
            f"V= states them, got {MM * feed:.6g}"
        )
    return text


def demands(frame: ExportFrame, _rows: Callable[[], int] = int) -> Iterator[Callable[[], object]]:
    """What these jobs need of the cell, of robots on controllers of the kind and of those without a controller."""
    for name in frame.robots:
        robot = frame.robot(name)
        if robot.control is not None and frame.cell.controllers[robot.control.id].kind != KIND:
            continue
        yield partial(_require_arm, robot)
        yield partial(_require_numbers, robot)
        yield partial(_require_signals, frame, name)
        if frame.promise is Promise.PACED:
            yield partial(_require_frames, frame, robot)
            for task in frame.cell.tasks:
                if task.robot == name and task.feed is not None:
                    yield partial(speed_text, task.feed, task.name)
                if task.robot == name and task.process is not None and frame.moves is not Moves.AUTO:
                    yield partial(_require_levels, frame, robot, task)


def _require_arm(robot: Robot) -> None:
    """Refuse all but an arm of six axes with a spherical wrist."""
    axes, count = Axes.of(robot), len(robot.model.joints)
    if not axes.arm or axes.external:
        raise InputError(
            f"robots.{robot.name}: expected an arm of six axes and no other, got {count} axes: INFORM states those of "
            "bases and stations in pulses, of which no model knows the size"
        )
    configuration(robot, np.zeros((1, count)))


def _require_numbers(robot: Robot) -> None:
    """Refuse a robot without the number of its tool, as positions are those of the tool."""
    number = None if robot.control is None else robot.control.tool_number
    _require_within(f"robots.{robot.name}.controller.tool_number", number, TOOLS, "its tool")


def _require_frames(frame: ExportFrame, robot: Robot) -> None:
    """Refuse numbers that no user frame has, and frames that another robot moves."""
    control = robot.control
    stated = [] if control is None else [*control.frames, *([control.base_number] if control.base_number else [])]
    for number in stated:
        _require_within(f"robots.{robot.name}.controller.frames", number, FRAMES, "each user frame")
    for station in frame.stations.get(robot.name, ()):
        require_rest(robot.name, station)


def _require_levels(frame: ExportFrame, robot: Robot, task: Task) -> None:
    """Refuse a closed path in process, of which no single line or arc is made, where no corner can be rounded."""
    is_closed = isinstance(task.path, CirclePath) or task.path.is_closed
    has_process = inform_events(frame, robot.name).form is not None
    if robot.control is not None and is_closed and has_process and not len(level_radii(frame, robot.name)):
        raise InputError(
            f"controllers.{robot.control.id}.position_levels_mm: expected the distances of PL=1, PL=2 and so on as "
            f"set on the controller, within which the closed path of '{task.name}' is rounded in process, got none"
        )


def _require_within(key: str, number: int | None, bounds: tuple[int, int], what: str) -> None:
    """Refuse a number that is not stated, or that no controller has."""
    first, last = bounds
    if number is None or not first <= number <= last:
        got = "none" if number is None else number
        raise InputError(f"{key}: expected the number of {what} on the controller, {first} to {last}, got {got}")


def _require_signals(frame: ExportFrame, robot: str) -> None:
    """Refuse signals that are no numbers."""
    require_signals_like(
        frame, robot, re.compile(r"[1-9][0-9]{0,3}").fullmatch, "a whole number from 1, as in OT#(1) and IN#(1)"
    )


def tasks_of(frame: ExportFrame, robot: str) -> Mapping[str, str]:
    """Tasks of a robot by the names of their jobs."""
    _, names = job_names(frame)
    return {names[task.name]: task.name for task in frame.cell.tasks if task.robot == robot}
