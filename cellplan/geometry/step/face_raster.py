"""Raster: lines on a face at one distance from each other, trimmed by its border and traversed back and forth."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import chord_lengths
from cellplan.geometry.step.drawing import names_of_faces
from cellplan.geometry.step.kernel import MM, Face
from cellplan.geometry.step.parallels import CURE, Chart, border_of, chart_of
from cellplan.geometry.step.reader import read_solids
from cellplan.geometry.transforms import rotation_about

ROUNDING: Final = 1e-6  # [-] of a step by which the width of a face may be more than a whole number of them
SHORTEST: Final = 1e-3  # [m] of a stretch of a line
HALVINGS: Final = 24  # of the stretch in which a line crosses the border
QUARTERS: Final = (0.25, 0.5, 0.75)  # of a side, at which it is held against the face
LARGEST_TURN: Final = np.deg2rad(5.0)  # of the normal along a side
MOST_SIDES: Final = 20_000  # of a stretch
MOST_LINES: Final = 5_000
WIDEST: Final = 4.0  # spacings of a chart between the first points of a stretch, before it is refined
TINY: Final = 1e-30  # [m^2] no side is shorter
LARGEST_BEND: Final = np.deg2rad(30.0)  # by which a line still bends beyond the border
FLAT: Final = 1e-9  # [rad] a line that bends less is straight
SLOPE: Final = 1e-3  # spacings of a chart over which the direction of a line is measured


class StepSizeError(InputError):
    """The distance of the lines does not suit the face."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RasterSettings:
    """How a face is rastered; lengths in [m]."""

    step: float  # distance of neighbouring lines, along the face
    direction: float  # of the lines in the middle of the face in [rad]; see `chart_of`
    overlap: float  # by which each line goes on past the border with the process on
    lead: float  # by which it goes on further with the process off
    chord: float  # largest distance of the sides from the lines
    standoff: float  # distance of the tip from the face


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Raster:
    """Points along the lines of a face and along between them.

    Attributes:
        points: Tips in [m], shape (N, 3), expressed in the frame of the file.
        normals: Outward unit normals of the face there, shape (N, 3).
        is_off: Whether the process is off on each side, shape (N - 1,).
        line_count: Number of lines.
        stretch_count: Number of their stretches on the face.
        short_count: Number of stretches that are left out, as they are shorter than a millimetre.
    """

    points: Array
    normals: Array
    is_off: Flags
    line_count: int
    stretch_count: int
    short_count: int


class _Line(NamedTuple):
    """A line, or a stretch of one."""

    d: float  # distance from the base line in [m]
    ends: tuple[float, float]  # lengths of the base line in [m] at its border
    points: Array  # tips in [m], shape (N, 3)
    normals: Array  # outward unit normals of the face, likewise
    is_off: Flags  # whether the process is off on each side, shape (N - 1,)

    def turned(self) -> "_Line":
        """The same line the other way."""
        return _Line(self.d, self.ends[::-1], self.points[::-1], self.normals[::-1], self.is_off[::-1])


class FaceRequest(NamedTuple):
    """A face of a STEP file, and how it is rastered."""

    name: str
    settings: RasterSettings


def read_raster(path: Path, file: str, shape: str | None, request: FaceRequest) -> Raster | tuple[str, ...]:
    """The raster of a face of a STEP file in the frame of the file; the names of all faces where it has no such face.

    Args:
        file: Name of the file for messages.
        shape: Name of an assembly, a part or a solid of the file; None for all of it.

    Raises:
        InputError: The file cannot be read, is damaged or holds no solid; or as `raster`.
    """
    solids = read_solids(path, file, shape).solids
    faces = dict(zip(names_of_faces(solids), (face for solid in solids for face in solid.faces), strict=True))
    face = faces.get(request.name)
    return tuple(faces) if face is None else raster(face, request.settings)


