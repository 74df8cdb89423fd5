"""Sheets as SVG text, without the plotting library: for pages that are to be there at once."""

import math
from collections.abc import Iterator, Mapping
from html import escape
from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.plots.palette import INK
from cellplan.report.plots.sheet import Line, Mark, Rectangle, Sheet

POINTS: Final = 72.0  # [1/inch]
SIZE: Final = 8.0  # [point] of text
ORDER: Final = {Line: 2.0, Rectangle: 1.0}  # in which marks without an order of their own are drawn
ANCHORS: Final = {"left": "start", "center": "middle", "right": "end"}
RISES: Final = {
    "top": 0.76,
    "center": 0.36,
    "center_baseline": 0.36,
    "bottom": -0.2,
    "baseline": 0.0,
}  # [-] of its size
STAR: Final = tuple(((1.0, 0.4)[k % 2], np.pi * (0.5 + k / 5.0)) for k in range(10))  # radius and angle of its corners


def svg_text(sheet: Sheet) -> str:
    """A sheet as SVG; its lengths are in points.

    Args:
        sheet: The sheet.
    """
    width, height = POINTS * sheet.width, POINTS * sheet.height
    marks = sorted(sheet.marks, key=lambda mark: float(mark.style.get("zorder", ORDER.get(type(mark), 3.0))))
    body = "\n".join(part for mark in marks for part in _drawn(mark, height))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" '
        f'font-family="DejaVu Sans, Verdana, Helvetica, Arial, sans-serif">\n{body}\n</svg>\n'
    )


def _drawn(mark: Mark, height: float) -> Iterator[str]:
    """The elements of one mark."""
    if isinstance(mark, Line):
        points = np.stack([POINTS * np.asarray(mark.x, float), height - POINTS * np.asarray(mark.y, float)], axis=-1)
        yield from _line(points.reshape(-1, 2), mark.style)
        yield from _markers(points.reshape(-1, 2), mark.style)
    elif isinstance(mark, Rectangle):
        x, y = POINTS * mark.corner[0], height - POINTS * (mark.corner[1] + mark.height)
        box = f'x="{x:.2f}" y="{y:.2f}" width="{POINTS * mark.width:.2f}" height="{POINTS * mark.height:.2f}"'
        yield f'<rect {box} fill="{mark.style["color"]}"{_alpha(mark.style, "fill")}/>'
    else:
        size = float(mark.style.get("size", SIZE))
        rise = RISES[mark.style.get("va", "baseline")] * size
        weight = ' font-weight="bold"' if mark.style.get("weight") == "bold" else ""
        place = f'x="{POINTS * mark.x:.2f}" y="{height - POINTS * mark.y + rise:.2f}" font-size="{size:g}"'
        anchor = ANCHORS[mark.style.get("ha", "left")]
        yield (
            f'<text {place} fill="{mark.style.get("color", INK)}" text-anchor="{anchor}"{weight}>'
            f"{escape(mark.text)}</text>"
        )


def _line(points: Array, style: Mapping[str, Any]) -> Iterator[str]:
    """A line with gaps as one path; nothing where there are markers only."""
    if style.get("linestyle") == "none":
        return
    steps, is_down = [], False
    for x, y in points.tolist():
        if not math.isfinite(x + y):
            is_down = False
            continue
        steps.append(f"{'L' if is_down else 'M'}{x:.2f} {y:.2f}")
        is_down = True
    width = float(style.get("linewidth", 1.0))
    dashes = ' stroke-dasharray="4 3"' if style.get("linestyle") == "--" else ""
    path = "".join(steps)
    yield f'<path d="{path}" fill="none" stroke="{style["color"]}" stroke-width="{width:g}"{dashes}/>'


def _markers(points: Array, style: Mapping[str, Any]) -> Iterator[str]:
    """Its markers: dots or stars."""
    if "marker" not in style:
        return
    radius, edge = 0.5 * float(style["markersize"]), style.get("markeredgecolor", style["color"])
    colours = f'fill="{style["color"]}" stroke="{edge}" stroke-width="{float(style.get("markeredgewidth", 0.6)):g}"'
    for x, y in points.tolist():
        if style["marker"] == "*":
            corners = " ".join(f"{x + radius * r * np.cos(a):.2f},{y - radius * r * np.sin(a):.2f}" for r, a in STAR)
            yield f'<polygon points="{corners}" {colours}/>'
        else:
            yield f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:g}" {colours}/>'


def _alpha(style: Mapping[str, Any], kind: str) -> str:
    """How transparent it is."""
    return f' {kind}-opacity="{float(style["alpha"]):g}"' if "alpha" in style else ""
