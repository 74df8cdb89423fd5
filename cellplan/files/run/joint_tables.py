"""Joint tables: the text file with the joint positions of one robot at every time of the program.

A table is ASCII-plain text: header lines that start with ``#``, one line of column names with their units, one row per
sample, and between two phases a line that says what is not part of the program. The written number is the truth: angles
and lengths are rounded to twelve decimals of a degree or a millimetre, and every number is written so that it reads
back to itself; what is verified is what was read back.
"""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.motion.motion import JointTable
from cellplan.model.motion.plan import NOT_IN_PROGRAM
from cellplan.model.report.report import CAUTION

_GAP: Final = re.compile(rf"# {NOT_IN_PROGRAM}: ([A-Za-z0-9_-]+ to [A-Za-z0-9_-]+)")
TITLE = "cellplan joint table v1"
NOT_CHECKED = "not checked"

DECIMALS = 12  # [-] of a degree or a millimetre: far below the noise of the arithmetic, and pleasant to read
MM_PER_M = 1e3  # [mm/m]
CLOCK_TOL = 1e-6  # [s] room for steps that are not whole decimals, such as 1/3000 s
MAX_NUMBER = 1e9  # [deg], [mm] or [s]: beyond it twelve decimals would be pretence

NO_GAPS: Mapping[int, str] = {}

Flags = np.ndarray[tuple[int], np.dtype[np.bool_]]

_NUMBER = r"-?[0-9]{1,20}+(?:\.[0-9]{1,400}+)?+"
_FIELD = re.compile(_NUMBER)
_UNITS = ("deg", "mm")
_SHA256 = "sha256 "


@dataclass(frozen=True, slots=True, kw_only=True)
class TableHeader:
    """The entries of the header of a table besides its title and the caution."""

    cell: str  # name of the cell
    mode: str  # who moves
    verdict: str = NOT_CHECKED  # ``passed``, ``REJECTED: <first violation>`` or ``not checked``
    digests: Mapping[str, str]  # SHA-256 in hexadecimal by what it is the digest of (``cell``, ``program``)
    remark: str = ""  # what else has to be known of the rows; empty for the program of the cell as it is written
    accelerations: str = ""  # largest acceleration and jerk of the robot's joints; empty for rows that are not checked
    zero: str = ""  # from which zero the joint positions count; empty for rows that are not checked


def render_table(
    robot: Robot, times: Array, q: Array, *, header: TableHeader, gaps: Mapping[int, str] = NO_GAPS
) -> str:
    """Write the joint table of one robot.

    Args:
        times: Times of the rows in [s], shape (N,).
        q: Its joint positions in [rad] or [m], shape (N, n).
        gaps: Name of what is not part of the program, by the first row after it.
    """
    return _render_header(robot.name, header) + _render_rows(robot, times, q, gaps)


def replace_header(text: str, *, header: TableHeader) -> str:
    """Put another header above the rows of a table, which stay as they are byte for byte."""
    robot = _header_fields(text, "table")["robot"]
    return _render_header(robot, header) + table_body(text)


def other_header_line(text: str, source: str) -> int | None:
    """The first header line of a table, from 1, that is not what ``render_table`` writes for what the header says.

    None where there is none: no line that says more, twice, or in another place.
    """
    written = replace_header(text, header=parse_header(text, source))
    if written == text:
        return None
    lines = zip_longest(text.split("\n"), written.split("\n"))
    return next(number for number, (line, other) in enumerate(lines, start=1) if line != other)


def table_body(text: str) -> str:
    """A table without its header lines: the line of column names and the rows."""
    start = 0
    while text.startswith("#", start):
        end = text.find("\n", start)
        start = len(text) if end < 0 else end + 1
    return text[start:]


def program_digest(tables: Mapping[str, str]) -> str:
    """SHA-256 of the rows of all tables; headers do not count, so the digest can stand in them."""
    digest = hashlib.sha256()
    for robot, text in tables.items():
        digest.update(f"{robot}\n".encode())
        digest.update(table_body(text).encode())
    return digest.hexdigest()


def parse_table(text: str, source: str) -> JointTable:
    """Read times in [s] and positions in [rad] or [m] back, strictly: nothing is skipped, guessed or repaired."""
    robot = _header_fields(text, source)["robot"]
    body = table_body(text)
    first_line = 1 + text.count("\n", 0, len(text) - len(body))
    if body and not body.endswith("\n"):
        raise InputError(f"{source}: expected the last row to end with a line break; the file is cut off")
    columns, _, rows = body.partition("\n")
    joints, is_angle = _parse_columns(columns, f"{source}:{first_line}")
    lines, gaps = without_gap_lines(rows.split("\n")[:-1], source=source, first_line=first_line + 1)
    places = _Places(source=source, first_line=first_line + 1, gaps=gaps)
    numbers = _parse_rows(lines, columns.split(","), places)
    times = numbers[:, 0].copy()
    _check_clock(times, places)
    q = np.where(is_angle, np.deg2rad(numbers[:, 1:]), numbers[:, 1:] / MM_PER_M)
    return JointTable(robot=robot, joints=joints, times=times, q=q, gaps=gaps)


