"""The tables of a cell: its robots, their joints and limits, and its tasks."""

from collections.abc import Iterator

from cellplan.geometry.transforms import rpy_from_rotation
from cellplan.model.cell import Cell, Robot
from cellplan.model.robot import Joint
from cellplan.model.task import Task
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import number
from cellplan.report.record.rows import Row, Tables, columns_of

POSE: tuple[str, ...] = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")


def cell_tables(cell: Cell) -> Tables:
    """The tables of a cell, in the units of its file."""
    return {
        "robots": lambda: columns_of(_robot_row(cell, robot) for robot in cell.robots),
        "joints": lambda: columns_of(_joint_rows(cell)),
        "tasks": lambda: columns_of(map(_task_row, cell.tasks)),
    }


def role_of(cell: Cell, robot: str) -> str:
    """``positioner``, ``operator`` or ``idle``."""
    if robot in cell.positioners:
        return "positioner"
    return "operator" if any(task.robot == robot for task in cell.tasks) else "idle"


def _robot_row(cell: Cell, robot: Robot) -> Row:
    """A robot: its model, its role and the pose of its base in the world."""
    p, rpy = MM * robot.X_WB[:3, 3], DEG * rpy_from_rotation(robot.X_WB[:3, :3])
    pose = dict(zip(POSE, map(number, [*p.tolist(), *rpy.tolist()]), strict=True))
    names = {"robot": robot.name, "model": robot.model.name, "role": role_of(cell, robot.name)}
    return {**names, "joints": len(robot.model.joints), **pose}


def _joint_rows(cell: Cell) -> Iterator[Row]:
    """A joint with its limits, in its unit."""
    for robot in cell.robots:
        for index, joint in enumerate(robot.model.joints):
            start = None if robot.start is None else float(robot.start[index])
            yield {"robot": robot.name, "joint": joint.name, "unit": joint.display_unit.name, **_limits(joint, start)}


def _limits(joint: Joint, start: float | None) -> Row:
    scale = joint.display_unit.scale
    values = {
        "lower": joint.lower,
        "upper": joint.upper,
        "velocity_limit": joint.velocity,
        "acceleration_limit": joint.acceleration,
        "jerk_limit": joint.jerk,
        "start": start,
    }
    return {name: None if value is None else number(scale * value) for name, value in values.items()}


def _task_row(task: Task) -> Row:
    """A task as it is written."""
    return {
        "task": task.name,
        "robot": task.robot,
        "path": type(task.path).__name__,
        "relative_to": str(task.relative_to),
        "start_s": number(task.start),
        "duration_s": number(task.duration),
        "feed_mm_s": None if task.feed is None else number(MM * task.feed),
        "repeat": task.repeat,
        "position_tolerance_mm": number(task.tolerance.position_mm),
        "orientation_tolerance_deg": number(task.tolerance.orientation_deg),
    }
