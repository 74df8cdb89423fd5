"""RAPID programs of a cell: which task plays which robot, under which names, and where the part is held."""

import re
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, Promise
from cellplan.model.settings.controllers import RobotControlEntry
from cellplan.model.task.task import Frame
from cellplan.programs.elements.frames import on_flange
from cellplan.programs.elements.handshake import MEETINGS, task_group
from cellplan.programs.elements.joints import Axes, on_one_controller
from cellplan.programs.elements.text import safe_names
from cellplan.programs.elements.timed_rows import decimals_of

DECIMALS: Final = 4  # of a degree or millimetre
TIME_DECIMALS: Final = 6  # of a second
LONGEST_NAME: Final = 32
LONGEST_MODULE: Final = 24  # room for `t_` before it and for the number of a page behind it
EXTERNAL_AXES: Final = 6
ABSENT: Final = "9E9"  # an axis that a mechanical unit does not have
TASKS, SYNC_ON, SYNC_OFF, PART, FROM, ROWS = "cell_tasks", "sync_on", "sync_off", "part", "v_start", "v_rows"
ZONES: Final = tuple(round(10.0 ** (1.0 + place / 10.0)) for place in range(44))  # [um] or [mdeg], 0.01 to 200
_WORDS: Final = (
    "alias and backward bool case connect const default div do dnum else elseif endfor endfunc endif endmodule endproc "
    "endrecord endtest endtrap endwhile error exit false fine for from func goto if inout jointtarget local main mod "
    "module nostepin not noview num or pers proc raise readonly record retry return robtarget speeddata step string "
    "sysmodule task tasks test then to tooldata tool0 trap true trynext undo var viewonly while with wobj0 wobjdata "
    "xor zonedata syncident load0 setdo waitdi moveabsj moveextj movel movej movec syncmoveon syncmoveoff triggdata "
    "triggio triggl triggc waitsynctask"
)


def zone_name(size: int) -> str:
    """Name of a zone of some micrometres or thousandths of a degree."""
    return f"z_{size}"


WORDS: Final = frozenset(_WORDS.split())  # of the language, and of what its controllers declare
RESERVED: Final = WORDS.union(  # and names of declarations and pages here, and of speeds and zones of the language
    {TASKS, SYNC_ON, SYNC_OFF, *MEETINGS, PART, FROM, ROWS, *map(zone_name, ZONES)}
    | {f"page_{number:03d}" for number in range(1, 1000)}
    | {f"{letter}{number}" for letter in "vz" for number in range(10_000)}
)
NAME: Final = re.compile(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_NAME - 1}}}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RapidUnit:
    """A robot as RAPID programs it."""

    robot: Robot
    task: str | None  # name of its task on the controller; None where no other task runs with it
    module: str  # name of its module, and of its files
    tool: str  # name of its tool data; those of all robots differ, as persistent data are shared between tasks
    axes: Axes  # which joints belong to the arm, and which are external axes
    decimals: int  # of a degree or millimetre

    @property
    def X_GT(self) -> Array:
        """Its tool tip in the flange of the controller, shape (4, 4)."""
        return on_flange(self.robot, self.robot.tool.X_FT)

    @property
    def has_tool(self) -> bool:
        """Whether it has a tool centre point; a positioner has external axes only."""
        return bool(self.axes.arm)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PartFrame:
    """The work object of a part that a robot carries."""

    unit: str  # the mechanical unit that moves it
    X_GP: Array  # the part in the flange of that unit as the controller has it, shape (4, 4)


def rapid_units(frame: ExportFrame) -> tuple[RapidUnit, ...]:
    """Robots of an export in the order of the cell; controllers and tasks must be such as the promise needs."""
    modules = safe_names(frame.robots, longest=LONGEST_MODULE, reserved=RESERVED)
    is_synchronised = frame.promise is Promise.SYNCHRONISED
    if is_synchronised:
        require_one_controller(frame)
    units = tuple(
        _unit(frame, name, task=rapid_task(frame, name) if is_synchronised else None, module=modules[name])
        for name in frame.robots
    )
    tasks = [(unit.task or "").lower() for unit in units]
    for place, unit in enumerate(units):
        if is_synchronised and tasks[place] in tasks[:place]:
            first = units[tasks.index(tasks[place])].robot.name
            raise InputError(
                f"robots.{unit.robot.name}.controller.task: expected a task of its own, got {unit.task}, the task of "
                f"'{first}'"
            )
    return units


