"""Files of a map: ``map.json``, ``map.html`` and ``map.svg``."""

from collections.abc import Collection
from typing import Any

from cellplan.model.report import CAUTION
from cellplan.report.page.render import template
from cellplan.report.plots.base_map import TITLES, colours_of, cycle_classes, map_figure
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Record, as_json


def map_files(record: Record, formats: Collection[str] = ()) -> dict[str, bytes]:
    """Content of the files of a map by name.

    Args:
        record: As ``base_map`` returns it.
        formats: Formats of the picture beside SVG.
    """
    plots = pictures({"map": map_figure(record)}, formats)
    return {
        "map.json": as_json(record).encode(),
        **plots,
        "map.html": map_page(record, plots["map.svg"]).encode(),
    }


def map_page(record: Record, plot: bytes) -> str:
    """The page of a map.

    Args:
        record: As ``base_map`` returns it.
        plot: Its picture as SVG.
    """
    colours = colours_of(record)
    best: list[dict[str, Any]] = [{**each, **record["places"][each["place"]]} for each in record["best"]]
    examples = {
        verdict: next((place["reason"] for place in record["places"] if place["verdict"] == verdict), "")
        for verdict in colours
    }
    return template("base_map.html").render(
        r=record,
        best=best,
        plot=inline_svg(plot.decode()),
        classes=cycle_classes(record),
        colours=colours,
        titles=TITLES,
        examples=examples,
        caution=CAUTION,
    )