def raster(face: Face, settings: RasterSettings) -> Raster:
    """The raster of a face: the first line on the right of its direction, seen from outside, and each next one back.

    No point of the face is farther than half a step from a line or its end, measured across the lines.

    Raises:
        InputError: The face is narrower than a step, bends too sharply for it, or cannot be covered by such lines.
    """
    chart = chart_of(face, settings.direction)
    if (sharpest := chart.sharpest) * settings.step > 1.0:
        text = f"expected a step below the smallest radius of the face, {MM / sharpest:.4g} mm"
        raise StepSizeError(f"{text}, got {MM * settings.step:g} mm")
    borders = [chart.place(points) for points in border_of(face)]
    low, high = min(d.min() for _, d in borders), max(d.max() for _, d in borders)
    if not settings.step <= high - low:
        text = f"expected a step of at most {MM * (high - low):.4g} mm, the width of the face across the lines"
        raise StepSizeError(f"{text}, got {MM * settings.step:g} mm")
    count = int(np.ceil((high - low) / settings.step - ROUNDING))
    if count > MOST_LINES:
        raise StepSizeError(f"expected a step that gives at most {MOST_LINES} lines, got {count}")
    lines, stretch_count, short_count = list[_Line](), 0, 0
    for d in 0.5 * (low + high) + settings.step * (np.arange(count) - 0.5 * (count - 1)):
        every = [_stretch(chart, float(d), ends, settings) for ends in _trimmed(chart, float(d), borders)]
        stretches = [it for it in every if chord_lengths(it.points)[-1] >= SHORTEST]
        lines += [_line(chart, stretches, settings)] if stretches else []
        stretch_count, short_count = stretch_count + len(stretches), short_count + len(every) - len(stretches)
    if not lines:
        raise InputError(f"expected a face with lines of at least {MM * SHORTEST:g} mm, got none: {CURE}")
    points, normals, is_off = _back_and_forth(chart, lines, settings)
    return Raster(
        points=points,
        normals=normals,
        is_off=is_off,
        line_count=len(lines),
        stretch_count=stretch_count,
        short_count=short_count,
    )


def _trimmed(chart: Chart, d: float, borders: Sequence[tuple[Array, Array]]) -> list[tuple[float, float]]:
    """Lengths of the base line between which a line at a distance runs within the border of the face."""
    half, crossings = 0.5 * chart.around[0], []
    for s, across in borders:
        k = np.flatnonzero((across[:-1] >= d) != (across[1:] >= d))
        share = (d - across[k]) / (across[k + 1] - across[k])
        step = s[k + 1] - s[k]
        if np.isfinite(half):
            step -= 2.0 * half * np.rint(0.5 * step / half)
        crossings.append(s[k] + share * step)
    s = np.sort(np.concatenate(crossings))
    if np.isfinite(half):
        s = np.concatenate([[-half], np.sort((s + half) % (2.0 * half) - half), [half]])
    elif len(s):
        s = np.concatenate([[s[0] - chart.spacing], s, [s[-1] + chart.spacing]])
    middles = 0.5 * (s[:-1] + s[1:])
    is_in = chart.at(middles, np.full(len(middles), d)).is_on
    ends = np.flatnonzero(np.diff(np.concatenate([[False], is_in, [False]]).astype(int))).reshape(-1, 2)
    return [
        (
            _border(chart, d, middles[first], middles[first - 1]) if first > 0 else float(s[0]),
            _border(chart, d, middles[last - 1], middles[last]) if last < len(middles) else float(s[-1]),
        )
        for first, last in ends
    ]


def _border(chart: Chart, d: float, inside: float, outside: float) -> float:
    """Length of the base line at which a line crosses the border between a place within it and one beyond it."""
    for _ in range(HALVINGS):
        half = 0.5 * (inside + outside)
        if chart.at(np.array([half]), np.array([d])).is_on[0]:
            inside = half
        else:
            outside = half
    return float(inside)


