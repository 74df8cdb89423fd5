"""Figures as data: panels with curves, limits, ranges and marks in printed units; nothing is placed or drawn here."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.plots.palette import INK

PADDING_FRACTION: Final = 0.06  # [-] of the range, left free above and below
WIDTH, ROW = 10.0, 1.75  # [inch] of a figure; from one row of panels to the next


@dataclass(frozen=True, slots=True, kw_only=True)
class PlotAxis:
    """What is measured along one side of a panel."""

    low: float  # value at its lower or left end
    high: float  # value at its upper or right end
    label: str = ""  # what it measures
    unit: str = ""  # unit of its values
    is_log: bool = False  # logarithmic; both ends are positive then, smaller values lie at the lower end
    is_time: bool = False  # whether it is the time of a motion in [s], which all figures of a page share

    def share(self, values: Array | float) -> Array:
        """Place of values between the two ends, from 0 to 1."""
        if self.is_log:
            decades = np.log10(self.high / self.low)
            return np.log10(np.maximum(values, self.low) / self.low) / decades
        return (np.asarray(values, dtype=float) - self.low) / (self.high - self.low)


def time_axis(times: Array) -> PlotAxis:
    """The axis of the time of a motion."""
    return PlotAxis(low=float(times[0]), high=float(times[-1]), label="time in s", unit="s", is_time=True)


def value_axis(low: float, high: float, *, unit: str = "", is_floored: bool = False) -> PlotAxis:
    """An axis for values with some room at its ends, but none below the smallest value where it is floored."""
    padding = PADDING_FRACTION * (high - low) or 1.0
    return PlotAxis(low=low if is_floored else low - padding, high=high + padding, unit=unit)


class PlotCurve(NamedTuple):
    """A polyline: its name, and its points, shape (K,) each; NaN interrupts it."""

    name: str
    x: Array
    y: Array
    colour: str = INK
    width: float = 1.3
    is_dashed: bool = False


class Limit(NamedTuple):
    """A line at a limit, with the forbidden range beyond it shaded where it has one."""

    value: float  # the limit
    label: str = ""  # text at its right end
    is_upper: bool = True  # whether values above it are forbidden, otherwise those below
    is_shaded: bool = True  # whether the forbidden range is shaded
    is_vertical: bool = False  # whether it limits the values along the x axis


class PlotMark(NamedTuple):
    """A point of note, such as the worst instant: a dot or a star, with an edge where that has a colour."""

    x: float
    y: float
    colour: str = INK
    size: float = 3.8
    edge: str = ""
    is_star: bool = False


class PlotBox(NamedTuple):
    """A filled rectangle: a bar, a place, an area that is swept."""

    x: tuple[float, float]
    y: tuple[float, float]
    colour: str
    opacity: float = 1.0


class Note(NamedTuple):
    """A word at a point, moved by so many points to the right and up."""

    x: float
    y: float
    text: str
    colour: str = INK
    size: float = 8.0
    is_bold: bool = False
    anchor: str = "middle"
    moved: tuple[float, float] = (0.0, 0.0)


def line(points: Any, *, colour: str, width: float, is_dashed: bool = False) -> PlotCurve:
    """A line through points of the plane, shape (K, 2)."""
    x, y = np.array(points, dtype=float).reshape(-1, 2).T
    return PlotCurve("", x, y, colour, width, is_dashed)


def outline(points: Any, *, colour: str, width: float, is_dashed: bool = False) -> PlotCurve:
    """A closed line through points of the plane, shape (K, 2)."""
    return line([*points, points[0]], colour=colour, width=width, is_dashed=is_dashed)


Item = PlotCurve | Limit | PlotMark | PlotBox | Note


class LegendKey(NamedTuple):
    """An entry of a legend: a text with the colour that it explains, or a text alone."""

    text: str
    colour: str = ""
    is_bold: bool = False
    ink: str = ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlotPanel:
    """One pair of axes."""

    title: str  # text at its upper left
    y: PlotAxis  # its upward axis
    items: Sequence[Item]  # what it shows, in the order in which it is drawn
    note: str = ""  # small text at its upper right
    keys: Sequence[LegendKey] = ()  # names of its curves in their colours, at its upper right


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Figure:
    """Panels that share the axis along them."""

    title: str  # text above the panels
    x: PlotAxis  # their axis from left to right
    panels: Sequence[PlotPanel]  # the panels, row by row
    columns: int = 1  # number of panels in a row
    width: float = WIDTH  # width of the figure in [inch]
    row: float = ROW  # height of a row of panels in [inch]
    is_plane: bool = False  # both axes are lengths in one scale, seen from above: a frame with ticks, no grid
    legend: Sequence[LegendKey] = ()  # texts to the right of the panels
    is_exact: bool = False  # whether its colours are data, and stay as they are on a dark page
    text: str = ""  # what the figure shows, for those who do not see it
