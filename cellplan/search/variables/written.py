"""Numbers of a layout as they are written in a cell file: in its units, with the digits that are worth writing."""

from collections.abc import Container
from typing import Any, Final

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange
from cellplan.model.robot.robot import Joint
from cellplan.model.task.task import Task
from cellplan.model.units import DEG, MM

LENGTH_DIGITS: Final = 3  # of a millimetre
ANGLE_DIGITS: Final = 6  # of a degree
WEIGHT_DIGITS: Final = 6  # significant ones


def written_number(variable: VaryRange, number: float) -> float:
    """A length in [m] or an angle in [rad] in file units ([mm] or [deg]), rounded."""
    return written_quantity(number, is_angle=variable.is_angle)


def written_weight(weight: float) -> float:
    """A joint weight, rounded to the digits that are written."""
    return float(f"{weight:.{WEIGHT_DIGITS}g}")


def written_quantity(value: float, *, is_angle: bool) -> float:
    """A length in [m] or an angle in [rad] in file units ([mm] or [deg]), rounded."""
    return round(DEG * value, ANGLE_DIGITS) if is_angle else round(MM * value, LENGTH_DIGITS)


def written_starts(cell: Cell, settings: LayoutSettings, start: Array) -> dict[str, Any]:
    """Start postures, shape (nq,), of all robots at work, by address.

    A holder's given start is left as it is, unless it is varied.
    """
    working = {task.robot for task in cell.tasks} | set(cell.positioners)
    given = {name for name in cell.positioners[:1] if cell.robot(name).start is not None}
    given -= {variable.name for variable in settings.ranges if variable.kind is VariableKind.START}
    values = dict[str, Any]()
    for robot in cell.robots:
        if robot.name in working and robot.name not in given:
            values |= written_start(cell, robot, start[cell.columns(robot.name)])
    return values


def written_start(cell: Cell, robot: Robot, start: Array) -> dict[str, Any]:
    """The start posture of a robot: `start_deg` if all joints turn and no `start` is given, else `start`."""
    document: Any = cell.origin.document
    return _written_at(f"robots.{robot.name}", document["robots"][robot.name], robot, start)


def written_task_start(cell: Cell, task: Task, start: Array) -> dict[str, Any]:
    """The start posture of the robot of a task for that task, likewise."""
    document: Any = cell.origin.document
    return _written_at(f"tasks.{task.name}", document["tasks"][task.name], cell.robot(task.robot), start)


def _written_at(address: str, entry: Container[str], robot: Robot, start: Array) -> dict[str, Any]:
    """The start posture of a robot or a task by address."""
    joints = robot.model.joints
    numbers = [_within_limits(value, joint) for value, joint in zip(start.tolist(), joints, strict=True)]
    as_list = all(joint.is_revolute for joint in joints) and "start" not in entry
    if as_list:
        return {f"{address}.start_deg": numbers}
    keys = [f"{joint.name}_{'deg' if joint.is_revolute else 'mm'}" for joint in joints]
    replaced = {f"{address}.start_deg": None} if "start_deg" in entry else {}
    return {f"{address}.start": dict(zip(keys, numbers, strict=True)), **replaced}


def _within_limits(value: float, joint: Joint) -> float:
    """A joint position in file units, rounded; towards the inside where it is at a limit."""
    written, unit = written_quantity(value, is_angle=joint.is_revolute), DEG if joint.is_revolute else MM
    digits = ANGLE_DIGITS if joint.is_revolute else LENGTH_DIGITS
    if joint.lower <= value <= joint.upper and not joint.lower <= written / unit <= joint.upper:
        written = round(written + (-1.0 if written / unit > joint.upper else 1.0) * 10.0**-digits, digits)
    return written
