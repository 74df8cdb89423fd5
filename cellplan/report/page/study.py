"""Files of a study: ``study.json``, ``study.csv``, ``study.html`` and its plot."""

from collections.abc import Collection
from typing import Final

from cellplan.model.report import CAUTION
from cellplan.report.page.render import template
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.study import curve_legend, study_figures, varied_number
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Record, as_json
from cellplan.report.record.study import study_table

STATUS_TEXTS: Final = {
    "passed": "✓ passed",
    "failed": "✗ failed",
    "no_solution": "✗ no solution",
    "bad_input": "✗ bad input",
    "crashed": "✗ crashed",
}


def study_files(record: Record, formats: Collection[str] = ()) -> dict[str, bytes]:
    """Content of the files of a study by name.

    Args:
        record: As ``study_record`` returns it.
        formats: Formats of the plot beside SVG.
    """
    plots = pictures(study_figures(record), formats)
    return {
        "study.json": as_json(record).encode(),
        "study.csv": study_table(record).encode(),
        **plots,
        "study.html": study_page(record, plots.get("study.svg")).encode(),
    }


def study_page(record: Record, plot: bytes | None) -> str:
    """The page of a study.

    Args:
        record: As ``study_record`` returns it.
        plot: Its plot as SVG, if there is one.
    """
    return template("study.html").render(
        r=record,
        plot=inline_svg(plot.decode()) if plot else "",
        across=varied_number(record),
        legend=curve_legend(record),
        statuses=STATUS_TEXTS,
        caution=CAUTION,
    )
