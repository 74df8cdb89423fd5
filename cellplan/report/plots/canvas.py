"""Rendering of sheets as PNG and PDF in one style; the bytes depend on the sheets alone.

The drawing primitives are rendered directly: the axes of the plotting library would take three times as long for the
same picture.
"""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from cellplan.report.plots.no_backend import no_backend
from cellplan.report.plots.palette import INK
from cellplan.report.plots.sheet import Line, Mark, Rectangle, Sheet

with no_backend():
    import matplotlib as mpl
    from matplotlib import patches
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.text import Text

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


@contextmanager
def style() -> Iterator[None]:
    """The style of cellplan's plots within a ``with`` statement, whatever the user's own settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def paint(sheet: Sheet, kind: str) -> bytes:
    """A sheet as PNG or PDF, without date and program name.

    Args:
        sheet: The sheet.
        kind: Name of the format.
    """
    buffer = io.BytesIO()
    with style():
        _figure(sheet).savefig(buffer, format=kind, **_OPTIONS[kind])
    return buffer.getvalue()


def _figure(sheet: Sheet) -> Figure:
    """A sheet as a figure of the plotting library."""
    figure = Figure(figsize=(sheet.width, sheet.height))
    for mark in sheet.marks:
        artist = _artist(mark)
        artist.set_transform(figure.dpi_scale_trans)
        figure.add_artist(artist)
    return figure


def _artist(mark: Mark) -> Artist:
    """A drawing primitive as an artist of the plotting library."""
    if isinstance(mark, Line):
        return Line2D(mark.x, mark.y, **mark.style)
    if isinstance(mark, Rectangle):
        return patches.Rectangle(mark.corner, mark.width, mark.height, **mark.style)
    return Text(mark.x, mark.y, mark.text, **mark.style)
