"""Sheets of small plots in the form of the papers; the same curves give the same bytes."""

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from numpy.typing import NDArray

from reproduction.runs import Array

IMAGES = Path(__file__).resolve().parent.parent / "images" / "reproduction"
COLOURS = ("#2f6fab", "#c8642b", "#4c8f5b", "#8a5aa5", "#d6a03b", "#c03a4b")
STYLES = ("-", "--", ":", "-.", "-", "--")
GREY = "#8a8a8a"
MOST_POINTS = 1500  # of a curve: more than a screen shows
LEGEND_ROOM = 0.17  # [-] of the height of a plot
PANEL = (4.3, 3.0)  # [inch] width and height of one plot
COORDINATES = re.compile(r' (?:d|x|y)="[^"]*"')  # attributes of an SVG that hold coordinates
COORDINATE = re.compile(r"-?\d+\.\d+")

mpl.use("svg")
mpl.rcParams.update(
    {
        "svg.hashsalt": "cellplan",  # the same drawing gives the same bytes
        "svg.fonttype": "path",
        "font.family": "DejaVu Sans",
        "mathtext.fontset": "dejavusans",
        "font.size": 9,
        "axes.titlesize": 9.5,
        "axes.grid": True,
        "grid.color": "#e4e4e4",
        "axes.axisbelow": True,
        "lines.linewidth": 1.3,
        "legend.fontsize": 8,
        "legend.framealpha": 0.9,
    }
)


class Sheet:
    """A grid of plots on one sheet."""

    def __init__(self, rows: int, columns: int) -> None:
        """Prepare an empty grid."""
        self._figure, grid = plt.subplots(
            rows, columns, figsize=(PANEL[0] * columns, PANEL[1] * rows), squeeze=False, layout="constrained"
        )
        self._free = list(grid.flat)

    def panel(self, title: str, x: str, y: str) -> Axes:
        """The next plot of the grid."""
        axes = self._free.pop(0)
        axes.set(title=title, xlabel=x, ylabel=y)
        return axes

    def save(self, name: str) -> None:
        """Write the sheet without a date in it."""
        for axes in self._free:
            axes.axis("off")
        IMAGES.mkdir(parents=True, exist_ok=True)
        text = io.StringIO()
        self._figure.savefig(text, metadata={"Date": None, "Creator": "docs/make_reproduction.py"})
        (IMAGES / f"{name}.svg").write_text(shortened(text.getvalue()), encoding="utf-8")
        plt.close(self._figure)


def shortened(drawing: str) -> str:
    """An SVG with coordinates to a hundredth of a point: less is rounding, and differs between processors."""

    def short(number: re.Match[str]) -> str:
        return f"{round(float(number[0]), 2) + 0.0:.2f}".rstrip("0").rstrip(".")

    return COORDINATES.sub(lambda attribute: COORDINATE.sub(short, attribute[0]), drawing)


def draw(axes: Axes, x: Array, curves: Mapping[str, Array], **words: Any) -> None:
    """Several curves over one axis, thinned to what a screen shows, with a legend.

    A stretch of samples is drawn by its smallest and its largest value, so that no peak is lost.
    """
    for (name, y), colour, style in zip(curves.items(), COLOURS, STYLES, strict=False):
        keep = extremes(y)
        axes.plot(x[keep], y[keep], style, color=colour, label=name, **words)
    if len(curves) > 1:
        axes.legend()


def draw_joints(axes: Axes, x: Array, values: Array, names: Sequence[str]) -> None:
    """One curve per joint, with room for the legend above all of them."""
    draw(axes, x, dict(zip(names, values.T, strict=True)))
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + LEGEND_ROOM * (high - low))
    axes.legend(loc="upper center", ncols=len(names), columnspacing=1.2, handlelength=1.6)


def path_curve(axes: Axes, desired: Array, actual: Mapping[str, Array]) -> None:
    """Paths in a plane, the desired one in grey below them, to one scale."""
    every = max(1, len(desired) // MOST_POINTS)
    axes.plot(*desired[::every].T, color=GREY, linewidth=2.6, label="reference")
    for (name, path), colour, style in zip(actual.items(), COLOURS, STYLES, strict=False):
        axes.plot(*path[::every].T, style, color=colour, label=name)
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend()


def extremes(y: Array) -> NDArray[np.intp]:
    """Indices of the smallest and the largest value in each stretch, and both ends."""
    if len(y) <= MOST_POINTS:
        return np.arange(len(y))
    stretches = np.array_split(np.arange(len(y)), MOST_POINTS // 2)
    filled = np.nan_to_num(y)
    results = {0, len(y) - 1}
    for stretch in stretches:
        results |= {int(stretch[np.argmin(filled[stretch])]), int(stretch[np.argmax(filled[stretch])])}
    return np.array(sorted(results))
