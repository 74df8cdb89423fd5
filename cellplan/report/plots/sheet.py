"""Figure layout: grids of small panels as drawing primitives in inches; rendering is done by ``canvas``.

A sheet does not depend on the plotting library: it is small, can be sent to another process, and is equal for equal
data.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.plots.palette import FORBIDDEN, GREY, INK, LIMIT

GRID: Final = "#e3e7ec"
FRAME: Final = "#aeb7c2"

CURVE_POINTS: Final = 600  # [-] about one point per pixel: more would only enlarge the files

WIDTH: Final = 10.0  # [inch] of a sheet; the lengths below are in inches as well
ROW: Final = 1.75
HEAD, FOOT = 0.42, 0.3
LEFT, RIGHT, GAP = 0.58, 0.15, 0.6
PANEL_TITLE: Final = 0.32  # above each panel
PADDING_FRACTION: Final = 0.06  # [-] of the range, left free above and below


class Line(NamedTuple):
    """A polyline in inches, shape (K,) each; NaN interrupts it."""

    x: Array
    y: Array
    style: Mapping[str, Any]


class Rectangle(NamedTuple):
    """A filled rectangle: its lower left corner, width and height in inches."""

    corner: tuple[float, float]
    width: float
    height: float
    style: Mapping[str, Any]


class Label(NamedTuple):
    """A line of text at a position in inches."""

    x: float
    y: float
    text: str
    style: Mapping[str, Any]


Mark = Line | Rectangle | Label


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """One pair of axes: its box in inches; times ``first`` to ``last`` in [s], values ``low`` to ``high``."""

    left: float
    bottom: float
    width: float
    height: float
    first: float
    last: float
    low: float
    high: float

    def x(self, times: Array) -> Array:
        """Horizontal position of times on the sheet in inches."""
        return self.left + self.width * (times - self.first) / (self.last - self.first)

    def y(self, values: Array) -> Array:
        """Vertical position of values on the sheet in inches."""
        return self.bottom + self.height * (values - self.low) / (self.high - self.low)


class Sheet:
    """A grid of panels that share the time axis; lengths are in inches from the lower left corner.

    Attributes:
        height: Of the sheet in inches.
        width: Likewise.
        marks: Drawing primitives, in drawing order.
        times: Times in [s] that the panels show.
    """

    def __init__(
        self,
        title: str,
        *,
        rows: int,
        columns: int,
        times: Array,
        across: str = "time in s",
        width: float = WIDTH,
    ) -> None:
        """Create a grid of panels over ``times`` in [s], or over the quantity that ``across`` names."""
        self.width = width
        self.rows, self.columns, self.times, self.across = rows, columns, times, across
        self.height = HEAD + rows * ROW + FOOT
        self.marks: list[Mark] = []
        self.write(0.12, self.height - 0.2, title, size=10.5, weight="bold", va="center")

    def panel(
        self, index: int, title: str, *, note: str = "", span: tuple[float, float], is_floored: bool = False
    ) -> Panel:
        """Draw an empty panel with its grid and round numbers.

        Args:
            index: Place in the grid, counted by rows.
            title: What is shown, with its unit.
            note: Small text at the upper right.
            span: Smallest and largest value to show.
            is_floored: Whether the lower edge is the smallest value itself, without padding.
        """
        row, column = divmod(index, self.columns)
        width = (self.width - LEFT - RIGHT - (self.columns - 1) * GAP) / self.columns
        low, high = span
        padding = PADDING_FRACTION * (high - low) or 1.0
        panel = Panel(
            left=LEFT + column * (width + GAP),
            bottom=FOOT + (self.rows - 1 - row) * ROW + 0.12,
            width=width,
            height=ROW - PANEL_TITLE - 0.12,
            first=float(self.times[0]),
            last=float(self.times[-1]),
            low=low if is_floored else low - padding,
            high=high + padding,
        )
        is_lowest = row == self.rows - 1
        self._draw_frame(panel, nice_ticks(low, high, 4), with_times=is_lowest)
        top = panel.bottom + panel.height + 0.07
        self.write(panel.left, top, title, size=8.5, weight="bold")
        self.write(panel.left + width, top, note, size=7.5, color=GREY, ha="right")
        if is_lowest and column == self.columns - 1:
            self.write(panel.left + width, 0.1, self.across, color=GREY, ha="right")
        return panel

    def curve(self, panel: Panel, times: Array, values: Array, *, colour: str, width: float = 1.3) -> None:
        """Draw a curve, thinned so that every peak is kept."""
        kept = peaks_kept(values)
        self._line(panel.x(times[kept]), panel.y(values[kept]), color=colour, linewidth=width)

    def dot(self, panel: Panel, at_s: float, value: float, *, colour: str = INK) -> None:
        """Mark one value."""
        x, y = panel.x(np.array([at_s])), panel.y(np.array([value]))
        self._line(x, y, color=colour, marker="o", markersize=3.8, linestyle="none")

    def bar(self, panel: Panel, across: tuple[float, float], value: float, *, colour: str) -> None:
        """Fill the area between the lower edge of a panel and a value."""
        left, right = panel.x(np.array(across))
        height = float(panel.y(np.array([value]))[0]) - panel.bottom
        style = {"color": colour, "linewidth": 0, "zorder": 2.0}
        self.marks.append(Rectangle((float(left), panel.bottom), float(right - left), height, style))

    def limit(self, panel: Panel, value: float, *, label: str = "", is_upper: bool = True) -> None:
        """Draw a limit across the panel and shade the forbidden range beyond it."""
        y = float(panel.y(np.array([value]))[0])
        edge = panel.bottom + panel.height if is_upper else panel.bottom
        style = {"color": FORBIDDEN, "linewidth": 0, "zorder": 0.5}
        self.marks.append(Rectangle((panel.left, min(y, edge)), panel.width, abs(edge - y), style))
        right = panel.left + panel.width
        self._line(np.array([panel.left, right]), np.array([y, y]), color=LIMIT, linewidth=1.0)
        side = "top" if is_upper else "bottom"
        self.write(right - 0.04, y - 0.03 if is_upper else y + 0.03, label, size=7, color=LIMIT, ha="right", va=side)

    def write(self, x: float, y: float, text: str, **style: Any) -> None:
        """Write a line of text at a position on the sheet."""
        if text:
            self.marks.append(Label(x, y, text.replace("-", "−") if _is_number(text) else text, style))

    def _draw_frame(self, panel: Panel, ticks: Sequence[float], *, with_times: bool) -> None:
        """Grid lines at round numbers, the two axis lines, and the numbers."""
        left, right = panel.left, panel.left + panel.width
        bottom, top = panel.bottom, panel.bottom + panel.height
        times = nice_ticks(panel.first, panel.last, 5)
        xs, ys = panel.x(np.array(times)), panel.y(np.array(ticks))
        self._lines([((x, bottom), (x, top)) for x in xs] + [((left, y), (right, y)) for y in ys], GRID, order=1.0)
        self._lines([((left, top), (left, bottom)), ((left, bottom), (right, bottom))], FRAME, order=3.0)
        for y, value in zip(ys, ticks, strict=True):
            self.write(left - 0.05, float(y), f"{value:g}", color=GREY, ha="right", va="center_baseline")
        for x, value in zip(xs, times, strict=True):
            if with_times:
                self.write(float(x), bottom - 0.06, f"{value:g}", color=GREY, ha="center", va="top")

    def _lines(
        self, segments: list[tuple[tuple[float, float], tuple[float, float]]], colour: str, *, order: float
    ) -> None:
        """Straight segments as one polyline with gaps."""
        points = np.array([[*segment, (np.nan, np.nan)] for segment in segments]).reshape(-1, 2)
        self._line(points[:, 0], points[:, 1], color=colour, linewidth=0.8, zorder=order)

    def _line(self, x: Array, y: Array, **style: Any) -> None:
        self.marks.append(Line(x, y, style))


def peaks_kept(values: Array, points: int = CURVE_POINTS) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Indices of about ``points`` samples, among them the first, the last, and the extremes of every interval."""
    n = len(values)
    if n <= points:
        return np.arange(n)
    length = math.ceil(2 * n / points)
    whole = n // length * length
    stretches = values[:whole].reshape(-1, length)
    starts = np.arange(0, whole, length)
    rest = np.arange(whole, n)
    ends = rest[[np.argmin(values[rest]), np.argmax(values[rest])]] if len(rest) else rest
    lows, highs = starts + stretches.argmin(axis=1), starts + stretches.argmax(axis=1)
    return np.unique(np.concatenate([[0], lows, highs, ends, [n - 1]]))


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """About ``count`` round numbers from ``low`` to ``high``."""
    span = high - low
    if not span > 0.0:
        return [low]
    rough = span / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 2.5, 5.0, 10.0) if power * factor >= rough * (1 - 1e-9))
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [float(f"{k * step:.9g}") for k in range(first, last + 1)]


def _is_number(text: str) -> bool:
    """Whether a text is a number, whose hyphen should then read as a minus sign."""
    return text.lstrip("-").replace(".", "", 1).isdigit()
