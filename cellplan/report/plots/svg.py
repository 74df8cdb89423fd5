"""Figures as SVG text, written directly; the curves can be read back from it.

Lengths are in points. The curves of a panel lie in an inner ``svg`` whose coordinates are hundredths of points from the
upper left corner of its box; ``data-x`` and ``data-y`` of the panel give the values at the edges of that box.
"""

import math
import re
from collections.abc import Iterator, Sequence
from html import escape
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.report.plots.figure import Figure, Limit, PlotBox, PlotCurve, PlotMark
from cellplan.report.plots.palette import FORBIDDEN, FRAME, GREY, GRID, LIMIT, PAPER, dark_rules
from cellplan.report.plots.placing import SWATCH, TICK, PlacedFigure, PlacedPanel, Words, gaps, placed

FINE: Final = 100  # coordinates to a point
POINT_DENSITY: Final = 1.5  # of a curve in a point of width: one per pixel, more would only enlarge the files
THINNING_TOL: Final = 0.12 * FINE  # that a curve may lie beside its points: a tenth of its width
FARTHEST: Final = 1e7  # of coordinates: what lies far outside its box
FONT: Final = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif"
STAR: Final = tuple(((0.5, 0.2)[k % 2], np.pi * (0.5 + k / 5.0)) for k in range(10))  # radius and angle of its corners
STYLE: Final = re.compile(r"<style>.*?</style>", re.DOTALL)
# [-] of the tolerance in each round: steps of twice the length leave a bent curve four times as far
ROUND_SHARES: Final = tuple(4.0**k / 341.0 for k in range(5))


def svg_text(figure: Figure) -> str:
    """A figure as the text of an SVG file."""
    placement = placed(figure)
    return "\n".join(
        [*_head(placement), *map(_words, placement.words), *_swatches(placement), *_panels(placement), "</svg>\n"]
    )


def inline_svg(text: str) -> str:
    """An SVG file as part of a page, which has the style of all pictures."""
    return STYLE.sub("", text, count=1)


def _head(placement: PlacedFigure) -> Iterator[str]:
    """The opening tag, what the figure shows in words, its style for dark pages and its paper."""
    figure = placement.figure
    size = f"{placement.width:.6g} {placement.height:.6g}"
    title, kind = figure.title or figure.panels[0].title, "exact" if figure.is_exact else "figure"
    yield (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" role="img" class="{kind}" '
        f'font-family="{FONT}" stroke-linejoin="round">'
    )
    yield f"<title>{escape(title)}</title>"
    yield f"<desc>{escape(figure.text or _description(figure))}</desc>"
    if not figure.is_exact:
        yield f"<style>{dark_rules()}</style>"
    yield f'<rect class="paper" width="{placement.width:.6g}" height="{placement.height:.6g}" fill="{PAPER}"/>'


def _description(figure: Figure) -> str:
    """Titles and notes of the panels, for those who do not see them."""
    texts = (f"{panel.title}: {panel.note}" if panel.note else panel.title for panel in figure.panels)
    return f"{'; '.join(text for text in texts if text)}. Along: {figure.x.label}."


def _words(words: Words) -> str:
    """A line of text."""
    place = f'x="{_short(words.x)}" y="{_short(words.y)}" font-size="{words.size:g}" fill="{words.colour}"'
    anchor = f' text-anchor="{words.anchor}"' if words.anchor != "start" else ""
    weight = ' font-weight="bold"' if words.is_bold else ""
    kind = f' class="{words.kind}"' if words.kind else ""
    return f"<text{kind} {place}{anchor}{weight}>{escape(words.text)}</text>"


def _tick_labels(box: PlacedPanel) -> Iterator[str]:
    """The numbers along both axes, a group for each."""
    for kind in ("tick-y", "tick-x"):
        labels = [words for words in box.words if words.kind == kind]
        if labels:
            first = labels[0]
            pen = f'font-size="{first.size:g}" fill="{first.colour}" text-anchor="{first.anchor}"'
            texts = (
                f'<text x="{_short(label.x)}" y="{_short(label.y)}">{escape(label.text)}</text>' for label in labels
            )
            yield f'<g class="{kind}" {pen}>{"".join(texts)}</g>'


def _short(length: float) -> str:
    """A length with at most two decimals."""
    return f"{length:.2f}".rstrip("0").rstrip(".")


def _swatches(placement: PlacedFigure) -> Iterator[str]:
    """The colours of the legend."""
    for x, y, colour in placement.swatches:
        yield f'<rect x="{x:.2f}" y="{y:.2f}" width="{SWATCH[0]:g}" height="{SWATCH[1]:g}" fill="{colour}"/>'


