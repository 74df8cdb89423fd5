"""Pictures of results as SVG, a few of them, for a notebook."""

from collections.abc import Mapping

from cellplan.model.cell import Cell
from cellplan.model.report import Report
from cellplan.pipeline.present.kinds import KINDS
from cellplan.report.plots.figure import Figure
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
    return _pictures(shown, cell.name)


def record_pictures(record: Record) -> Pictures:
    """The pictures that are shown of a record."""
    figures = KINDS[format_of(record)].pictures(record)
    return _pictures({name: figure for name, figure in figures.items() if figure is not None}, record["cell"])


def _pictures(figures: Mapping[str, Figure], cell: str) -> Pictures:
    """Figures as SVG by what they show."""
    return {f"{cell}: {name.replace('_', ' ')}": svg_text(figure) for name, figure in figures.items()}
