"""The sheet of a picture of an instant as SVG text: heading, floor, cell, names and an enlarged detail."""

import textwrap
from collections.abc import Iterator
from html import escape
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.shapes import bounding_box, support_point
from cellplan.report.record.common import shortened
from cellplan.report.still.camera import Camera, framed, view_axes
from cellplan.report.still.detail import DetailWindow, detail, is_worth_it, mark
from cellplan.report.still.painter import Painter, rules
from cellplan.report.still.picture import ShownSolid, StillPicture

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
GRID: Final = 0.5  # [m] between two lines; more for large cells
MOST_LINES: Final = 24  # [-] each way
BORDER: Final = 0.25  # [m] round the cell
ROUND: Final = 2.0 * np.pi * (np.arange(16) + 0.5) / 16
AROUND: Final = np.stack([np.cos(ROUND), np.sin(ROUND), np.zeros(16)], axis=1)
FONT: Final = 'system-ui,"Segoe UI","Helvetica Neue",Arial,sans-serif'
STYLE: Final = f"""
svg.still-sheet {{ font-family: {FONT}; color-scheme: light dark; }}
.still-sheet .sheet {{ fill: #f6f8fa; }}
.still-sheet path {{ stroke-width: 9; stroke-linejoin: round; }}
.still-sheet .e {{ stroke: #101820; stroke-opacity: .45; stroke-width: 9; fill: none; stroke-linecap: round; }}
.still-sheet .grid {{ stroke: #c8d0d9; stroke-width: 8; fill: none; }}
.still-sheet .shadow {{ fill: #1d2733; fill-opacity: .13; stroke: none; }}
.still-sheet .title {{ fill: #1c6b43; font-size: 205px; font-weight: 700; }}
.still-sheet .bad .title {{ fill: #a61f1f; }}
.still-sheet .note, .still-sheet .name, .still-sheet .value {{ fill: #1d2733; font-size: 165px; }}
.still-sheet .name, .still-sheet .value {{ font-weight: 600; paint-order: stroke; stroke: #f6f8fa; stroke-width: 45; }}
.still-sheet text {{ stroke-linejoin: round; }}
.still-sheet .name {{ text-anchor: middle; }}
.still-sheet .value {{ font-size: 200px; font-weight: 700; text-anchor: middle; }}
.still-sheet .bad .value {{ fill: #a61f1f; }}
.still-sheet .halo {{ stroke: #fff; stroke-width: 62; stroke-linecap: round; fill: none; }}
.still-sheet .near {{ stroke: #1d2733; stroke-width: 32; stroke-linecap: round; fill: none; }}
.still-sheet .bad .near {{ stroke: #d40f0f; }}
.still-sheet .spot {{ fill: #1d2733; stroke: #fff; stroke-width: 16; }}
.still-sheet .bad .spot {{ fill: #d40f0f; }}
.still-sheet .ring, .still-sheet .frame {{ fill: none; stroke: #1d2733; stroke-width: 18; }}
.still-sheet .bad .ring {{ stroke: #d40f0f; stroke-width: 30; }}
.still-sheet .lead {{ stroke: #55616f; stroke-width: 10; stroke-dasharray: 40 30; fill: none; }}
"""
DARK: Final = """
.still-sheet .sheet { fill: #161b22; }
.still-sheet .e { stroke: #000; stroke-opacity: .5; }
.still-sheet .grid { stroke: #343d49; }
.still-sheet .shadow { fill: #000; fill-opacity: .4; }
.still-sheet .title { fill: #5fc58f; }
.still-sheet .bad .title, .still-sheet .bad .value { fill: #ff8a80; }
.still-sheet .note, .still-sheet .name, .still-sheet .value { fill: #e3e8ee; }
.still-sheet .name, .still-sheet .value { stroke: #161b22; }
.still-sheet .near, .still-sheet .ring, .still-sheet .frame { stroke: #e3e8ee; }
.still-sheet .bad .near, .still-sheet .bad .ring { stroke: #ff4d42; }
.still-sheet .halo { stroke: #161b22; }
.still-sheet .spot { fill: #e3e8ee; stroke: #161b22; }
.still-sheet .bad .spot { fill: #ff4d42; }
.still-sheet .lead { stroke: #9aa5b1; }
"""
AZIMUTHS: Final = np.radians(np.arange(-50.0, 310.0, 15.0))  # the first ones are preferred among equals
ELEVATIONS: Final = np.radians((28.0, 16.0, 42.0, 60.0, 90.0))
IN_SIGHT: Final = 2.0  # weight of the share of points that nothing hides
ROBOTS_IN_SIGHT: Final = 1.0  # weight of the share of the robots that the surroundings do not hide
UNSHORTENED: Final = 1.5  # weight of the length of the connection on the sheet by its true length
ENOUGH: Final = 0.94  # [-] of that: more is not better
WIDE: Final = 0.25  # weight of how much of the sheet the cell fills
USUAL: Final = (0.20, 0.12, 0.14, 0.0, -0.3)  # for each of the elevations
BETWEEN: Final = (0.15, 0.5, 0.85)  # places along the connection that are to be seen
BODY: Final = 0.3  # [m] by which solids stick out beyond their middles, about
PARALLEL: Final = 1e-12  # [-] component of a direction that lies in the face of a box
STEP: Final = 1e-6  # [-] scores that differ by less are equal


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


