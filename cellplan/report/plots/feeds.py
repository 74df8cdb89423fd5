"""The greatest feed over the path of a task, with the feed at which it is run along."""

from typing import Final

import numpy as np

from cellplan.model.report.greatest_feed import GreatestFeed
from cellplan.model.units import MM
from cellplan.report.plots.figure import Figure, Limit, PlotAxis, PlotCurve, PlotMark, PlotPanel, value_axis
from cellplan.report.plots.palette import INK, LIMIT
from cellplan.report.record.numbers import small

TALLEST: Final = 4.0  # [-] times the larger of the feed and its greatest: where the curve is cut off


def feed_figure(greatest: GreatestFeed) -> Figure:
    """Greatest constant feed at each place of the path; the feed itself as a limit from below."""
    feed, least = MM * greatest.feed, MM * greatest.greatest
    top = TALLEST * max(feed, min(least, feed * TALLEST))
    panel = PlotPanel(
        title="greatest constant feed, in mm/s",
        note=f"least {small(least)}: {greatest.text}",
        y=value_axis(0.0, top, unit="mm/s", is_floored=True),
        items=[
            Limit(feed, "feed", is_upper=False),
            PlotCurve("greatest", MM * greatest.travelled, np.minimum(MM * greatest.feeds, top), INK),
            PlotMark(MM * greatest.at, min(least, top), LIMIT if least < feed else INK),
        ],
    )
    low, high = MM * greatest.travelled[[0, -1]]
    x = PlotAxis(low=float(low), high=float(high), label="place on the path in mm", unit="mm")
    return Figure(title=f"{greatest.task}: greatest feed over the path", x=x, panels=[panel])