def row_place(text: str, source: str, row: int) -> str:
    """File and line of a row of numbers, counted from 0, in the text of a table."""
    gaps = parse_table(text, source).gaps
    first_line = text.count("\n", 0, len(text) - len(table_body(text))) + 2
    return f"{source}:{line_of_row(row, gaps, first_line=first_line)}"


def parse_header(text: str, source: str) -> TableHeader:
    """Read what the header lines of a table say, all of them of known forms."""
    fields = _header_fields(text, source)
    digests = {
        key.removesuffix(" digest"): value.removeprefix(_SHA256)
        for key, value in fields.items()
        if key.endswith(" digest")
    }
    return TableHeader(
        cell=fields["cell"],
        mode=fields["mode"],
        verdict=fields["verdict"],
        digests=digests,
        remark=fields.get("remark", ""),
        accelerations=fields.get("accelerations", ""),
        zero=fields.get("zero", ""),
    )


def _render_header(robot: str, header: TableHeader) -> str:
    fields = {"robot": robot, "cell": header.cell, "mode": header.mode}
    fields |= {f"{name} digest": f"{_SHA256}{digest}" for name, digest in header.digests.items()}
    fields |= {"zero": header.zero} if header.zero else {}
    fields |= {"remark": header.remark} if header.remark else {}
    fields |= {"accelerations": header.accelerations} if header.accelerations else {}
    fields["verdict"] = header.verdict
    lines = [TITLE, *(f"{key}: {_one_line(value)}" for key, value in fields.items()), CAUTION]
    return "".join(f"# {line}\n" for line in lines)


def _one_line(value: str) -> str:
    """The value without line breaks and control characters: nothing may break out of a comment."""
    return " ".join("".join(char if char.isprintable() else " " for char in value).split())


def _render_rows(robot: Robot, times: Array, q: Array, gaps: Mapping[int, str]) -> str:
    joints = robot.model.joints
    if q.shape != (len(times), len(joints)):
        raise ValueError(f"table of '{robot.name}': expected shape {(len(times), len(joints))}, got {q.shape}")
    for joint in joints:
        if not re.fullmatch(r"[^\s,\"#]+", joint.name) or not joint.name.isprintable():
            raise InputError(
                f"robot '{robot.name}': joint name {joint.name!r} cannot stand in a joint table; "
                "allowed are names without space, comma, quote and #"
            )
    names = ",".join(["time_s", *(f"{joint.name}_{'deg' if joint.is_revolute else 'mm'}" for joint in joints)])
    scaled = (np.rad2deg(q[:, i]) if joint.is_revolute else q[:, i] * MM_PER_M for i, joint in enumerate(joints))
    written = (plain_decimals(column) for column in (times, *(np.round(column, DECIMALS) for column in scaled)))
    return "\n".join([names, *with_gap_lines(map(",".join, zip(*written, strict=True)), gaps)]) + "\n"


def plain_decimals(column: Array) -> list[str]:
    """The shortest text of each number that reads back to it, without exponents and without -0."""
    if not np.all(np.abs(column) < MAX_NUMBER):
        raise ValueError("joint table: a number is not finite or absurdly large")
    numbers = column + 0.0  # turns -0.0 into 0.0
    texts = [repr(number) for number in numbers.tolist()]
    for index in np.flatnonzero((np.abs(numbers) < 1e-3) & (numbers != 0.0)):  # repr would use an exponent here
        texts[index] = np.format_float_positional(numbers[index], trim="0")
    return texts


def _header_fields(text: str, source: str) -> dict[str, str]:
    lines = text[: len(text) - len(table_body(text))].split("\n")[:-1]
    if not lines or lines[0] != f"# {TITLE}":
        got = text.partition("\n")[0][:60]
        raise InputError(f"{source}:1: expected the line '# {TITLE}', got {got!r}")
    if lines[-1] != f"# {CAUTION}":
        raise InputError(f"{source}:{len(lines)}: expected the header to end with '# {CAUTION}'")
    fields: dict[str, str] = {}
    for number, line in enumerate(lines[1:-1], start=2):
        key, colon, value = line.removeprefix("# ").partition(": ")
        if not line.startswith("# ") or not colon or not value or key in fields:
            raise InputError(f"{source}:{number}: expected a header line '# key: value', each key once, got {line!r}")
        fields[key] = value
    for key in ("robot", "cell", "mode", "verdict"):
        if key not in fields:
            raise InputError(f"{source}: the header has no line '# {key}: …'")
    return fields


