"""Plain CSV for any controller: one line of names with units, one row per instant, nine decimals, no comments."""

import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.export.rounding import from_file_unit, rounded_inside, rounded_quanta
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Robot
from cellplan.model.motion import JointTable
from cellplan.model.verified_run import VerifiedRun

DECIMALS: Final = 9  # of a degree, millimetre or second: a joint's speed over 1 ms is kept to a millionth of a degree/s
CLOCK: Final = "time_s"
_NUMBER: Final = rf"-?[0-9]{{1,7}}\.[0-9]{{{DECIMALS}}}"


def render_csv(run: VerifiedRun) -> dict[str, str]:
    """Text of every file, by its path in the folder of the export: ``<robot>.csv``, or ``<task>/<robot>.csv``.

    A program from home to home is one file for each robot.

    Args:
        run: The verified run.

    Raises:
        InputError: A joint cannot be written with the decimals of the format.
    """
    return {
        file_name(name, robot): _render(run.cell.robot(robot), table)
        for name, tables in run.programs.items()
        for robot, table in tables.items()
    }


def read_csv(run: VerifiedRun, files: Mapping[str, str]) -> tuple[dict[str, JointTable], ...]:
    """Read the files of an export back, strictly: the tables of each motion, by robot name.

    Args:
        run: The run that they were made from.
        files: Text by path, as ``render_csv`` gives it.

    Raises:
        InputError: With file and line, when a text is not such a file.
    """
    found = [
        {
            robot: read_table(run.cell.robot(robot), files[path], path)
            for robot in tables
            for path in [file_name(name, robot)]
        }
        for name, tables in run.programs.items()
    ]
    return run.by_phase(found)


def file_name(program: str | None, robot: str) -> str:
    """Path of the file of one robot in the folder of the export."""
    return f"{robot}.csv" if program is None else f"{program}/{robot}.csv"


def time_fields(times: Array) -> list[str]:
    """Times of rows in [s], shape (N,), as fields of a row.

    Raises:
        InputError: A time is too large for the decimals of the format.
    """
    return _fields(rounded_quanta(times, DECIMALS, what=CLOCK) / 10.0**DECIMALS)


def joint_fields(robot: Robot, q: Array) -> dict[str, list[str]]:
    """Positions of the joints of a robot as fields of rows, by the name of their column, none beyond a limit.

    Args:
        robot: The robot.
        q: Its joint positions in [rad] or [m], shape (N, n).

    Raises:
        InputError: A position cannot be written with the decimals of the format.
    """
    return {
        f"{joint.name}_{joint.display_unit.name}": _fields(rounded_inside(joint, q[:, index], DECIMALS))
        for index, joint in enumerate(robot.model.joints)
    }


def _render(robot: Robot, table: JointTable) -> str:
    """The file of one robot."""
    columns = [time_fields(table.times), *joint_fields(robot, table.q).values()]
    return "\n".join([_names(robot), *map(",".join, zip(*columns, strict=True))]) + "\n"


def _fields(column: Array) -> list[str]:
    return [f"{number:.{DECIMALS}f}" for number in column.tolist()]


def _names(robot: Robot) -> str:
    return ",".join([CLOCK, *(f"{joint.name}_{joint.display_unit.name}" for joint in robot.model.joints)])


def read_table(robot: Robot, text: str, file: str) -> JointTable:
    """Read the file of one robot, strictly.

    Args:
        robot: The robot.
        text: Content of the file.
        file: Its name in messages.

    Raises:
        InputError: With file and line, when the text is not such a file.
    """
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
        robot=robot.name,
        joints=robot.model.joint_names,
        times=numbers[:, 0].copy(),
        q=np.stack(positions, axis=1),
    )
