"""A comparison as text: the verdicts, one table with a column for each variant, and where the files are."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from cellplan.report.record.common import Record
from cellplan.report.record.comparison import robot_names
from cellplan.report.record.numbers import floored, seconds, small

MAX_SHOWN: Final = 30  # differing inputs, and letters of their values
MAX_FAILED: Final = 3  # failed checks of a variant
DASH: Final = "-"
Row = tuple[str, Callable[[Record], str]]


def comparison_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a comparison.

    Args:
        record: As ``comparison_record`` returns it.
    """
    variants = record["variants"]
    subject = "modes" if record["of"] == "modes" else "cells and runs"
    rows = [["", *(each["name"] for each in variants)], ["verdict", *map(_verdict, variants)]]
    rows += [
        [title, *(cell(each["figures"]) if each["figures"] else DASH for each in variants)] for title, cell in ROWS
    ]
    rows += [
        [f"load of {robot}, s (share)", *(_robot(each["figures"], robot) for each in variants)]
        for robot in robot_names(record)
    ]
    lines = [f"{record['cell']}: {record['counts']['passed']} of {len(variants)} {subject} passed"]
    lines += [f"  {sentence}" for sentence in record["sentences"]]
    lines += list(_aligned(rows))
    lines += [
        f"  {each['name']}: FAILED {message}"
        for each in variants
        for message in each["figures"].get("failed", [])[:MAX_FAILED]
    ]
    lines += _differences(record)
    return [*lines, f"report: {folder / 'study.html'}", f"table: {folder / 'study.csv'}"]


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Rows as a table, the first column to the left."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for first, *others in rows:
        cells = [cell.rjust(width) for cell, width in zip(others, widths[1:], strict=True)]
        yield f"  {first.ljust(widths[0])}  {'  '.join(cells)}".rstrip()


def _verdict(variant: Record) -> str:
    """The verdict in a word or two."""
    if variant["status"] == "failed":
        return f"FAILED ({variant['figures']['failed_checks']})"
    return str(variant["status"]).replace("_", " ")


def _differences(record: Record) -> list[str]:
    """Inputs that differ."""
    found = record["differences"]
    if record["of"] == "modes":
        return []
    rows = [[each["key"], *map(short_value, each["values"])] for each in found[:MAX_SHOWN]]
    lines = [f"  {line.strip()}" for line in _aligned(rows)] if rows else ["  none"]
    more = [f"    and {len(found) - MAX_SHOWN} more in study.json"] if len(found) > MAX_SHOWN else []
    return ["  inputs that differ:", *(f"  {line}" for line in lines), *more]


def short_value(value: Any) -> str:
    """An input, cut off where it is long; a dash for none."""
    text = DASH if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 1]}…"


def _robot(figures: Record, robot: str) -> str:
    """Load and share of a robot."""
    found = figures["robots"].get(robot) if figures else None
    return f"{found['load_s']:.3g} ({100.0 * found['motion_share']:.0f} %)" if found else DASH


def _of_joint(key: str, scale: float, *, form: Callable[[float], str] = "{:.1f}".format) -> Callable[[Record], str]:
    """A figure and its joint."""
    joint = key.replace("_ratio", "_joint").replace("_deg", "_joint")
    return lambda figures: (
        DASH if figures[key] is None else f"{form(scale * figures[key])} {figures[joint].replace('/', ' ')}"
    )


def _plain(key: str, form: Callable[[float], str]) -> Callable[[Record], str]:
    """A figure by itself."""
    return lambda figures: DASH if figures[key] is None else form(figures[key])


def _clearance(figures: Record) -> str:
    """The smallest clearance, and whether it is proved."""
    value = figures["min_clearance_mm"]
    return (
        DASH if value is None else f"{floored(value)}{'' if figures['min_clearance_certified'] else ' not certified'}"
    )


ROWS: Final[Sequence[Row]] = (
    ("cycle time, s", _plain("cycle_time_s", seconds)),
    ("moves not in the program", lambda figures: "left out" if figures["not_in_program"] else "none"),
    ("smallest margin, deg", _of_joint("min_margin_deg", 1.0, form=floored)),
    ("highest velocity, % of limit", _of_joint("max_velocity_ratio", 100.0)),
    ("highest acceleration, % of limit", _of_joint("max_acceleration_ratio", 100.0)),
    ("the same at work, velocity", _of_joint("work_velocity_ratio", 100.0)),
    ("the same at work, acceleration", _of_joint("work_acceleration_ratio", 100.0)),
    ("smallest clearance, mm", _clearance),
    ("largest position error, mm", _plain("max_position_error_mm", small)),
    ("largest orientation error, deg", _plain("max_orientation_error_deg", small)),
    ("highest tool speed, mm/s", _plain("max_tool_speed_mm_s", "{:.0f}".format)),
    ("mean velocity, % of limit", _plain("mean_velocity_ratio", lambda ratio: f"{100.0 * ratio:.2g}")),
    ("load of all robots, s", _plain("load_s", "{:.3g}".format)),
    ("positioner in its hardest phase, s", _plain("positioner_phase_load_s", "{:.3g}".format)),
    ("operators at work, s", _plain("operator_work_load_s", "{:.3g}".format)),
)
