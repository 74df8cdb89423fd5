"""Plain CSV for any controller: one line of names with units, one row per instant, nine decimals, no comments."""

import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.motion.motion import JointTable
from cellplan.model.report.exported import ExportFrame, ExportJob, ProgramRows, Promise, RobotRows
from cellplan.programs.elements.dialect import Dialect
from cellplan.programs.elements.joints import from_file_unit, rounded_inside, rounded_quanta
from cellplan.programs.elements.timed_rows import file_path

DECIMALS: Final = 9  # of a degree, millimetre or second: a joint's speed over 1 ms is kept to a millionth of a degree/s
CLOCK: Final = "time_s"
_NUMBER: Final = rf"-?[0-9]{{1,7}}\.[0-9]{{{DECIMALS}}}"


def render_csv(job: ExportJob) -> dict[str, str]:
    """Text of every file, by its path in the folder of the export: ``<robot>.csv``, or ``<task>/<robot>.csv``.

    A program from home to home is one file for each robot.
    """
    return {
        file_path(program.name, f"{name}.csv"): _render(job.frame.robot(name), program.robots[name])
        for program in job.programs
        for name in job.frame.robots
    }


def read_csv(frame: ExportFrame, files: Mapping[str, str]) -> tuple[ProgramRows, ...]:
    """Read the files of an export back, strictly: the rows of each program; an ``InputError`` has file and line."""
    paths = {file_path(name, f"{robot}.csv"): (name, robot) for name in frame.programs for robot in frame.robots}
    refuse_other_files(files, paths)
    tables = {paths[path]: _table_of_program(frame.robot(paths[path][1]), files[path], path) for path in paths}
    for program in frame.programs:
        _refuse_other_clocks(frame, program, {robot: tables[program, robot] for robot in frame.robots})
    rows = {key: RobotRows(robot=key[1], q=table.q, times=table.times) for key, table in tables.items()}
    return tuple(
        ProgramRows(name=program, robots={robot: rows[program, robot] for robot in frame.robots})
        for program in frame.programs
    )


def refuse_other_files(files: Mapping[str, str], expected: Mapping[str, object]) -> None:
    """Refuse files that a format does not write, and those that are missing."""
    for name in files:
        if name not in expected:
            raise InputError(f"{name}: expected no such file among the programs")
    for name in expected:
        if name not in files:
            raise InputError(f"{name}: expected this file among the programs, got none")


def time_fields(times: Array) -> list[str]:
    """Times of rows in [s], shape (N,), as fields of a row; ``InputError`` beyond the decimals of the format."""
    return _fields(rounded_quanta(times, DECIMALS, what=CLOCK) / 10.0**DECIMALS)


def joint_fields(robot: Robot, q: Array) -> dict[str, list[str]]:
    """Joint positions in [rad] or [m], shape (N, n), as fields of rows by column, none beyond a limit."""
    return {
        f"{joint.name}_{joint.display_unit.name}": _fields(rounded_inside(joint, q[:, index], DECIMALS))
        for index, joint in enumerate(robot.model.joints)
    }


def _render(robot: Robot, rows: RobotRows) -> str:
    """The file of one robot."""
    if rows.times is None:
        raise InputError(f"robot '{robot.name}': expected a time of every row, got none")
    columns = [time_fields(rows.times), *joint_fields(robot, rows.q).values()]
    return "\n".join([_names(robot), *map(",".join, zip(*columns, strict=True))]) + "\n"


def _fields(column: Array) -> list[str]:
    return [f"{number:.{DECIMALS}f}" for number in column.tolist()]


def _names(robot: Robot) -> str:
    return ",".join([CLOCK, *(f"{joint.name}_{joint.display_unit.name}" for joint in robot.model.joints)])


def read_table(robot: Robot, text: str, file: str) -> JointTable:
    """Read the file of one robot, strictly; an ``InputError`` has file and line."""
    names, _, rest = text.partition("\n")
    if names != _names(robot):
        raise InputError(f"{file}:1: expected the names '{_names(robot)}', got {names[:80]!r}")
    if not rest.endswith("\n"):
        raise InputError(f"{file}: expected the last row to end with a line break; the file is truncated")
    row = re.compile(_NUMBER + rf"(?:,{_NUMBER}){{{len(robot.model.joints)}}}")
    lines = rest.split("\n")[:-1]
    bad = next((number for number, line in enumerate(lines, start=2) if not row.fullmatch(line)), None)
    if bad is not None:
        count = len(robot.model.joints) + 1
        raise InputError(
            f"{file}:{bad}: expected {count} numbers with {DECIMALS} decimals, got {lines[bad - 2][:60]!r}"
        )
    numbers = np.array([[float(field) for field in line.split(",")] for line in lines])
    positions = [from_file_unit(joint, numbers[:, 1 + index]) for index, joint in enumerate(robot.model.joints)]
    return JointTable(
        robot=robot.name, joints=robot.model.joint_names, times=numbers[:, 0].copy(), q=np.stack(positions, axis=1)
    )


def _table_of_program(robot: Robot, text: str, file: str) -> JointTable:
    """The file of one robot, whose times rise from zero."""
    table = read_table(robot, text, file)
    if not len(table.times) or table.times[0] != 0.0:
        raise InputError(f"{file}:2: expected a first row at 0 s")
    falling = np.flatnonzero(np.diff(table.times) <= 0.0)
    if len(falling):
        row = int(falling[0]) + 1
        raise InputError(
            f"{file}:{row + 2}: expected a time after {table.times[row - 1]:g} s, got {table.times[row]:g} s"
        )
    return table


def _refuse_other_clocks(frame: ExportFrame, program: str | None, tables: Mapping[str, JointTable]) -> None:
    """Refuse robots of one program whose rows have other times than those of its first one."""
    first = tables[frame.robots[0]]
    for robot, table in tables.items():
        file, most = file_path(program, f"{robot}.csv"), min(len(table.times), len(first.times))
        other = np.flatnonzero(table.times[:most] != first.times[:most])
        row = int(other[0]) if len(other) else most
        if len(other) or len(table.times) != len(first.times):
            expected = f"{first.times[row]:.{DECIMALS}f} s" if row < len(first.times) else "the end"
            got = f"{table.times[row]:.{DECIMALS}f} s" if row < len(table.times) else "the end"
            raise InputError(f"{file}:{row + 2}: expected {expected} as in the file of '{first.robot}', got {got}")


CSV: Final = Dialect(
    name="csv",
    title="one table for each robot, for any controller",
    render=render_csv,
    read=read_csv,
    decimals=DECIMALS,
    promises=(Promise.TIMED,),
)
