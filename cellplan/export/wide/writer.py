"""One wide table of a program as CSV: a line of names with units, a row per instant, no comments.

Times and joint positions are written as in the plain format, so that they are verified like any program; everything
else is what the checks found in these rows. A field without a value is empty.
"""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.export.csv import DECIMALS, joint_fields, read_table, time_fields
from cellplan.export.wide.columns import TIME, Column, WideRows, wide_columns
from cellplan.model.cell import Cell, Robot
from cellplan.model.motion import JointTable

_FIXED: Final = f"%.{DECIMALS}f"


def file_name(program: str | None) -> str:
    """Path of the table in the folder of the export."""
    return "wide.csv" if program is None else f"{program}/wide.csv"


def render_wide(program: WideRows) -> str:
    """Text of the table.

    Raises:
        InputError: A joint cannot be written with the decimals of the format, or two columns have the same name.
    """
    exact = {TIME: time_fields(program.times)}
    for robot in program.cell.robots:
        robot_fields = joint_fields(robot, program.positions(robot.name))
        exact |= {f"{robot.name}.{name}": column for name, column in robot_fields.items()}
    columns = wide_columns(program)
    fields = [exact[name] if name in exact else _fields(column) for name, column in columns.items()]
    return "\n".join([",".join(columns), *map(",".join, zip(*fields, strict=True))]) + "\n"


def read_wide(cell: Cell, text: str, file: str) -> dict[str, JointTable]:
    """Read times and joint positions of a table back, strictly, by robot.

    Raises:
        InputError: With file and line, when the text is not such a table.
    """
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
