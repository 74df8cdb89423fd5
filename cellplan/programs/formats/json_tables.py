"""JSON: one document per program, with one clock for all robots, for programs of one's own that pass joints on.

Positions count from the zero of the model, as in the plain tables; how the controller counts stands beside them.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import from_file_unit, rounded_inside
from cellplan.programs.elements.json_tree import INDENT, Raw, Value, Written, dumped, parsed
from cellplan.programs.elements.text import fixed, line_error
from cellplan.programs.elements.timed_rows import NANO, file_path, nanoseconds, require_paths, shared_clock

DECIMALS: Final = 9  # of a degree, millimetre or second, as in the plain tables
SCHEMA: Final = "cellplan.program/1"
FILE: Final = "program.json"
FREE: Final = ("notes", "times", "positions", "process")
ZERO: Final = "positions count from the zero of the model"
_FIXED: Final = re.compile(rf"(?!-0\.0+$)-?(?:0|[1-9][0-9]{{0,6}})\.[0-9]{{{DECIMALS}}}")
_FLAG: Final = re.compile("[01]")


def render_json(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path: ``program.json``, or ``<task>/program.json``; all robots have one clock."""
    return {file_path(program.name, FILE): _document(job, program) for program in job.programs}


def read_json(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read files back, strictly but for spaces and line breaks between values; an ``InputError`` has file and line."""
    paths = {name: file_path(name, FILE) for name in frame.programs}
    require_paths(files, tuple(paths.values()))
    return tuple(_program(frame, name, files[path], path) for name, path in paths.items())


def _document(job: ExportJob, program: ProgramRows) -> str:
    """The document of a program; its tables have one row on each line."""
    names, frame = job.frame.robots, job.frame
    clock = nanoseconds(shared_clock(program, names), robot=names[0])
    head = _head(frame, program.name, count=len(clock))
    values = [f'"{key}": {dumped(value, INDENT)}' for key, value in head.items() if key not in {*FREE, "robots"}]
    values.append(f'"notes": {dumped(list(job.notes), INDENT)}')
    values.append(f'"times": {_lines([f"{time // NANO}.{time % NANO:0{DECIMALS}d}" for time in clock], INDENT)}')
    robots = [_robot_text(frame.robot(name), program.robots[name]) for name in names]
    values.append(f'"robots": {_lines(robots, INDENT)}')
    return "{\n" + ",\n".join(INDENT + value for value in values) + "\n}\n"


def _robot_text(robot: Robot, rows: RobotRows) -> str:
    """The entry of a robot."""
    inner = 3 * INDENT
    columns = [
        rounded_inside(joint, rows.q[:, place], DECIMALS).tolist() for place, joint in enumerate(robot.model.joints)
    ]
    row = "[" + ", ".join([f"%.{DECIMALS}f"] * len(columns)) + "]"
    values = [f'"{key}": {dumped(value, inner)}' for key, value in _robot_head(robot).items() if key not in FREE]
    values.append(f'"positions": {_lines([row % numbers for numbers in zip(*columns, strict=True)], inner)}')
    flags = "null" if rows.process is None else _lines([str(int(flag)) for flag in rows.process], inner)
    values.append(f'"process": {flags}')
    return "{\n" + ",\n".join(inner + value for value in values) + "\n" + 2 * INDENT + "}"


def _lines(texts: Sequence[str], indent: str) -> str:
    """An array with each of its values on lines of its own."""
    inner = ",\n" + indent + INDENT
    return "[\n" + indent + INDENT + inner.join(texts) + "\n" + indent + "]"


def _head(frame: ExportFrame, program: str | None, *, count: int) -> dict[str, Written]:
    """What stands in a document besides notes and tables."""
    return {
        "schema": SCHEMA,
        "cell": frame.cell.name,
        "program": program,
        "promise": str(frame.promise),
        "zero": ZERO,
        "rows": Raw(count),
        "time_unit": "s",
        "notes": (),
        "times": (),
        "robots": [_robot_head(frame.robot(name)) for name in frame.robots],
    }


def _robot_head(robot: Robot) -> dict[str, Written]:
    """What stands in the entry of a robot besides its tables."""
    zero = robot.model.controller
    return {
        "name": robot.name,
        "model": robot.model.name,
        "zero_of_controller": "not stated" if zero is None else f"known from: {zero.source}",
        "joints": [_joint_head(robot, place) for place in range(len(robot.model.joints))],
        "positions": (),
        "process": (),
    }


def _joint_head(robot: Robot, place: int) -> dict[str, Written]:
    """What stands of a joint: its unit, and the position of the controller, sign * model + zero + sum of couplings."""
    joint, zero = robot.model.joints[place], robot.model.controller
    head: dict[str, Written] = {"name": joint.name, "unit": joint.display_unit.name}
    if zero is None:
        return {**head, "controller": None}
    coupling = {
        other.name: Raw(fixed(factor, DECIMALS))
        for other, factor in zip(robot.model.joints, zero.coupling[place].tolist(), strict=True)
        if factor
    }
    offset = Raw(fixed(float(zero.zero[place]) * joint.display_unit.scale, DECIMALS))
    return {**head, "controller": {"sign": Raw(int(zero.sign[place])), "zero": offset, "coupling": coupling}}


def _program(frame: ExportFrame, name: str | None, text: str, file: str) -> ProgramRows:
    """Read one document."""
    if not text.isascii():
        bad = next(place for place, letter in enumerate(text) if letter > "~")
        raise line_error(file, 1 + text.count("\n", 0, bad), "ASCII characters", text[bad : bad + 20])
    root = parsed(text, file)
    head = _head(frame, name, count=0)
    members = root.members(tuple(head))
    members["notes"].require_texts()
    times = members["times"].numbers(_FIXED, f"times with {DECIMALS} decimals")
    root.require({**head, "rows": Raw(len(times))}, free=FREE)
    clock = np.array([float(time) for time in times])
    if len(clock) < 2 or clock[0] != 0.0 or not np.all(np.diff(clock) > 0.0):
        raise members["times"].refused("two times or more that rise from 0")
    robots = {}
    for robot, entry in zip(frame.robots, members["robots"].items(), strict=True):
        robots[robot] = _robot_rows(frame.robot(robot), entry, clock)
    return ProgramRows(name=name, robots=robots)


def _robot_rows(robot: Robot, entry: Value, times: Array) -> RobotRows:
    """Read the tables of a robot."""
    members, joints = entry.members(tuple(_robot_head(robot))), robot.model.joints
    what = f"{len(joints)} numbers with {DECIMALS} decimals"
    listed = members["positions"].items()
    if len(listed) != len(times):
        raise members["positions"].refused(f"an array of {len(times)} rows")
    rows = []
    for value in listed:
        numbers = value.numbers(_FIXED, what)
        if len(numbers) != len(joints):
            raise value.refused(f"an array of {what}")
        rows.append([float(number) for number in numbers])
    table = np.array(rows)
    q = np.stack([from_file_unit(joint, table[:, place]) for place, joint in enumerate(joints)], axis=1)
    return RobotRows(robot=robot.name, q=q, times=times, process=_process(members["process"], len(times)))


def _process(value: Value, count: int) -> Flags | None:
    """Whether a tool is in process in each row; None where it is not stated."""
    if value.content is None:
        return None
    flags = value.numbers(_FLAG, "zeros and ones")
    if len(flags) != count:
        raise value.refused(f"an array of {count} flags")
    return np.array([flag == "1" for flag in flags])


JSON: Final[Dialect] = Dialect(
    name="json",
    title="one JSON document of times and joints, in the zero of the model",
    render=render_json,
    read=read_json,
    decimals=DECIMALS,
    promises=(Promise.TIMED,),
)
