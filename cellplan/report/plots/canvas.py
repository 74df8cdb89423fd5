"""Canvas: sheets painted as SVG and PNG, in one look; the bytes depend on nothing but the sheets.

The marks are painted as they are: the general-purpose axes of the plotting library would take three times as long to
show the same picture.
"""

import io
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from cellplan.report.plots.no_backend import no_backend
from cellplan.report.plots.palette import INK
from cellplan.report.plots.sheet import WIDTH, Area, Line, Mark, Sheet

with no_backend():
    import matplotlib as mpl
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle
    from matplotlib.text import Text

DPI = 110  # [1/inch] of the PNG files

_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "cellplan",
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
_METADATA: dict[str, dict[str, None]] = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
_OPTIONS: dict[str, dict[str, Any]] = {
    "svg": {},
    "png": {"dpi": DPI, "pil_kwargs": {"compress_level": 1}},
}  # quick; files a twelfth larger


@contextmanager
def style() -> Iterator[None]:
    """The look of cellplan's plots for as long as the ``with`` statement lasts, whatever the user's own settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        yield


def paint(sheets: Mapping[str, Sheet]) -> dict[str, bytes]:
    """Every sheet as SVG and PNG, by file name; no date and no program name in them."""
    files: dict[str, bytes] = {}
    with style():
        for name, sheet in sheets.items():
            figure = _figure(sheet)
            for kind, options in _OPTIONS.items():
                buffer = io.BytesIO()
                figure.savefig(buffer, format=kind, metadata=_METADATA[kind], **options)
                files[f"{name}.{kind}"] = buffer.getvalue()
    return files


def _figure(sheet: Sheet) -> Figure:
    """The marks of a sheet as artists, in their order."""
    figure = Figure(figsize=(WIDTH, sheet.height))
    for mark in sheet.marks:
        artist = _artist(mark)
        artist.set_transform(figure.dpi_scale_trans)
        figure.add_artist(artist)
    return figure


def _artist(mark: Mark) -> Artist:
    """What the plotting library makes of a mark."""
    if isinstance(mark, Line):
        return Line2D(mark.x, mark.y, **mark.look)
    if isinstance(mark, Area):
        return Rectangle(mark.corner, mark.width, mark.height, **mark.look)
    return Text(mark.x, mark.y, mark.text, **mark.look)