def works_on_part(frame: ExportFrame, robot: str) -> bool:
    """Whether a robot may have targets on the part: it has an arm and a task there, and does not hold it."""
    cell = frame.cell
    tasks = [task for task in cell.tasks if task.robot == robot and task.relative_to is Frame.PART]
    return (
        frame.has_part_targets
        and bool(tasks)
        and robot not in cell.positioners
        and bool(Axes.of(frame.robot(robot)).arm)
    )


def part_frame(frame: ExportFrame) -> PartFrame | None:
    """The work object of targets on the part; None in an export of joint targets.

    The holder's flange carries the part without moving in it, so its work object states no user frame, and the part in
    its flange as object frame: ``X_GP = inv(X_FG) X_FT X_TP`` of the holder.

    ``InputError`` where no robot of the export carries the part.
    """
    if not frame.has_part_targets:
        return None
    if not frame.cell.part.held_by:
        raise InputError("--moves linear: expected a part that a robot holds, got one that is fixed in the world")
    holder = frame.cell.part.held_by[0].robot
    if holder not in frame.robots:
        raise InputError(f"--moves linear: expected '{holder}', which holds the part, among the exported robots")
    task, placed = rapid_task(frame, holder), frame.robot(holder)
    unit = frame.cell.controllers[_control(frame, holder).id].tasks[task]
    return PartFrame(unit=unit, X_GP=on_flange(placed, placed.tool.X_FT @ frame.cell.part.X_CP))


def _unit(frame: ExportFrame, name: str, *, task: str | None, module: str) -> RapidUnit:
    """One robot."""
    _control(frame, name)
    robot = frame.robot(name)
    axes = Axes.of(robot)
    if len(axes.external) > EXTERNAL_AXES:
        raise InputError(
            f"robots.{name}: expected at most {EXTERNAL_AXES} axes beside an arm, got {len(axes.external)}"
        )
    return RapidUnit(
        robot=robot, task=task, module=module, tool=f"t_{module}", axes=axes, decimals=decimals_of(robot, DECIMALS)
    )


def _control(frame: ExportFrame, name: str) -> RobotControlEntry:
    """Where a robot is connected: to a controller that plays these programs."""
    control = frame.robot(name).control
    controllers = frame.cell.controllers
    if control is None or control.id not in controllers:
        raise InputError(f"robots.{name}.controller: expected the controller that plays rapid, got none")
    kind = controllers[control.id].kind
    if kind != "abb":
        raise InputError(f"robots.{name}.controller: expected a controller of kind abb for rapid, got {kind}")
    return control


def rapid_task(frame: ExportFrame, name: str) -> str:
    """Name of the task that moves a robot."""
    control = _control(frame, name)
    task, tasks = control.task, frame.cell.controllers[control.id].tasks
    if task is None or task not in tasks:
        got, known = "none" if task is None else task, ", ".join(tasks) or "none"
        raise InputError(
            f"robots.{name}.controller.task: expected one of the tasks of controller '{control.id}' ({known}), "
            f"got {got}"
        )
    unit = f"controllers.{control.id}.tasks.{task}"
    for key, value in ((f"robots.{name}.controller.task", task), (unit, tasks[task])):
        if not NAME.fullmatch(value):
            raise InputError(f"{key}: expected a name of at most {LONGEST_NAME} letters, digits and _, got {value!r}")
    return task


def listed_tasks(frame: ExportFrame, name: str) -> list[str]:
    """Tasks in the list of the program of a robot: those that move in step, or wait for one another without wires."""
    robots = frame.robots if frame.promise is Promise.SYNCHRONISED else task_group(frame, name)
    return [rapid_task(frame, robot) for robot in robots]


def require_one_controller(frame: ExportFrame) -> None:
    """Refuse synchronised programs of robots that no single controller moves."""
    names = dict.fromkeys(_control(frame, name).id for name in frame.robots)
    if len(names) > 1 or len(frame.robots) < 2:
        got = f"controllers {', '.join(names)}" if len(names) > 1 else f"{len(frame.robots)}"
        raise InputError(f"rapid: expected at least two robots on one controller for synchronised programs, got {got}")


def storage(frame: ExportFrame, robot: str) -> str:
    """How work objects of a robot are stored: for its task alone where other tasks of the controller have some too."""
    others = {task.robot for task in frame.cell.tasks} - {robot}
    is_shared = any(on_one_controller(frame.robot(robot), frame.robot(other)) for other in others)
    return "TASK PERS" if is_shared else "PERS"
