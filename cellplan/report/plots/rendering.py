"""Figures as files: SVG written here, PNG and PDF by the plotting library where they are requested."""

from collections.abc import Collection, Mapping
from typing import Final

from cellplan.errors import InputError
from cellplan.report.plots.figure import Figure
from cellplan.report.plots.svg import svg_text

FORMATS: Final = ("png", "pdf")  # that may be requested beside SVG


def pictures(figures: Mapping[str, Figure], formats: Collection[str] = ()) -> dict[str, bytes]:
    """Every figure as SVG and in the requested formats, by file name.

    Raises:
        InputError: A format is unknown, or needs the plotting library, which is not installed.
    """
    require_formats(formats)
    files = {f"{name}.svg": svg_text(figure).encode() for name, figure in figures.items()}
    if formats:
        from cellplan.report.plots.canvas import paint

        kinds = sorted({*formats})
        files |= {f"{name}.{kind}": paint(figure, kind) for name, figure in figures.items() for kind in kinds}
    return files


def require_formats(formats: Collection[str]) -> None:
    """Refuse formats that are not known."""
    for name in formats:
        if name not in FORMATS:
            raise InputError(f"plots: expected one of {', '.join(FORMATS)}, got '{name}' (SVG is always written)")
