"""A study as text: counts, a row for each variant, and where the files are."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from cellplan.report.record.common import Record

MAX_ROWS: Final = 40  # more are in the table on disk
MAX_REASON: Final = 72  # characters
HEADINGS: Final = ("verdict", "cycle s", "velocity %", "acceleration %", "margin deg", "clearance mm")


def study_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a study.

    Args:
        record: As ``study_record`` returns it.
        folder: Its folder.
    """
    counts, trials = record["counts"], record["trials"]
    others = [f"{count} {status.replace('_', ' ')}" for status, count in counts.items() if status != "passed" and count]
    rows = [[*record["vary"], *HEADINGS, ""], *map(_cells, trials[:MAX_ROWS])]
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]) - 1)]
    lines = [f"{record['cell']}: {counts['passed']} of {len(trials)} variants passed", *_counts(others)]
    lines += [
        f"  {'  '.join(cell.rjust(width) for cell, width in zip(row, [*widths, 0], strict=True))}".rstrip()
        for row in rows
    ]
    if len(trials) > MAX_ROWS:
        lines.append(f"  and {len(trials) - MAX_ROWS} more in study.csv")
    return [*lines, f"report: {folder / 'study.html'}", f"table: {folder / 'study.csv'}"]


def _counts(others: list[str]) -> Iterator[str]:
    """The other verdicts, if there are any."""
    if others:
        yield f"  {', '.join(others)}"


def _cells(trial: Record) -> list[str]:
    """One row."""
    figures, reason = trial["figures"], trial["reason"]
    shown = [
        trial["status"].replace("_", " "),
        _text(figures.get("cycle_time_s"), 1.0, "g"),
        _text(figures.get("max_velocity_ratio"), 100.0, ".1f"),
        _text(figures.get("max_acceleration_ratio"), 100.0, ".1f"),
        _text(figures.get("min_margin_deg"), 1.0, ".2f"),
        _text(figures.get("min_clearance_mm"), 1.0, ".2f"),
    ]
    return [
        *map(str, trial["values"].values()),
        *shown,
        reason if len(reason) <= MAX_REASON else f"{reason[:MAX_REASON]}…",
    ]


def _text(value: Any, scale: float, form: str) -> str:
    """A figure, or a dash where there is none."""
    return "-" if value is None else format(scale * value, form)
