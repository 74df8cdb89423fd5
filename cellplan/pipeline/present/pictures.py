"""Pictures of results as SVG, a few of them, for a notebook."""

from collections.abc import Callable, Mapping
from typing import Final

from cellplan.model.cell import Cell
from cellplan.model.report import Report
from cellplan.pipeline.present.kinds import KINDS
from cellplan.report.plots.base_map import map_figure
from cellplan.report.plots.figure import Figure
from cellplan.report.plots.layout import floor_plan, front_figure
from cellplan.report.plots.run import run_figures
from cellplan.report.plots.svg import svg_text
from cellplan.report.record.common import Record
from cellplan.report.record.rows import format_of

Pictures = dict[str, str]  # SVG by what it shows


def run_pictures(report: Report, cell: Cell) -> Pictures:
    """Clearance over time, and the joints that come nearest to their limits."""
    shown = {
        name: figure for name, figure in run_figures(report, cell=cell).items() if name in ("clearance", "margins")
    }
    return _drawn(shown, cell.name)


def record_pictures(record: Record) -> Pictures:
    """The picture of a study, a layout search, a map or the shortest cycles; none for other records."""
    kind = format_of(record)
    draw = KINDS[kind].pictures if kind in KINDS else FIGURES.get(kind)
    figures = {} if draw is None else draw(record)
    return _drawn({name: figure for name, figure in figures.items() if figure is not None}, record["cell"])


def _drawn(figures: Mapping[str, Figure], cell: str) -> Pictures:
    """Figures as SVG by what they show."""
    return {f"{cell}: {name.replace('_', ' ')}": svg_text(figure) for name, figure in figures.items()}


FIGURES: Final[Mapping[str, Callable[[Record], Mapping[str, Figure | None]]]] = {
    "layout": lambda record: {
        "floor plan": floor_plan(record),
        "front": front_figure(record) if len(record["front"]) > 1 else None,
    },
    "map": lambda record: {"map": map_figure(record)},
}