def _parse_columns(line: str, where: str) -> tuple[tuple[str, ...], Flags]:
    """Joint names from the line of column names, and whether each column holds angles."""
    first, *names = line.split(",")
    if first != "time_s" or not names:
        raise InputError(f"{where}: expected the column names 'time_s,<joint>_deg,…', got {line[:80]!r}")
    joints, units = [], []
    for name in names:
        joint, _, unit = name.rpartition("_")
        if not joint or unit not in _UNITS:
            raise InputError(f"{where}: column {name!r}: expected a joint's name with the ending _deg or _mm")
        if joint in joints:
            raise InputError(f"{where}: column {name!r}: joint '{joint}' stands twice")
        joints.append(joint)
        units.append(unit)
    return tuple(joints), np.array([unit == "deg" for unit in units])


@dataclass(frozen=True, slots=True, kw_only=True)
class _Places:
    """Where the rows of a table are, for messages."""

    source: str
    first_line: int
    gaps: Mapping[int, str]

    def of(self, row: int) -> str:
        """File and line of a row."""
        return f"{self.source}:{line_of_row(row, self.gaps, first_line=self.first_line)}"


def _parse_rows(lines: list[str], columns: list[str], places: _Places) -> Array:
    """All numbers, shape (N, columns)."""
    if len(lines) < 2:
        raise InputError(f"{places.source}: expected at least two rows of numbers, got {len(lines)}")
    row = re.compile(_NUMBER + rf"(?:,{_NUMBER}){{{len(columns) - 1}}}")
    if not all(map(row.fullmatch, lines)):
        raise _first_bad_row(lines, row, columns, places)
    return np.loadtxt(lines, delimiter=",", comments=None)


def _first_bad_row(lines: Iterable[str], row: re.Pattern[str], columns: list[str], places: _Places) -> InputError:
    """The finding about the first row that is not a row of plain decimals."""
    index, line = next((index, line) for index, line in enumerate(lines) if not row.fullmatch(line))
    fields = line.split(",")
    if len(fields) != len(columns):
        return InputError(f"{places.of(index)}: expected {len(columns)} numbers, got {len(fields)}")
    name, field = next(pair for pair in zip(columns, fields, strict=True) if not _FIELD.fullmatch(pair[1]))
    return InputError(f"{places.of(index)}: {name}: expected a plain decimal number such as -12.5, got {field[:40]!r}")


def _check_clock(times: Array, places: _Places) -> None:
    """Refuse a clock that does not start at zero or does not tick evenly."""
    if times[0] != 0.0:
        raise InputError(f"{places.of(0)}: time_s: expected the first row at 0, got {times[0]:g}")
    even = np.median(np.diff(times)) * np.arange(len(times))
    late = np.flatnonzero((np.abs(times - even) > CLOCK_TOL) | (np.diff(times, prepend=-1.0) <= 0.0))
    if len(late):
        row = int(late[0])
        raise InputError(
            f"{places.of(row)}: time_s: expected evenly spaced, growing times "
            f"({even[row]:.6g} here), got {times[row]:.6g}"
        )


def with_gap_lines(rows: Iterator[str], gaps: Mapping[int, str]) -> Iterator[str]:
    """Rows of a table with a line at each gap, named by the first row after it, counted from 0."""
    for index, row in enumerate(rows):
        if index in gaps:
            yield f"# {NOT_IN_PROGRAM}: {gaps[index]}"
        yield row


def without_gap_lines(lines: Sequence[str], *, source: str, first_line: int) -> tuple[list[str], dict[int, str]]:
    """Rows of a table, and its gaps by the first row after each.

    The first of them is so many lines, from 1, into the source; an ``InputError`` has the line of another comment.
    """
    gaps: dict[int, str] = {}
    for before, place in enumerate([place for place, line in enumerate(lines) if line.startswith("#")]):
        line, row = lines[place], place - before
        match = _GAP.fullmatch(line)
        if match is None:
            expected = f"a row, or '# {NOT_IN_PROGRAM}: A to B', got {line[:60]!r}"
            raise InputError(f"{source}:{first_line + place}: expected {expected}")
        if row == 0 or row in gaps or place == len(lines) - 1:
            raise InputError(f"{source}:{first_line + place}: expected '# {NOT_IN_PROGRAM}' between two rows only")
        gaps[row] = match[1]
    return [line for line in lines if not line.startswith("#")] if gaps else [*lines], gaps


def line_of_row(row: int, gaps: Mapping[int, str], *, first_line: int) -> int:
    """Line of a row, counted from 0, in its file, from 1."""
    return first_line + row + sum(after <= row for after in gaps)