def _panels(placement: PlacedFigure) -> Iterator[str]:
    is_plane = placement.figure.is_plane
    for box in placement.panels:
        y = box.panel.y
        kinds = (' data-time=""' if box.x.is_time else "") + (' data-log=""' if y.is_log else "")
        unit = f' data-unit="{escape(y.unit)}"' if y.unit else ""
        place = f'transform="translate({box.left:.6g} {box.top:.6g})" data-size="{box.width:.6g} {box.height:.6g}"'
        yield (
            f'<g class="panel" {place} data-x="{box.x.low:.9g} {box.x.high:.9g}" '
            f'data-y="{y.low:.9g} {y.high:.9g}"{unit}{kinds}>'
        )
        width, height = round(FINE * box.width), round(FINE * box.height)
        size = f'width="{box.width:.6g}" height="{box.height:.6g}" viewBox="0 0 {width} {height}"'
        yield f'<svg class="box" {size} overflow="{"hidden" if is_plane else "visible"}" fill="none">'
        yield from _forbidden(box)
        if not is_plane:
            yield f'<path class="grid" d="{_grid(box)}" stroke="{GRID}" stroke-width="80"/>'
        for item in box.panel.items:
            yield from _item(box, item)
        yield "</svg>"
        frame = _plane_frame(box) if is_plane else f"M0 0V{box.height:.6g}H{box.width:.6g}"
        yield f'<path class="frame" d="{frame}" fill="none" stroke="{GREY if is_plane else FRAME}" stroke-width="0.8"/>'
        yield from _tick_labels(box)
        yield from (_words(words) for words in box.words if not words.kind.startswith("tick"))
        yield "</g>"


def _forbidden(box: PlacedPanel) -> Iterator[str]:
    """The ranges beyond limits."""
    width, height = round(FINE * box.width), round(FINE * box.height)
    for item in box.panel.items:
        if isinstance(item, Limit) and item.is_shaded and not item.is_vertical:
            at = int(np.clip(_fine(box.down(item.value)), 0, height))
            top, bottom = (0, at) if item.is_upper else (at, height)
            yield f'<rect y="{top}" width="{width}" height="{bottom - top}" fill="{FORBIDDEN}"/>'


def _grid(box: PlacedPanel) -> str:
    """Lines at the ticks."""
    width, height = round(FINE * box.width), round(FINE * box.height)
    across = "".join(f"M{_fine(box.across(value))} 0v{height}" for value in box.x_ticks)
    return across + "".join(f"M0 {_fine(box.down(value))}h{width}" for value in box.y_ticks)


def _plane_frame(box: PlacedPanel) -> str:
    """The frame of a plane with ticks outside."""
    steps = [f"M0 0V{box.height:.6g}H{box.width:.6g}V0Z"]
    steps += [f"M{float(box.across(value)):.2f} {box.height:.6g}v{TICK:g}" for value in box.x_ticks]
    steps += [f"M0 {float(box.down(value)):.2f}h{-TICK:g}" for value in box.y_ticks]
    return "".join(steps)


def _item(box: PlacedPanel, item: object) -> Iterator[str]:
    """The elements of one item but for its words."""
    if isinstance(item, PlotCurve):
        yield from _curve(box, item)
    elif isinstance(item, PlotMark):
        yield from _mark(_fine(box.across(item.x)), _fine(box.down(item.y)), item)
    elif isinstance(item, PlotBox):
        (left, right), (bottom, top) = box.across(np.array(item.x)).tolist(), box.down(np.array(item.y)).tolist()
        place = f'x="{_fine(left)}" y="{_fine(top)}" width="{_fine(right) - _fine(left)}"'
        opacity = f' fill-opacity="{item.opacity:g}"' if item.opacity < 1.0 else ""
        fill = f'fill="{item.colour}"{opacity} shape-rendering="crispEdges"'
        yield f'<rect {place} height="{_fine(bottom) - _fine(top)}" {fill}/>'
    elif isinstance(item, Limit):
        line = f"M{_fine(box.across(item.value))} 0V{round(FINE * box.height)}"
        if not item.is_vertical:
            line = f"M0 {_fine(box.down(item.value))}H{round(FINE * box.width)}"
        yield f'<path class="bound" d="{line}" stroke="{LIMIT}" stroke-width="{FINE}"/>'


def _fine(length: Array | float) -> int:
    """A length in points as a coordinate."""
    return round(float(np.clip(FINE * np.asarray(length), -FARTHEST, FARTHEST)))


