"""The sheet of a picture of an instant as SVG text: heading, floor, cell, names and an enlarged detail."""

import textwrap
from html import escape
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import bounding_box
from cellplan.report.record.common import shortened
from cellplan.report.still.camera import Camera, framed
from cellplan.report.still.detail import DetailWindow, detail, is_worth_it, mark
from cellplan.report.still.floor import floor_paths, shadow_path
from cellplan.report.still.painter import Painter
from cellplan.report.still.picture import StillPicture
from cellplan.report.still.shading import rules
from cellplan.report.still.style import DARK, STYLE
from cellplan.report.still.view import best_axes

WIDTH, HEIGHT = 7200, 4600  # units of the sheet: tenths of a pixel, so that places are whole numbers
MARGIN: Final = 220
TITLE, LINE = 390, 215  # down to the title, and from one line to the next
TITLE_SIZE, SMALLEST_TITLE = 235, 120  # height of its letters, and that of long titles
LETTER: Final = 0.68  # [-] width of a letter by its height, in a wide bold type
WIDE_LETTER: Final = 0.8  # [-] the same of capital letters
NAME_SIZE, LONGEST_NAME = 165, 20  # height of the letters of names, and how many of them are shown
NAME_BELOW: Final = 200  # from a foot down to the name of its robot
DETAIL: Final = 2000  # edge of the enlarged detail
GAP: Final = 160  # beside it


def still_svg(picture: StillPicture) -> str:
    """A picture as the text of an SVG element that stands alone or in a page; equal pictures give equal text."""
    camera, window = _framing(picture)
    painter = Painter(camera, np.zeros(2), np.array([WIDTH, HEIGHT]))
    body = painter.paths(picture.solids, picture.lines)
    enlarged = "" if window is None else detail(picture, camera, window, painter.classes)
    used = [(name, picture.materials[key], tone) for (key, tone), name in painter.classes.items()]
    light, dark = rules(".still-sheet", used)
    parts = [
        f'<svg class="still-sheet" xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
        'aria-labelledby="still-title still-desc">',
        f'<title id="still-title">{escape(picture.title)}</title>',
        f'<desc id="still-desc">{escape(_described(picture))}</desc>',
        f"<style>{STYLE}{light}\n@media screen and (prefers-color-scheme: dark) {{{DARK}{dark}\n}}</style>",
        f'<rect class="sheet" width="{WIDTH}" height="{HEIGHT}" rx="80"/>',
        '<g class="bad">' if picture.is_bad else "<g>",
        _floor(picture, camera),
        body,
        _names(picture, camera),
        enlarged or mark(picture, camera),
        _heading(picture),
        "</g>",
        "</svg>\n",
    ]
    return "\n".join(part for part in parts if part)


def _framing(picture: StillPicture) -> tuple[Camera, DetailWindow | None]:
    """The camera, and the place of an enlarged detail where it shows more."""
    low = np.array([MARGIN, TITLE + LINE * len(picture.notes) + GAP])
    high = np.array([WIDTH - MARGIN, HEIGHT - NAME_BELOW - 100])
    points = _corners(picture)
    narrow = high - (DETAIL + GAP, 0)
    size = narrow - low
    axes = best_axes(picture, float(size[0] / size[1]))
    framing = framed(axes, points, low=low, high=narrow)
    if is_worth_it(picture, framing, DETAIL):
        return framing, DetailWindow(x=WIDTH - MARGIN - DETAIL, y=round(float(low[1])), edge=DETAIL)
    return framed(axes, points, low=low, high=high), None


def _described(picture: StillPicture) -> str:
    """What is on the picture, in words."""
    names = ", ".join(name.text for name in picture.names)
    return " ".join([*(f"{note}." for note in picture.notes), f"Robots: {names}." if names else ""]).strip()


def _corners(picture: StillPicture) -> Array:
    """Corners of the boxes round all solids and the points of all lines, shape (N, 3)."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    points = [line.points for line in picture.lines]
    for solid in picture.solids:
        middle, half = bounding_box(solid.shape)
        points.append((middle + signs * half) @ solid.X_WS[:3, :3].T + solid.X_WS[:3, 3])
    return np.concatenate([*points, picture.mark]) if points else np.zeros((1, 3))


def _floor(picture: StillPicture, camera: Camera) -> str:
    """The floor with its grid and the shadows of all solids."""
    if picture.floor is None:
        return ""
    grid = floor_paths(camera, _corners(picture), picture.floor)
    return f'<path class="grid" d="{grid}"/>\n<path class="shadow" d="{shadow_path(camera, picture)}"/>'


def _heading(picture: StillPicture) -> str:
    """Title and notes; long titles are written smaller, and cut where that is not enough."""
    width = (WIDTH - 2 * MARGIN) / LETTER
    title = textwrap.shorten(picture.title, int(width / SMALLEST_TITLE), placeholder=" …")
    size = min(TITLE_SIZE, int(width / max(len(title), 1)))
    smaller = f' style="font-size:{size}px"' if size < TITLE_SIZE else ""
    lines = [f'<text class="title" x="{MARGIN}" y="{TITLE}"{smaller}>{escape(title)}</text>']
    lines += [
        f'<text class="note" x="{MARGIN}" y="{TITLE + 30 + LINE * number}">{escape(note)}</text>'
        for number, note in enumerate(picture.notes, start=1)
    ]
    return "\n".join(lines)


def _names(picture: StillPicture, camera: Camera) -> str:
    """Names of the robots below their feet."""
    lines = []
    for name in picture.names:
        x, y, _ = np.rint(camera.project(name.at)).astype(int).tolist()
        text = shortened(name.text, LONGEST_NAME)
        half = int(0.5 * WIDE_LETTER * NAME_SIZE * len(text))
        x = min(max(x, half), WIDTH - half)
        lines.append(f'<text class="name" x="{x}" y="{min(y + NAME_BELOW, HEIGHT - 70)}">{escape(text)}</text>')
    return "\n".join(lines)
