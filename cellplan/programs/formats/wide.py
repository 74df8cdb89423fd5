"""One wide table of a program as CSV: a line of names with units, a row per instant, no comments.

Times and joint positions are written as in the plain format, so that they are verified like any program; everything
else is what the checks found in these rows. A field without a value is empty.

A quantity of a step, such as a speed, belongs to the row at which the step begins. Where a quantity is not defined, as
a speed in the last row of a program or the error of a task that is not worked on, it is not a number.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array, inverse, roll_pitch_yaw
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import JointTable, Schedule, TaskSchedule
from cellplan.model.motion.plan import Interval
from cellplan.model.report.report import ClearanceClass, Report
from cellplan.model.task.clocked_path import are_within
from cellplan.model.task.task import Frame
from cellplan.model.units import DEG, MM
from cellplan.programs.formats.csv import DECIMALS, joint_fields, read_table, time_fields

TIME: Final = "time_s"
POSE: Final = ("x_mm", "y_mm", "z_mm", "roll_deg", "pitch_deg", "yaw_deg")
Column = Array | NDArray[np.int8] | tuple[str, ...]  # numbers, 0 and 1, or texts
Columns = dict[str, Column]
_FIXED: Final = f"%.{DECIMALS}f"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhaseRows:
    """One phase of a program, and where its tools are."""

    name: str  # name of the phase
    rows: slice  # its rows in the table
    schedule: Schedule  # desired tool poses
    report: Report  # what the checks found in these rows
    X_WT: Mapping[str, Array]  # tool tips in the world, shape (n, 4, 4), by robot
    X_WP: Array  # the part in the world, shape (n, 4, 4), or (1, 4, 4) for a part at rest

    def scheduled(self, task: str) -> TaskSchedule | None:
        """The desired tool poses of a task; None where it is not worked on."""
        return next((scheduled for scheduled in self.schedule.tasks if scheduled.task.name == task), None)

    def tool_poses(self, task: str) -> Array | None:
        """Tool poses of a task in the frame that it is given in, shape (n, 4, 4); None where it is not worked on."""
        scheduled = self.scheduled(task)
        if scheduled is None:
            return None
        X_WT = self.X_WT[scheduled.task.robot]
        return X_WT if scheduled.task.relative_to is Frame.WORLD else inverse(self.X_WP) @ X_WT

    def errors(self, task: str) -> Array | None:
        """Position error in [mm] and orientation error in [deg] of a task, shape (n, 2); None likewise."""
        accuracy = next((accuracy for accuracy in self.report.accuracy if accuracy.task == task), None)
        if accuracy is None:
            return None
        position, orientation = (
            np.linalg.norm(e, axis=1) for e in (accuracy.position_error, accuracy.orientation_error)
        )
        return np.stack([MM * position, DEG * orientation], axis=1)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WideRows:
    """A program with all that its wide table shows."""

    cell: Cell
    times: Array  # times of the rows in [s], shape (N,)
    sigma: Array  # nominal times of the rows in [s], shape (N,)
    phases: Sequence[PhaseRows]  # its phases in their order; the row that two of them share is of the later one
    process: Mapping[str, Sequence[Interval]]  # nominal times in [s] of a tool on its path, by task

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks that are worked on, in the order of the cell."""
        at_work = {scheduled.task.name for phase in self.phases for scheduled in phase.schedule.tasks}
        return tuple(task.name for task in self.cell.tasks if task.name in at_work)

    def positions(self, robot: str) -> Array:
        """Joint positions of a robot in [rad] or [m], shape (N, n)."""
        return self.spread(lambda phase: phase.report.q[robot], width=len(self.cell.robot(robot).model.joints))

    def spread(self, values_of: Callable[[PhaseRows], Array | None], *, width: int | None = None) -> Array:
        """Values of all rows, shape (N,) or (N, width), from those of each phase, NaN where there is none.

        A phase of n rows gives a value or ``width`` values for each row, or for each of its n - 1 steps; None where it
        has none.
        """
        column = np.full((len(self.times), *([] if width is None else [width])), np.nan)
        for phase in self.phases:
            column[phase.rows] = np.nan
            values = values_of(phase)
            if values is not None:
                column[phase.rows.start : phase.rows.start + len(values)] = values
        return column


