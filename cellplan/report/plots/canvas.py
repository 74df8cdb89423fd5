"""Rendering of figures as PNG and PDF in one style; the bytes depend on the figures alone.

The layout is the one of the SVG files: the axes of the plotting library would take longer for another picture.
"""

import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

import numpy as np

from cellplan.report.plots.figure import Figure, Limit, PlotBox, PlotCurve, PlotMark
from cellplan.report.plots.palette import FORBIDDEN, FRAME, GREY, GRID, INK, LIMIT
from cellplan.report.plots.placing import INCH, SWATCH, TICK, PlacedFigure, PlacedPanel, Words, placed

VARIABLE: Final = "MPLBACKEND"  # a shell started by a notebook may name a backend that is not installed


@contextmanager
def no_backend() -> Iterator[None]:
    """Allow the library to be imported although the environment names an unknown backend.

    The environment and the choice of a known backend are restored afterwards, for a calling program that opens windows.
    """
    desired = None if "matplotlib" in sys.modules else os.environ.pop(VARIABLE, None)
    try:
        yield
    finally:
        if desired is not None:
            os.environ[VARIABLE] = desired
    if desired:
        with suppress(ValueError):
            sys.modules["matplotlib"].rcParams["backend"] = desired


with no_backend():
    import matplotlib as mpl
    from matplotlib import patches
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure as Canvas
    from matplotlib.lines import Line2D
    from matplotlib.text import Text
    from matplotlib.transforms import Affine2D


DPI = 110  # [1/inch] of the PNG files
_STYLE: Any = {
    "pdf.fonttype": 42,
    "text.parse_math": False,  # names may hold a dollar sign
    "text.hinting": "none",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Helvetica", "Arial"],
    "font.size": 8.0,
    "text.color": INK,
    "lines.solid_joinstyle": "round",
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}
_OPTIONS: dict[str, dict[str, Any]] = {
    "png": {"dpi": DPI, "metadata": {"Software": None}, "pil_kwargs": {"compress_level": 1}},  # quick; a twelfth larger
    "pdf": {"metadata": {"Creator": None, "Producer": None, "CreationDate": None}},
}
_ANCHORS = {"start": "left", "middle": "center", "end": "right"}


@contextmanager
def style() -> Iterator[None]:
    """The style of cellplan's plots within a ``with`` statement, whatever the user's own settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def paint(figure: Figure, kind: str) -> bytes:
    """A figure as PNG or PDF, without date and program name."""
    layout, buffer = placed(figure), io.BytesIO()
    with style():
        canvas = Canvas(figsize=(layout.width / INCH, layout.height / INCH))
        flipped = Affine2D().scale(1.0, -1.0).translate(0.0, layout.height).scale(1.0 / INCH)
        in_points = flipped + canvas.dpi_scale_trans
        for artist, frame in _artists(layout):
            artist.set_transform(in_points)
            canvas.add_artist(artist)
            if frame is not None:
                corner = (frame.left, frame.top)
                artist.set_clip_path(patches.Rectangle(corner, frame.width, frame.height, transform=in_points))
        canvas.savefig(buffer, format=kind, **_OPTIONS[kind])
    return buffer.getvalue()


def _artists(layout: PlacedFigure) -> Iterator[tuple[Artist, PlacedPanel | None]]:
    """Everything in a figure, and the panel at whose frame it is cut off, if any."""
    is_plane = layout.figure.is_plane
    for x, y, colour in layout.swatches:
        yield patches.Rectangle((x, y), *SWATCH, color=colour, linewidth=0), None
    for box in layout.panels:
        for artist in _panel(box, is_plane=is_plane):
            yield artist, None
        for place, item in enumerate(box.panel.items):
            for artist in _item(box, item, 2.0 + 1e-3 * place):
                yield artist, box if is_plane else None
        for words in box.words:
            yield _text(words._replace(x=words.x + box.left, y=words.y + box.top)), None
    for words in layout.words:
        yield _text(words), None


def _panel(box: PlacedPanel, *, is_plane: bool) -> Iterator[Artist]:
    """Forbidden ranges, grid and frame of a panel."""
    for item in box.panel.items:
        if isinstance(item, Limit) and item.is_shaded and not item.is_vertical:
            at = float(np.clip(box.down(item.value), 0.0, box.height))
            top, bottom = (0.0, at) if item.is_upper else (at, box.height)
            corner = (box.left, box.top + top)
            yield patches.Rectangle(corner, box.width, bottom - top, color=FORBIDDEN, linewidth=0, zorder=0.5)
    for value in () if is_plane else box.x_ticks:
        yield _line(box, np.full(2, box.across(value)), np.array([0.0, box.height]), color=GRID, zorder=1.0)
    for value in () if is_plane else box.y_ticks:
        yield _line(box, np.array([0.0, box.width]), np.full(2, box.down(value)), color=GRID, zorder=1.0)
    colour = GREY if is_plane else FRAME
    corners = [(0.0, 0.0), (0.0, box.height), (box.width, box.height)]
    corners += [(box.width, 0.0), (0.0, 0.0)] if is_plane else []
    yield _line(box, *np.array(corners).T, color=colour, zorder=4.0)
    for value in box.x_ticks if is_plane else ():
        yield _line(box, np.full(2, box.across(value)), box.height + np.array([0.0, TICK]), color=colour)
    for value in box.y_ticks if is_plane else ():
        yield _line(box, np.array([-TICK, 0.0]), np.full(2, box.down(value)), color=colour)


def _line(box: PlacedPanel, x: Any, y: Any, **pen: Any) -> Line2D:
    return Line2D(box.left + np.asarray(x), box.top + np.asarray(y), **{"linewidth": 0.8, **pen})


def _item(box: PlacedPanel, item: object, order: float) -> Iterator[Artist]:
    """One item of a panel but for its words."""
    if isinstance(item, PlotCurve):
        dashes = {"linestyle": (0, (4 / item.width, 3 / item.width))} if item.is_dashed else {}
        x, y = box.across(np.asarray(item.x)), box.down(np.asarray(item.y))
        yield _line(box, x, y, color=item.colour, linewidth=item.width, zorder=order, **dashes)
    elif isinstance(item, PlotMark):
        pen = {"marker": "*" if item.is_star else "o", "markersize": item.size, "linestyle": "none"}
        pen |= {"color": item.colour, "markeredgecolor": item.edge or item.colour, "markeredgewidth": 0.6}
        yield _line(box, [box.across(item.x)], [box.down(item.y)], zorder=order, **pen)
    elif isinstance(item, PlotBox):
        (left, right), (bottom, top) = box.across(np.array(item.x)).tolist(), box.down(np.array(item.y)).tolist()
        corner, size = (box.left + left, box.top + top), (right - left, bottom - top)
        fill: dict[str, Any] = {"color": item.colour, "alpha": item.opacity, "linewidth": 0, "antialiased": False}
        yield patches.Rectangle(corner, *size, zorder=order, **fill)
    elif isinstance(item, Limit):
        at = np.full(2, box.across(item.value) if item.is_vertical else box.down(item.value))
        along = np.array([0.0, box.height if item.is_vertical else box.width])
        ends = (at, along) if item.is_vertical else (along, at)
        yield _line(box, *ends, color=LIMIT, linewidth=1.0, zorder=order)


def _text(words: Words) -> Text:
    weight = "bold" if words.is_bold else "normal"
    anchor = _ANCHORS[words.anchor]
    return Text(words.x, words.y, words.text, size=words.size, color=words.colour, weight=weight, ha=anchor, zorder=5.0)