def _stretch(chart: Chart, d: float, ends: tuple[float, float], settings: RasterSettings) -> _Line:
    """A stretch of a line as sides within the chord; on a plane it is one side."""
    places = 2 if chart.face.kind == "plane" else 2 + int(abs(ends[1] - ends[0]) / (WIDEST * chart.spacing))
    s = np.linspace(*ends, places)
    while True:
        points, normals = _tips(chart, s, d, settings)
        p, side = points[:-1], np.diff(points, axis=0)
        off, square = np.zeros(len(p)), np.maximum(np.sum(side * side, axis=1), TINY)
        for share in QUARTERS:
            away = _tips(chart, s[:-1] + share * np.diff(s), d, settings)[0] - p
            along = (np.sum(away * side, axis=1) / square)[:, None]
            off = np.maximum(off, np.linalg.norm(away - along * side, axis=1))
        turn = np.linalg.norm(np.diff(normals, axis=0), axis=1)
        is_open = (off > settings.chord) | (turn > LARGEST_TURN)
        if not np.any(is_open) or len(s) > MOST_SIDES:
            return _Line(d, ends, points, normals, np.zeros(len(p), dtype=bool))
        s = np.insert(s, np.flatnonzero(is_open) + 1, (s[:-1] + 0.5 * np.diff(s))[is_open])


def _tips(chart: Chart, s: Array, d: Array | float, settings: RasterSettings) -> tuple[Array, Array]:
    """Tips over places of the face, and outward normals there, shape (N, 3) each."""
    place = chart.at(s, np.broadcast_to(d, s.shape))
    return place.points + settings.standoff * place.normals, place.normals


def _line(chart: Chart, stretches: Sequence[_Line], settings: RasterSettings) -> _Line:
    """Stretches of one line, with what goes on past the border and over the gaps between them."""
    first, last = stretches[0], stretches[-1]
    parts = [part.turned() for part in reversed(_beyond(chart, first.turned(), settings))]
    for before, stretch in zip([None, *stretches], stretches, strict=False):
        if before is not None:
            parts.append(
                _over(_stretch(chart, stretch.d, (before.ends[1], stretch.ends[0]), settings), settings.overlap)
            )
        parts.append(stretch)
    parts += _beyond(chart, last, settings)
    return _Line(
        first.d,
        (first.ends[0], last.ends[1]),
        np.concatenate([parts[0].points[:1], *(part.points[1:] for part in parts)]),
        np.concatenate([parts[0].normals[:1], *(part.normals[1:] for part in parts)]),
        np.concatenate([part.is_off for part in parts]),
    )


def _beyond(chart: Chart, stretch: _Line, settings: RasterSettings) -> list[_Line]:
    """What goes on from the end of a stretch, ever less bent: with the process on, then straight with it off."""
    begin, end = stretch.ends
    step = np.copysign(SLOPE * chart.spacing, end - begin)
    around, upright = _tips(chart, np.array([end - step, end + step]), stretch.d, settings)
    normal = stretch.normals[-1]
    rate = np.cross(normal, (upright[1] - upright[0]) / np.linalg.norm(around[1] - around[0]))
    along = around[1] - around[0] - (around[1] - around[0]) @ normal * normal
    along /= np.linalg.norm(along)
    parts, points, normals = list[_Line](), stretch.points[-1:], normal[None]
    if settings.overlap > 0.0:
        points, turns = _bending_out(along, rate, settings)
        points, normals = stretch.points[-1] + points, turns @ normal
        parts.append(_Line(stretch.d, (end, end), points, normals, np.zeros(len(points) - 1, dtype=bool)))
        along = turns[-1] @ along
    if settings.lead > 0.0:
        points = points[-1] + np.outer([0.0, settings.lead], along)
        parts.append(_Line(stretch.d, (end, end), points, normals[[-1, -1]], np.array([True])))
    return parts