def wide_columns(program: WideRows) -> Columns:
    """The columns of the wide table by name, no two of the same, in the units of the names."""
    robots, tasks = program.cell.robots, program.tasks
    groups: list[Mapping[str, Column]] = [{TIME: program.times}]
    groups += [joint_columns(robot, program.positions(robot.name)) for robot in robots]
    groups.append({"sigma_s": program.sigma, "phase": _phase_names(program)})
    groups += [_task_columns(program, task) for task in tasks]
    groups += [_speed_columns(program, robot) for robot in robots]
    groups.append({"smallest_singular_value": program.spread(_singular_values)})
    groups += [{f"clearance_{kind}_mm": MM * program.spread(partial(proved_distance, kind))} for kind in ClearanceClass]
    columns: Columns = {}
    for group in groups:
        twice = sorted(columns.keys() & group.keys())
        if twice:
            raise InputError(f"wide table: expected every column once, got '{twice[0]}' of a robot and of a task")
        columns |= group
    return columns


def joint_columns(robot: Robot, q: Array) -> dict[str, Array]:
    """Joint positions of a robot in [rad] or [m], shape (N, n), by the name of their column."""
    return {
        f"{robot.name}.{joint.name}_{joint.display_unit.name}": joint.display_unit.scale * values
        for joint, values in zip(robot.model.joints, q.T, strict=True)
    }


def proved_distance(kind: ClearanceClass, phase: PhaseRows) -> Array | None:
    """Distance in [m] that a class of pairs is proved to keep in each row, shape (n,); None without such pairs.

    The curve of a report holds one distance for each stretch of the motion, at its middle. A row lies in the stretch of
    the point before it or in that of the point after it; the smaller of the two is never above the truth.
    """
    clearance, rows = phase.report.clearance, phase.report.times
    curve, times = clearance.curves.get(kind), clearance.curve_times
    if curve is None:
        return None
    after = np.clip(np.searchsorted(times, rows), 0, len(times) - 1)
    before = np.clip(np.searchsorted(times, rows, side="right") - 1, 0, len(times) - 1)
    return np.minimum(curve[before], curve[after])


def _phase_names(program: WideRows) -> tuple[str, ...]:
    """Name of the phase of each row."""
    names = [""] * len(program.times)
    for phase in program.phases:
        names[phase.rows] = [phase.name] * (phase.rows.stop - phase.rows.start)
    return tuple(names)


def _singular_values(phase: PhaseRows) -> Array | None:
    """Smallest singular value of the tasks of a phase in each row; None where none is worked on."""
    return None if phase.report.conditioning is None else phase.report.conditioning.stack


def _task_columns(program: WideRows, task: str) -> Columns:
    """What the tool of a task does on the part, or in the world for a task given there."""

    def poses(phase: PhaseRows) -> Array | None:
        X = phase.tool_poses(task)
        if X is None:
            return None
        angles = np.unwrap(roll_pitch_yaw(X[:, :3, :3]), axis=0)  # curves without jumps of a whole turn
        return np.concatenate([MM * X[:, :3, 3], DEG * angles], axis=1)

    def feeds(phase: PhaseRows) -> Array | None:
        X = phase.tool_poses(task)
        return None if X is None else MM * _speeds(X[:, :3, 3], phase.report.times)

    def travelled(phase: PhaseRows) -> Array | None:
        scheduled = phase.scheduled(task)
        return None if scheduled is None else MM * scheduled.travelled

    pose = program.spread(poses, width=len(POSE))
    error = program.spread(lambda phase: phase.errors(task), width=2)
    columns: Columns = {f"{task}.process": are_within(program.sigma, program.process.get(task, ())).astype(np.int8)}
    columns[f"{task}.s_mm"] = program.spread(travelled)
    columns |= {f"{task}.{name}": values for name, values in zip(POSE, pose.T, strict=True)}
    columns |= {f"{task}.position_error_mm": error[:, 0], f"{task}.orientation_error_deg": error[:, 1]}
    columns[f"{task}.feed_mm_s"] = program.spread(feeds)
    return columns


