"""A sheet as SVG: its marks are written down as they are, letters as text, which needs no plotting library."""

import math
import re
from html import escape
from itertools import chain
from typing import Final

from cellplan.report.palette import INK
from cellplan.report.sheets import FONT_SIZE, FONTS, WIDTH, Area, Line, Mark, Sheet, Words

POINTS: Final = 72.0  # [1/inch]
MARKER_EDGE: Final = 1.0  # [point] round a marker
ASCENT, DESCENT = 0.76, 0.236  # [-] of the size of the letters: highest above and lowest below the line they stand on
ANCHORS: Final = {"left": "start", "center": "middle", "right": "end"}
RISES: Final = {  # [-] of the size: how far the foot of the letters lies above the place of a text
    "baseline": 0.0,
    "bottom": DESCENT,
    "center": 0.5 * (DESCENT - ASCENT),
    "center_baseline": -0.5 * ASCENT,
    "top": -ASCENT,
}
LAYERS: Final = {Area: 1.0, Line: 2.0, Words: 3.0}  # where a mark says nothing, from back to front
NO_LETTER: Final = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # not allowed in XML


def svg(sheet: Sheet) -> bytes:
    """The sheet as a file of its own; its bytes depend on nothing but the sheet."""
    width, height = _number(POINTS * WIDTH), _number(POINTS * sheet.height)
    marks = sorted(sheet.marks, key=lambda mark: float(mark.look.get("zorder", LAYERS[type(mark)])))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}pt" height="{height}pt" viewBox="0 0 {width} {height}">'
    )
    style = f'font-family="{escape(FONTS)}" fill="none" stroke-linejoin="round" stroke-linecap="square"'
    ground = f'<rect width="{width}" height="{height}" fill="#ffffff"/>'
    lines = chain.from_iterable(_written(mark, POINTS * sheet.height) for mark in marks)
    return "\n".join(
        ['<?xml version="1.0" encoding="utf-8"?>', head, f"<g {style}>", ground, *lines, "</g>\n</svg>\n"]
    ).encode()


def _written(mark: Mark, height: float) -> list[str]:
    """A mark as elements; ``height`` of the sheet in points, because SVG counts downwards."""
    if isinstance(mark, Words):
        return [_text(mark, height)]
    if isinstance(mark, Area):
        x, y = POINTS * mark.corner[0], height - POINTS * (mark.corner[1] + mark.height)
        box = f'width="{_number(POINTS * mark.width)}" height="{_number(POINTS * mark.height)}"'
        return [f'<rect x="{_number(x)}" y="{_number(y)}" {box} fill="{mark.look["color"]}"/>']
    places = [(POINTS * x, height - POINTS * y) for x, y in zip(mark.x.tolist(), mark.y.tolist(), strict=True)]
    return _dots(mark, places) if "marker" in mark.look else [_path(mark, places)]


def _path(mark: Line, places: list[tuple[float, float]]) -> str:
    """Straight strokes from place to place; a place that is no number parts them."""
    steps, is_joined = [], False
    for x, y in places:
        if math.isfinite(x) and math.isfinite(y):
            steps.append(f"{'L' if is_joined else 'M'}{_number(x)} {_number(y)}")
            is_joined = True
        else:
            is_joined = False
    return f'<path d="{"".join(steps)}" stroke="{mark.look["color"]}" stroke-width="{mark.look["linewidth"]:g}"/>'


def _dots(mark: Line, places: list[tuple[float, float]]) -> list[str]:
    """A dot at every place that is one."""
    look = f'r="{_number(0.5 * (mark.look["markersize"] + MARKER_EDGE))}" fill="{mark.look["color"]}"'
    found = [(x, y) for x, y in places if math.isfinite(x) and math.isfinite(y)]
    return [f'<circle cx="{_number(x)}" cy="{_number(y)}" {look}/>' for x, y in found]


def _text(mark: Words, height: float) -> str:
    """A line of text."""
    look = mark.look
    size = float(look.get("size", FONT_SIZE))
    y = height - POINTS * mark.y - RISES[look.get("va", "baseline")] * size
    weight = ' font-weight="bold"' if look.get("weight") == "bold" else ""
    place = f'x="{_number(POINTS * mark.x)}" y="{_number(y)}" text-anchor="{ANCHORS[look.get("ha", "left")]}"'
    letters = escape(NO_LETTER.sub("\ufffd", mark.text), quote=False)
    return f'<text {place} font-size="{size:g}"{weight} fill="{look.get("color", INK)}">{letters}</text>'


def _number(value: float) -> str:
    """A length in points, to a hundredth."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
