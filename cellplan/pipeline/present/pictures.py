"""Pictures of results as SVG, a few of them, for a notebook."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from cellplan.model.cell import Cell
from cellplan.model.report import Report
from cellplan.report.plots.base_map import map_sheet
from cellplan.report.plots.fastest import curve_sheets
from cellplan.report.plots.layout import floor_plan, front_sheet
from cellplan.report.plots.run import clearance_sheets, motion_sheets
from cellplan.report.plots.sheet import Sheet
from cellplan.report.plots.study import study_sheets
from cellplan.report.plots.svg import svg_text
from cellplan.report.record.common import Record
from cellplan.report.record.rows import format_of

Pictures = dict[str, str]  # SVG by what it shows


def run_pictures(report: Report, cell: Cell) -> Pictures:
    """Clearance over time, and the joints of the robot that comes nearest to a limit.

    Args:
        report: The report of one phase.
        cell: The cell as it is in it.
    """
    sheets = dict(clearance_sheets(report, cell=cell)) if report.clearance.curves else {}
    bounded = [use for use in report.joints if np.isfinite(use.upper - use.lower)]
    if bounded:
        robot = min(bounded, key=lambda use: use.margin / (use.upper - use.lower)).robot
        name = f"positions_{robot}"
        sheets |= {key: sheet for key, sheet in motion_sheets(report, cell=cell).items() if key == name}
    return _drawn(sheets, cell.name)


def record_pictures(record: Record) -> Pictures:
    """The picture of a study, a layout search, a map or the shortest cycles; none for other records.

    Args:
        record: Content of its JSON file.
    """
    kind = format_of(record)
    sheets = SHEETS[kind](record) if kind in SHEETS else {}
    return _drawn({name: sheet for name, sheet in sheets.items() if sheet is not None}, record["cell"])


def _drawn(sheets: Mapping[str, Sheet], cell: str) -> Pictures:
    """Sheets as SVG by what they show."""
    return {f"{cell}: {name.replace('_', ' ')}": svg_text(sheet) for name, sheet in sheets.items()}


def _shares(record: Record) -> dict[str, Sheet]:
    """Of the sheets of a production curve that of the speeds alone."""
    return {name: sheet for name, sheet in curve_sheets(record).items() if name == "max_velocity_ratio"}


SHEETS: Final[Mapping[str, Callable[[Record], Mapping[str, Sheet | None]]]] = {
    "study": study_sheets,
    "layout": lambda record: {
        "floor plan": floor_plan(record),
        "front": front_sheet(record) if len(record["front"]) > 1 else None,
    },
    "map": lambda record: {"map": map_sheet(record)},
    "fastest": _shares,
}
