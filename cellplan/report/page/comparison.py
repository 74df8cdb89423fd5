"""Files of a comparison: ``study.json``, ``study.csv``, ``study.html`` and its plots."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final

from cellplan.model.report import CAUTION
from cellplan.report.page.render import template
from cellplan.report.plots.comparison import MAX_ROBOTS, comparison_figures, drawn_robots
from cellplan.report.plots.palette import ROBOTS
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Record, as_json
from cellplan.report.record.comparison import STATUSES, comparison_table, robot_names
from cellplan.report.record.numbers import fixed, floored, small
from cellplan.report.text.comparison import short_value

PLOT_TITLES: Final = {
    "joints": "range used and highest velocity of every joint; the limit is 100 %",
    "speeds": "highest joint velocity of each robot over time, as a percentage of its limit",
    "clearance": "smallest distance of all bodies over time",
}


def comparison_files(
    record: Record, curves: Sequence[Record | None], formats: Collection[str] = ()
) -> dict[str, bytes]:
    """Content of the files of a comparison by name.

    Args:
        record: As ``comparison_record`` returns it.
        curves: Curves of each variant; None for one without a motion.
        formats: Formats of the plots beside SVG.
    """
    plots = {f"study-{name}": data for name, data in pictures(comparison_figures(record, curves), formats).items()}
    drawings = {
        name.removeprefix("study-").removesuffix(".svg"): data.decode()
        for name, data in plots.items()
        if name.endswith(".svg")
    }
    return {
        "study.json": as_json(record).encode(),
        "study.csv": comparison_table(record).encode(),
        **plots,
        "study.html": comparison_page(record, drawings).encode(),
    }


def comparison_page(record: Record, plots: Mapping[str, str]) -> str:
    """The page of a comparison.

    Args:
        record: As ``comparison_record`` returns it.
        plots: Its plots as SVG, by name.
    """
    solved = [each["name"] for each in record["variants"] if each["figures"]]
    robots = robot_names(record)
    return template("comparison.html").render(
        r=record,
        robots=robots,
        tasks=list(dict.fromkeys(name for each in record["variants"] for name in each["figures"].get("tasks", {}))),
        plots={name: inline_svg(text) for name, text in plots.items()},
        titles=PLOT_TITLES,
        legend=list(zip(ROBOTS, solved, strict=False)) if plots else [],
        drawn=drawn_robots(record) if len(robots) > MAX_ROBOTS else [],
        statuses={status: f"{'✓' if status == 'passed' else '✗'} {status.replace('_', ' ')}" for status in STATUSES},
        short=short_value,
        fixed=fixed,
        floored=floored,
        small=small,
        caution=CAUTION,
    )