def _bending_out(along: Array, rate: Array, settings: RasterSettings) -> tuple[Array, Array]:
    """Points from the border on, shape (N, 3), and rotations of the tool since then, shape (N, 3, 3).

    The tool goes on in a direction and turns at a rate in [rad/m], shape (3,), that falls evenly to zero, at the end or
    where it has turned by ``LARGEST_BEND``: a line that is straight at once would turn the tool by jerks.
    """
    bend = float(np.linalg.norm(rate))
    if bend * settings.overlap < FLAT:
        return np.outer([0.0, settings.overlap], along), np.broadcast_to(np.eye(3), (2, 3, 3))
    taper = min(settings.overlap, 2.0 * LARGEST_BEND / bend)
    sides = int(np.ceil(max(taper * np.sqrt(bend / (8.0 * settings.chord)), taper * bend / LARGEST_TURN)))
    at = taper * np.arange(2 * sides + 1) / (2 * sides)
    turns = rotation_about(rate / bend, bend * (at - at * at / (2.0 * taper)))
    directions = turns @ along
    steps = (directions[:-2:2] + 4.0 * directions[1::2] + directions[2::2]) * taper / (6.0 * sides)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if taper < settings.overlap:
        points = np.concatenate([points, points[-1:] + (settings.overlap - taper) * directions[-1:]])
        return points, np.concatenate([turns[::2], turns[-1:]])
    return points, turns[::2]


def _over(gap: _Line, overlap: float) -> _Line:
    """The line over a gap of a line, with the process on as far as both of its stretches go on past the border."""
    behind = chord_lengths(gap.points)
    cuts = np.clip([overlap, behind[-1] - overlap], 0.0, behind[-1])
    at = np.union1d(behind, cuts)
    points, normals = (
        np.stack([np.interp(at, behind, column) for column in values.T], axis=1) for values in (gap.points, gap.normals)
    )
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    middles = 0.5 * (at[:-1] + at[1:])
    return _Line(gap.d, gap.ends, points, normals, (middles > cuts[0]) & (middles < cuts[1]))


def _back_and_forth(chart: Chart, lines: Sequence[_Line], settings: RasterSettings) -> tuple[Array, Array, Flags]:
    """Points, normals and sides with the process off along all lines, every second one back, and between them.

    What leads to the first line and away from the last one is left out: the path begins and ends with the process on.
    """
    order = [line if number % 2 == 0 else line.turned() for number, line in enumerate(lines)]
    transfers = [_transfer(chart, one, other, settings) for one, other in pairwise(order)]
    parts = [part for pair in zip(order, transfers, strict=False) for part in pair if len(part.points)] + order[-1:]
    points, normals = (np.concatenate([getattr(part, key) for part in parts]) for key in ("points", "normals"))
    is_off = np.concatenate([np.append(part.is_off, True) for part in parts])[:-1]
    first, last = int(is_off[0]), len(points) - int(is_off[-1])
    return points[first:last], normals[first:last], is_off[first : last - 1]


def _transfer(chart: Chart, one: _Line, other: _Line, settings: RasterSettings) -> _Line:
    """Points between the end of a line and the begin of the next one, over the face as far as it bends."""

    def tips(share: Array) -> tuple[Array, Array]:
        lengths, distances = (a + share * (b - a) for a, b in ((one.ends[1], other.ends[0]), (one.d, other.d)))
        return _tips(chart, lengths, distances, settings)

    (first, middle, last), upright = tips(np.array([0.0, 0.5, 1.0]))
    bend = float(np.linalg.norm(middle - 0.5 * (first + last)))
    sides = 1 if chart.face.kind == "plane" else int(np.clip(np.ceil(np.sqrt(bend / settings.chord)), 1, MOST_SIDES))
    share = np.arange(1, sides) / sides
    points, normals = tips(share)
    points += np.outer(1.0 - share, one.points[-1] - first) + np.outer(share, other.points[0] - last)
    normals += np.outer(1.0 - share, one.normals[-1] - upright[0]) + np.outer(share, other.normals[0] - upright[-1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return _Line(one.d, (one.ends[1], other.ends[0]), points, normals, np.ones(max(sides - 2, 0), dtype=bool))