def _speed_columns(program: WideRows, robot: Robot) -> Columns:
    """Speeds of the joints of a robot, and of its tool tip in the world."""
    velocities = program.spread(lambda phase: phase.report.qd[robot.name], width=len(robot.model.joints))
    columns: Columns = {f"{name}_s": values for name, values in joint_columns(robot, velocities).items()}
    tool = program.spread(lambda phase: _speeds(phase.X_WT[robot.name][:, :3, 3], phase.report.times))
    columns[f"{robot.name}.tool_speed_mm_s"] = MM * tool
    return columns


def _speeds(points: Array, times: Array) -> Array:
    """Speeds of a point, shape (n, 3), in the steps between its rows in [m/s], shape (n - 1,)."""
    return np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)


def file_name(program: str | None) -> str:
    """Path of the table in the folder of the export."""
    return "wide.csv" if program is None else f"{program}/wide.csv"


def render_wide(program: WideRows) -> str:
    """Text of the table; ``InputError`` where a joint cannot be written with the decimals of the format."""
    exact = {TIME: time_fields(program.times)}
    for robot in program.cell.robots:
        robot_fields = joint_fields(robot, program.positions(robot.name))
        exact |= {f"{robot.name}.{name}": column for name, column in robot_fields.items()}
    columns = wide_columns(program)
    fields = [exact[name] if name in exact else _fields(column) for name, column in columns.items()]
    return "\n".join([",".join(columns), *map(",".join, zip(*fields, strict=True))]) + "\n"


def read_wide(cell: Cell, text: str, file: str) -> dict[str, JointTable]:
    """Read times and joint positions of a table back, strictly, by robot; an ``InputError`` has file and line."""
    if "\r" in text:
        raise InputError(
            f"{file}:{1 + text.count(chr(10), 0, text.index(chr(13)))}: expected line breaks without '\\r'"
        )
    lines = text.split("\n")
    names = lines[0].split(",")
    rows = [line.split(",") for line in lines[1:-1]]
    bad = next((number for number, row in enumerate(rows, start=2) if len(row) != len(names)), None)
    if bad is not None:
        raise InputError(f"{file}:{bad}: expected {len(names)} fields, got {len(rows[bad - 2])}")
    if lines[-1]:
        raise InputError(f"{file}: expected the last row to end with a line break; the file is truncated")
    return {robot.name: read_table(robot, _robot_columns(robot, names, rows, file), file) for robot in cell.robots}


def _robot_columns(robot: Robot, names: list[str], rows: list[list[str]], file: str) -> str:
    """Times and joints of one robot as a file of the plain format."""
    columns = {name: f"{robot.name}.{name}" for name in joint_fields(robot, np.empty((0, len(robot.model.joints))))}
    missing = [name for name in (TIME, *columns.values()) if names.count(name) != 1]
    if missing:
        raise InputError(f"{file}:1: expected one column '{missing[0]}', got {names.count(missing[0])}")
    places = [names.index(TIME), *(names.index(name) for name in columns.values())]
    lines = (",".join([row[place] for place in places]) for row in rows)
    return "\n".join([",".join([TIME, *columns]), *lines]) + "\n"


def _fields(column: Column) -> list[str]:
    """A column as fields; empty where there is no value."""
    if isinstance(column, tuple):
        return list(column)
    if column.dtype == np.int8:
        return [str(value) for value in column.tolist()]
    rounded = np.round(column.astype(np.float64), DECIMALS) + 0.0  # without -0
    if len(rounded) and np.all(rounded == rounded[0]):
        return [_number(float(rounded[0]))] * len(rounded)
    return list(map(_number, rounded.tolist()))


def _number(value: float) -> str:
    """A number without an exponent and without zeros at its end; empty where there is none."""
    return (_FIXED % value).rstrip("0").rstrip(".") if value == value else ""  # noqa: PLR0124 - not so for no number
