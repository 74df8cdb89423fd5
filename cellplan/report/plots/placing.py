"""Layout of figures: where panels, tick marks and texts go, in points from the upper left corner."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.report.plots.figure import Figure, LegendKey, Limit, Note, PlotAxis, PlotPanel
from cellplan.report.plots.palette import GREY, INK, LIMIT

INCH: Final = 72.0  # [point]; the lengths below are in points
LEFT, RIGHT, GAP = 42.0, 11.0, 43.0  # beside the panels, and between two
HEAD, FOOT = 30.0, 22.0  # above and below all panels
UNTITLED_HEAD: Final = 6.0
PANEL_HEAD, PANEL_FOOT = 23.0, 9.0  # above and below each panel
PLANE_LEFT, PLANE_FOOT, LEGEND = 54.0, 46.0, 164.0
PLANE_LONGEST: Final = 504.0  # longer side of a plane
TICK: Final = 4.0
LINE: Final = 14.0  # from one line of a legend to the next
SMALLEST_NOTE: Final = 5.0  # [points] of letters beside a long title
LETTER: Final = 0.57  # [-] of its size that a bold letter takes on average
ASCENT, MIDDLE, DESCENT = 0.76, 0.36, 0.2  # [-] of its size: a text below, beside and above a point
MAX_DECADES: Final = 6  # [-] with a tick for each; more have one for every second or third
SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Words(NamedTuple):
    """A line of text; its base line begins, ends, or has its middle at the point; its kind is a class in pages."""

    x: float
    y: float
    text: str
    size: float = 8.0
    colour: str = INK
    is_bold: bool = False
    anchor: str = "start"
    kind: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedPanel:
    """A panel with the box of its curves; its words are placed from the upper left corner of that box."""

    panel: PlotPanel
    x: PlotAxis  # its axis from left to right
    left: float  # left edge of the box
    top: float  # upper edge of the box
    width: float  # width of the box
    height: float  # height of the box
    x_ticks: Sequence[float]  # values with a tick along it
    y_ticks: Sequence[float]  # values with a tick upwards
    words: Sequence[Words]  # texts outside the box, and at places in it

    def across(self, values: Array | float) -> Array:
        """Distance of values from the left edge of the box."""
        return self.width * self.x.share(values)

    def down(self, values: Array | float) -> Array:
        """Distance of values from the upper edge of the box."""
        return self.height * (1.0 - self.panel.y.share(values))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedFigure:
    """A figure with the places of its panels and texts."""

    figure: Figure
    width: float
    height: float
    panels: Sequence[PlacedPanel]
    words: Sequence[Words]  # its texts but for those of the panels
    swatches: Sequence[tuple[float, float, str]]  # upper left corner and colour of each colour in the legend


SWATCH: Final = (13.0, 8.6)  # width and height


def placed(figure: Figure) -> PlacedFigure:
    """The places of everything in a figure."""
    legend = LEGEND if figure.legend else 0.0
    head = HEAD if figure.title else UNTITLED_HEAD
    if figure.is_plane:
        panels = [_plane(figure, figure.panels[0], head)]
        width = PLANE_LEFT + panels[0].width + RIGHT + legend
        height = head + panels[0].height + PLANE_FOOT
    else:
        panels = list(_grid(figure, head, INCH * figure.width - legend))
        width = INCH * figure.width
        height = head + INCH * figure.row * -(-len(figure.panels) // figure.columns) + FOOT
    words = [Words(8.6, 17.0, figure.title, size=10.5, is_bold=True)] if figure.title else []
    words.append(Words(width - legend - RIGHT, height - 7.2, figure.x.label, colour=GREY, anchor="end"))
    if figure.is_plane:
        words.append(Words(8.6, height - 7.2, figure.panels[0].y.label, colour=GREY))
    left = width - legend
    entries = [(key, head + 8.0 + LINE * line) for line, key in enumerate(figure.legend)]
    words += [_entry(key, left, y) for key, y in entries]
    swatches = [(left, y - 0.5 * SWATCH[1], key.colour) for key, y in entries if key.colour]
    shown = [token for token in words if token.text]
    return PlacedFigure(figure=figure, width=width, height=height, panels=panels, words=shown, swatches=swatches)


def _entry(key: LegendKey, left: float, y: float) -> Words:
    x = left + SWATCH[0] + 6.0 if key.colour else left
    return Words(x, y + 8.0 * MIDDLE, key.text, colour=key.ink or INK, is_bold=key.is_bold)


def _plane(figure: Figure, panel: PlotPanel, head: float) -> PlacedPanel:
    """The box of a plane, to scale."""
    spans = (figure.x.high - figure.x.low, panel.y.high - panel.y.low)
    scale = PLANE_LONGEST / max(spans)
    size = (scale * spans[0], scale * spans[1])
    x_ticks, y_ticks = nice_ticks(figure.x, 6), nice_ticks(panel.y, 6)
    return _panel(figure, panel, (PLANE_LEFT, head), size, (x_ticks, y_ticks), has_x_labels=True)


def _grid(figure: Figure, head: float, width: float) -> Iterator[PlacedPanel]:
    """The boxes of panels, row by row."""
    rows = -(-len(figure.panels) // figure.columns)
    box = ((width - LEFT - RIGHT - (figure.columns - 1) * GAP) / figure.columns, INCH * figure.row)
    for index, panel in enumerate(figure.panels):
        row, column = divmod(index, figure.columns)
        corner = (LEFT + column * (box[0] + GAP), head + row * box[1] + PANEL_HEAD)
        size = (box[0], box[1] - PANEL_HEAD - PANEL_FOOT)
        ticks = nice_ticks(figure.x, 5), nice_ticks(panel.y, 4)
        has_x_labels = row == rows - 1 or index + figure.columns >= len(figure.panels)
        yield _panel(figure, panel, corner, size, ticks, has_x_labels=has_x_labels)


def _panel(
    figure: Figure,
    panel: PlotPanel,
    corner: tuple[float, float],
    size: tuple[float, float],
    ticks: tuple[Sequence[float], Sequence[float]],
    *,
    has_x_labels: bool,
) -> PlacedPanel:
    box = PlacedPanel(
        panel=panel,
        x=figure.x,
        left=corner[0],
        top=corner[1],
        width=size[0],
        height=size[1],
        x_ticks=ticks[0],
        y_ticks=ticks[1],
        words=(),
    )
    words = [*_headings(panel, size[0]), *_tick_labels(box, has_x_labels=has_x_labels), *_words_within(box)]
    return replace(box, words=[token for token in words if token.text])


def _headings(panel: PlotPanel, width: float) -> Iterator[Words]:
    """Title, names of the curves and note above a panel."""
    yield Words(0.0, -5.0, panel.title, size=8.5, is_bold=True, kind="title")
    x = 8.5 * LETTER * len(panel.title) + 8.0
    for key in panel.keys:
        yield Words(x, -5.0, key.text, size=8.5, colour=key.colour, is_bold=True, kind="key")
        x += 8.5 * LETTER * (len(key.text) + 1)
    size = (width - x) / (LETTER * max(len(panel.note), 1))
    yield Words(width, -5.0, panel.note, min(7.5, max(size, SMALLEST_NOTE)), GREY, anchor="end", kind="note")


def _tick_labels(box: PlacedPanel, *, has_x_labels: bool) -> Iterator[Words]:
    """The numbers along both axes."""
    for value in box.y_ticks:
        y = float(box.down(value)) + 8.0 * MIDDLE
        yield Words(-TICK, y, number_text(value, box.panel.y), colour=GREY, anchor="end", kind="tick-y")
    for value in box.x_ticks if has_x_labels else ():
        y = box.height + TICK + 8.0 * ASCENT
        yield Words(float(box.across(value)), y, number_text(value, box.x), colour=GREY, anchor="middle", kind="tick-x")


def _words_within(box: PlacedPanel) -> Iterator[Words]:
    """Names of limits, and notes at points."""
    for item in box.panel.items:
        if isinstance(item, Note):
            x, y = float(box.across(item.x)) + item.moved[0], float(box.down(item.y)) - item.moved[1]
            yield Words(x, y + item.size * MIDDLE, item.text, item.size, item.colour, item.is_bold, item.anchor)
        elif isinstance(item, Limit) and item.is_vertical:
            yield Words(float(box.across(item.value)) + 3.0, 3.0 + 7.0 * ASCENT, item.label, 7.0, LIMIT)
        elif isinstance(item, Limit):
            moved = 2.0 + 7.0 * ASCENT if item.is_upper else -2.0 - 7.0 * DESCENT
            y = float(box.down(item.value)) + moved
            yield Words(box.width - 3.0, y, number_sign(item.label), 7.0, LIMIT, anchor="end")


def nice_ticks(axis: PlotAxis, count: int) -> list[float]:
    """About so many round numbers along an axis; powers of ten on a logarithmic one."""
    if axis.is_log:
        first, last = math.ceil(math.log10(axis.low) - 1e-9), math.floor(math.log10(axis.high) + 1e-9)
        return [10.0**k for k in range(first, last + 1, max(1, -(-(last - first) // MAX_DECADES)))]
    span = axis.high - axis.low
    if not span > 0.0:
        return [axis.low]
    rough = span / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if power * factor >= rough * (1 - 1e-9))
    first, last = math.ceil(axis.low / step - 1e-9), math.floor(axis.high / step + 1e-9)
    return [float(f"{k * step:.9g}") for k in range(first, last + 1)]


def number_text(value: float, axis: PlotAxis) -> str:
    """A number at an axis."""
    if axis.is_log:
        exponent = round(math.log10(value))
        return f"{value:g}" if -2 <= exponent <= 2 else f"10{str(exponent).translate(SUPERSCRIPTS)}"
    return number_sign(f"{value:g}")


def number_sign(text: str) -> str:
    """A text; if it is a number, with a minus sign in the place of a hyphen."""
    return text.replace("-", "−") if text.lstrip("-").replace(".", "", 1).isdigit() else text


def gaps(values: Array) -> list[tuple[int, int]]:
    """First and last + 1 of each stretch of finite values."""
    edges = np.diff(np.concatenate([[False], np.isfinite(values), [False]]).astype(int))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))