def _curve(box: PlacedPanel, curve: PlotCurve) -> Iterator[str]:
    """A curve as one path, thinned so that every peak is kept; nothing where it has no points."""
    x, y = np.asarray(curve.x, dtype=float), np.asarray(curve.y, dtype=float)
    is_function = len(x) > 2 and bool(np.all(np.diff(x) >= 0.0))
    steps = "".join(_stretch(box, x[first:last], y[first:last], is_function) for first, last in gaps(x + y))
    if steps:
        name = f' data-name="{escape(curve.name)}"' if curve.name else ""
        dashes = ' stroke-dasharray="400 300"' if curve.is_dashed else ""
        pen = f'stroke="{curve.colour}" stroke-width="{FINE * curve.width:g}"{dashes}'
        yield f'<path class="curve"{name} d="{steps}" {pen}/>'


def _stretch(box: PlacedPanel, x: Array, y: Array, is_function: bool) -> str:
    """The path of a stretch without gaps: its first point, and from each point to the next."""
    if is_function:
        selected = peak_samples(y, round(POINT_DENSITY * box.width))
        x, y = x[selected], y[selected]
    points = np.stack([FINE * box.across(x), FINE * box.down(y)], axis=-1)
    points = np.rint(np.clip(points, -FARTHEST, FARTHEST))
    if is_function:
        points = points[straightened(points[:, 0], points[:, 1], THINNING_TOL)]
    whole = points.astype(np.int64)
    steps = _numbers(np.diff(whole, axis=0).ravel().tolist())
    return f"M{_numbers(whole[0].tolist())}" + (f"l{steps}" if steps else "h0")


def _numbers(values: Sequence[int]) -> str:
    """Numbers as short as a path allows."""
    return " ".join(map(str, values)).replace(" -", "-")


def _mark(x: int, y: int, mark: PlotMark) -> Iterator[str]:
    """A dot as a line without length and with round ends; a star as a polygon."""
    size = FINE * mark.size
    if mark.is_star:
        corners = _numbers([round(v) for r, a in STAR for v in (x + size * r * np.cos(a), y - size * r * np.sin(a))])
        edge = f' stroke="{mark.edge}" stroke-width="60"' if mark.edge else ""
        yield f'<path class="mark" d="M{corners}Z" fill="{mark.colour}"{edge}/>'
        return
    if mark.edge:
        yield _dot(x, y, mark.edge, size + 0.3 * FINE)
        size -= 0.3 * FINE
    yield _dot(x, y, mark.colour, size)


def _dot(x: int, y: int, colour: str, size: float) -> str:
    """A dot."""
    pen = f'stroke="{colour}" stroke-width="{size:g}" stroke-linecap="round"'
    return f'<path class="mark" d="M{_numbers([x, y])}h0" {pen}/>'


def peak_samples(values: Array, points: int) -> Indices:
    """Indices of some samples, among them the first, the last, and the extremes of every interval.

    Args:
        values: Shape (N,).
        points: About how many there may be.
    """
    n = len(values)
    if n <= points:
        return np.arange(n)
    length = math.ceil(2 * n / points)
    whole = n // length * length
    stretches = values[:whole].reshape(-1, length)
    starts = np.arange(0, whole, length)
    rest = np.arange(whole, n)
    ends = rest[[np.argmin(values[rest]), np.argmax(values[rest])]] if len(rest) else rest
    lows, highs = starts + stretches.argmin(axis=1), starts + stretches.argmax(axis=1)
    return np.unique(np.concatenate([[0], lows, highs, ends, [n - 1]]))


def straightened(x: Array, y: Array, tolerance: float) -> Indices:
    """Indices of the points of a curve without those that lie on the straight line between their neighbours.

    Every second point is tested in each round, and removed where it lies no farther above or below that line than
    a share of the tolerance: the curve through the remaining points lies nowhere farther from the given one than
    the tolerance.

    Args:
        x: Increasing, shape (K,).
        y: Shape (K,).
        tolerance: In the unit of ``y``.
    """
    indices = np.arange(len(x))
    for share in ROUND_SHARES:
        if len(indices) < 3:
            break
        middle = np.arange(1, len(indices) - 1, 2)
        before, at, after = indices[middle - 1], indices[middle], indices[middle + 1]
        shares = (x[at] - x[before]) / np.maximum(x[after] - x[before], np.finfo(float).tiny)
        apart = np.abs(y[before] + shares * (y[after] - y[before]) - y[at])
        indices = np.delete(indices, middle[apart <= share * tolerance])
    return indices
