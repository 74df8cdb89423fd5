"""Gaps of a program in its tables: a line between two rows that says what is not part of the program."""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

from cellplan.errors import InputError
from cellplan.model.motion.plan import NOT_IN_PROGRAM

_GAP: Final = re.compile(rf"# {NOT_IN_PROGRAM}: ([A-Za-z0-9_-]+ to [A-Za-z0-9_-]+)")


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
    rows: list[str] = []
    gaps: dict[int, str] = {}
    for number, line in enumerate(lines, start=first_line):
        if not line.startswith("#"):
            rows.append(line)
            continue
        match = _GAP.fullmatch(line)
        if match is None:
            raise InputError(f"{source}:{number}: expected a row, or '# {NOT_IN_PROGRAM}: A to B', got {line[:60]!r}")
        if not rows or len(rows) in gaps or number == first_line + len(lines) - 1:
            raise InputError(f"{source}:{number}: expected '# {NOT_IN_PROGRAM}' between two rows only")
        gaps[len(rows)] = match[1]
    return rows, gaps


def line_of_row(row: int, gaps: Mapping[int, str], *, first_line: int) -> int:
    """Line of a row, counted from 0, in its file, from 1."""
    return first_line + row + sum(after <= row for after in gaps)
