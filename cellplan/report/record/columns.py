"""Columns of figures, as text for a terminal, as rows of a page and as CSV: one list of keys for all three."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from cellplan.report.record.figures import SHOWN, SUBJECTS


def terminal_lines(rows: Sequence[Sequence[str]], indent: str) -> list[str]:
    """Rows of a table, the first one its headings, every column flush right.

    Args:
        rows: Texts by column.
        indent: What every line begins with.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [indent + "  ".join(map(str.rjust, row, widths)).rstrip() for row in rows]


def terminal_table(keys: Iterable[str], figures: Iterable[Mapping[str, Any]], indent: str) -> list[str]:
    """A line of headings and a line for each row of figures."""
    shown = {key: SHOWN[key] for key in keys}
    heads = [figure.column for figure in shown.values()]
    rows = [heads, *([figure.text(row[key]) for key, figure in shown.items()] for row in figures)]
    return terminal_lines(rows, indent)


def page_headings(keys: Iterable[str]) -> str:
    """Headings of the columns of a page: of each quantity, and of what is worst of it."""
    heads = [None if key in SUBJECTS else SHOWN[key].heading for key in keys]
    name = '<th scope="col" class="text">joint</th>'
    return "".join(name if head is None else f'<th scope="col">{head}</th>' for head in heads)


def page_cells(keys: Iterable[str], figures: Mapping[str, Any]) -> list[tuple[bool, str]]:
    """Whether each cell of a row is a name, and its text."""
    return [(True, figures[key] or "") if key in SUBJECTS else (False, SHOWN[key].page(figures[key])) for key in keys]


def csv_text(rows: Iterable[Sequence[Any]]) -> str:
    """Rows as CSV, the first one its names."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
