"""The clock of a program as a table: time, nominal time, phase, and how far each tool is, one row per sample.

The table is text as the joint tables are: header lines that start with ``#``, column names with units, and between two
phases a line that says what is not part of the program. Its rows are those of the joint tables beside it.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.files.run.joint_tables import MM_PER_M, line_of_row, plain_decimals, with_gap_lines, without_gap_lines
from cellplan.geometry.transforms import Array
from cellplan.model.motion.motion import ClockTable

TITLE: Final = "cellplan program clock v1"
DECIMALS: Final = 9  # [-] of a millimetre of path length
_NUMBER: Final = r"[0-9]{1,20}+(?:\.[0-9]{1,400}+)?+"
_PHASE: Final = r"[A-Za-z0-9_-]+(?: [A-Za-z0-9_-]+)?"
_FIXED: Final = ("time_s", "sigma_s", "phase")


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockText:
    """A clock that was read back, with what its lines are needed for in messages."""

    table: ClockTable  # its content
    cell: str  # name of the cell, as the header has it
    program: str  # SHA-256 of the rows of the joint tables, as the header has it
    first_line: int  # line of the first row in the file, from 1

    def line(self, row: int) -> int:
        """Line of a row, counted from 0, in the file."""
        return line_of_row(row, self.table.gaps, first_line=self.first_line)


def render_clock(table: ClockTable, *, cell: str, program: str) -> str:
    """The clock of a program as text, with the SHA-256 of the rows of the joint tables that it belongs to."""
    columns = [plain_decimals(table.times), plain_decimals(table.sigma), list(table.phases)]
    for task, lengths in table.lengths.items():
        columns.append(plain_decimals(np.round(MM_PER_M * lengths, DECIMALS)))
        columns.append(["1" if flag else "0" for flag in table.process[task].tolist()])
    head = [*_header_lines(cell, program), ",".join(_column_names(tuple(table.lengths)))]
    return "\n".join([*head, *with_gap_lines(map(",".join, zip(*columns, strict=True)), table.gaps)]) + "\n"


def parse_clock(text: str, source: str) -> ClockText:
    """Read a clock back, strictly: times grow from 0, nominal time starts at 0 and does not fall."""
    lines = text.split("\n")
    if lines.pop() != "":
        raise InputError(f"{source}: expected the last row to end with a line break; the file is cut off")
    cell, program = _parse_header(lines, source)
    tasks = _parse_columns(lines, source)
    rows, gaps = without_gap_lines(lines[4:], source=source, first_line=5)
    pattern = re.compile(rf"{_NUMBER},{_NUMBER},{_PHASE}" + rf"(?:,{_NUMBER},[01]){{{len(tasks)}}}")
    if not all(map(pattern.fullmatch, rows)):
        index, row = next((index, row) for index, row in enumerate(rows) if not pattern.fullmatch(row))
        place = f"{source}:{line_of_row(index, gaps, first_line=5)}"
        raise InputError(f"{place}: expected {','.join(_column_names(tasks))}, got {row[:60]!r}")
    if len(rows) < 2:
        raise InputError(f"{source}: expected at least two rows, got {len(rows)}")
    others = [0, 1, *range(len(_FIXED), len(_FIXED) + 2 * len(tasks))]
    times, sigma, *columns = np.loadtxt(rows, delimiter=",", comments=None, usecols=others).T.copy()
    for name, column, may_stay in (("time_s", times, False), ("sigma_s", sigma, True)):
        _check_growth(name, column, may_stay=may_stay, gaps=gaps, source=source)
    table = ClockTable(
        times=times,
        sigma=sigma,
        phases=tuple(row.split(",", len(_FIXED))[2] for row in rows),
        lengths={task: lengths / MM_PER_M for task, lengths in zip(tasks, columns[::2], strict=True)},
        process={task: flags == 1.0 for task, flags in zip(tasks, columns[1::2], strict=True)},
        gaps=gaps,
    )
    return ClockText(table=table, cell=cell, program=program, first_line=5)


def last_time(text: str, source: str) -> float:
    """Time of the last row of a clock in [s], read without the rows before it."""
    time = text.rstrip("\n").rpartition("\n")[2].partition(",")[0]
    return float(time if re.fullmatch(_NUMBER, time) else parse_clock(text, source).table.times[-1])


def _header_lines(cell: str, program: str) -> list[str]:
    return [f"# {TITLE}", f"# cell: {cell}", f"# program digest: sha256 {program}"]


def _parse_header(lines: Sequence[str], source: str) -> tuple[str, str]:
    """Name of the cell, and the digest of the program."""
    forms = (re.escape(f"# {TITLE}"), r"# cell: (.+)", r"# program digest: sha256 ([0-9a-f]{64})")
    fields = []
    for number, form in enumerate(forms, start=1):
        line = lines[number - 1] if len(lines) >= number else ""
        match = re.fullmatch(form, line)
        if match is None:
            expected = _header_lines("NAME", "…")[number - 1]
            raise InputError(f"{source}:{number}: expected the line '{expected}', got {line[:60]!r}")
        fields.append(match)
    return fields[1][1], fields[2][1]


def _column_names(tasks: Sequence[str]) -> list[str]:
    return [*_FIXED, *(name for task in tasks for name in (f"{task}_s_mm", f"{task}_process"))]


def _parse_columns(lines: Sequence[str], source: str) -> tuple[str, ...]:
    """Names of the tasks from the line of column names."""
    line = lines[3] if len(lines) > 3 else ""
    tasks = tuple(name.removesuffix("_s_mm") for name in line.split(",")[3::2])
    if not tasks or len(set(tasks)) != len(tasks) or line != ",".join(_column_names(tasks)):
        expected = ",".join(_column_names(["TASK"]))
        raise InputError(f"{source}:4: expected the column names '{expected}' and so on, got {line[:80]!r}")
    return tasks


def _check_growth(name: str, column: Array, *, may_stay: bool, gaps: dict[int, str], source: str) -> None:
    """Refuse a column that does not start at 0, or falls."""
    if column[0] != 0.0:
        raise InputError(f"{source}:5: {name}: expected the first row at 0, got {column[0]:g}")
    steps = np.diff(column)
    wrong = np.flatnonzero(steps < 0.0 if may_stay else steps <= 0.0)
    if len(wrong):
        row = int(wrong[0]) + 1
        how = "that never falls" if may_stay else "that grows"
        place = f"{source}:{line_of_row(row, gaps, first_line=5)}"
        raise InputError(f"{place}: {name}: expected a time {how}, got {column[row]:.9g} after {column[row - 1]:.9g}")