def floor_paths(camera: Camera, points: Array, height: float) -> str:
    """Path of the grid below points in the world, shape (N, 3)."""
    low, high = points[:, :2].min(axis=0) - BORDER, points[:, :2].max(axis=0) + BORDER
    step = GRID
    while float((high - low).max()) / step > MOST_LINES:
        step *= 2.0
    first, last = (np.round(np.floor(low / step + 1e-6)), np.round(np.ceil(high / step - 1e-6)))
    ends = []
    for axis in (0, 1):
        for number in np.arange(first[axis], last[axis] + 1):
            line = np.full((2, 3), height)
            line[:, axis] = step * number
            line[:, 1 - axis] = step * first[1 - axis], step * last[1 - axis]
            ends.append(line)
    seen = np.rint(camera.project(np.array(ends))[..., :2]).astype(np.int64).tolist()
    return "".join(f"M{a} {b}L{c} {d}" for (a, b), (c, d) in seen)


def shadow_path(camera: Camera, picture: StillPicture) -> str:
    """Path of the shadows of all solids that are above the floor, from light straight above."""
    parts = []
    for solid in picture.solids:
        R, p = solid.X_WS[:3, :3], solid.X_WS[:3, 3]
        outline = np.array([R @ support_point(solid.shape, R.T @ n) + p for n in AROUND])
        outline[:, 2] = picture.floor
        seen = np.rint(camera.project(outline)[:, :2]).astype(np.int64)
        points = seen[np.any(seen != np.roll(seen, 1, axis=0), axis=1)].tolist()
        if len(points) > 2:
            parts.append("M" + "L".join(f"{x} {y}" for x, y in points) + "z")
    return "".join(parts)


def best_axes(picture: StillPicture, aspect: float) -> Array:
    """Axes of the camera for a picture, shape (3, 3)."""
    choices = [(view_axes(a, e), usual) for e, usual in zip(ELEVATIONS, USUAL, strict=True) for a in AZIMUTHS]
    axes = np.array([axes_tried for axes_tried, _ in choices])
    scores = np.array([usual for _, usual in choices]) + WIDE * _filled(picture, axes, aspect)
    scores += ROBOTS_IN_SIGHT * _robots_in_sight(picture, axes[:, 2])
    if len(picture.mark):
        scores += IN_SIGHT * _in_sight(picture, axes[:, 2])
    if len(picture.mark) == 2:
        line = picture.mark[1] - picture.mark[0]
        length = float(np.linalg.norm(line))
        seen = np.linalg.norm(axes[:, :2] @ line, axis=1) / max(length, 1e-9)
        scores += UNSHORTENED * np.minimum(seen, ENOUGH)
    return axes[int(np.argmax(np.round(scores / STEP)))]


def _in_sight(picture: StillPicture, toward: Array) -> Array:
    """Share of what matters that no box round a solid hides, for directions to the viewer of shape (D, 3)."""
    sights = list(_sights(picture))
    points = np.array([point for point, _ in sights])
    hidden = np.zeros((len(toward), len(points)), dtype=bool)
    for solid in picture.solids:
        hidden |= _hides(solid, points, toward) & np.array([solid.name not in marked for _, marked in sights])
    return 1.0 - hidden.mean(axis=1)


def _robots_in_sight(picture: StillPicture, toward: Array) -> Array:
    """Share of what robots move that the surroundings do not hide, for directions to the viewer of shape (D, 3)."""
    points = np.array([solid.X_WS[:3, 3] for solid in picture.solids if solid.robot is not None]).reshape(-1, 3)
    hidden = np.zeros((len(toward), len(points)), dtype=bool)
    for solid in picture.solids:
        if solid.robot is None:
            hidden |= _hides(solid, points, toward)
    return 1.0 - hidden.mean(axis=1) if len(points) else np.ones(len(toward))


def _hides(solid: ShownSolid, points: Array, toward: Array) -> Flags:
    """Whether the box round a solid lies before points, shape (P, 3), seen from directions, shape (D, 3)."""
    middle, half = bounding_box(solid.shape)
    R, p = solid.X_WS[:3, :3], solid.X_WS[:3, 3]
    start = (points - p) @ R - middle  # in the frame of the solid
    step = (toward @ R)[:, None]
    step = np.where(np.abs(step) < PARALLEL, PARALLEL, step)
    first, second = (-half - start) / step, (half - start) / step
    enters = np.minimum(first, second).max(axis=-1)
    return np.maximum(first, second).min(axis=-1) > np.maximum(enters, 0.0)


def _sights(picture: StillPicture) -> Iterator[tuple[Array, tuple[str, ...]]]:
    """Points that are to be seen, with the names of the solids that they lie in."""
    marked = tuple(picture.marked)
    if len(picture.mark) == 2:
        for share in BETWEEN:
            yield picture.mark[0] + share * (picture.mark[1] - picture.mark[0]), ()
    else:
        yield picture.mark[0], marked
        yield picture.mark[0], marked
    for solid in picture.solids:
        if solid.name in marked:
            yield solid.X_WS[:3, 3], (solid.name,)


def _filled(picture: StillPicture, axes: Array, aspect: float) -> Array:
    """How much of the sheet middles of solids and lines fill, from 0 in the worst direction to 1 in the best."""
    middles = np.array([solid.X_WS[:3, 3] for solid in picture.solids]).reshape(-1, 3)
    points = np.concatenate([middles, *(line.points for line in picture.lines), picture.mark])
    if not len(points):
        return np.zeros(len(axes))
    size = np.ptp(points @ np.swapaxes(axes[:, :2], -1, -2), axis=1) + BODY
    filled = size.prod(axis=1) / np.maximum(size[:, 0], aspect * size[:, 1]) ** 2
    return (filled - filled.min()) / max(float(np.ptp(filled)), PARALLEL)
