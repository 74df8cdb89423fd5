"""Seam lines along edges: sampled, cut, turned round and joined to chains."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.step.kernel import Edge, Face

TURN: Final = 5e-3  # [rad] between neighbouring points of travel and normals: cubics are then exact to 1e-8 rad
FEWEST: Final = 17  # points at which the turn of an edge is looked for
MOST: Final = 20_001  # points of an edge
MEET: Final = 1e-5  # [m] ends of edges that are nearer than this meet
SMOOTH: Final = np.deg2rad(1.0)  # [rad] edges that turn by less where they meet run on without a corner
NEAREST_STEPS: Final = 60  # halvings in the search for the nearest point: to rounding
At = Callable[
    [Array], tuple[Array, Array, tuple[Array, Array]]
]  # points, travel and normals of two walls by parameters


def line_of_edge(edge: Edge, faces: tuple[Face, Face], names: tuple[str, str], source: str) -> SeamLine:
    """The line along an edge of a solid; the wall on the left of travel, seen from outside, is the first one."""

    def at(t: Array) -> tuple[Array, Array, tuple[Array, Array]]:
        points, tangents = edge.at(t)
        return points, tangents, (faces[0].project(points)[2], faces[1].project(points)[2])

    return sampled_line(edge, edge.span, at, names, source=source)


def sampled_line(edge: Edge, span: tuple[float, float], at: At, names: tuple[str, str], *, source: str) -> SeamLine:
    """A line over a stretch of the parameter of an edge, as dense as it turns."""
    count = FEWEST
    while True:
        t = np.linspace(*span, count)
        points, tangents, walls = at(t)
        turn = max(float(_angles(values).max()) for values in (tangents, *walls))
        if turn <= TURN or count > MOST:
            break
        count = int(count * min(2.0 * np.ceil(turn / TURN), 64.0)) if count == FEWEST else 2 * count
    if float(_angles(tangents).sum() + sum(_angles(wall).sum() for wall in walls)) < 1e-12:
        t, points, tangents, walls = (
            t[[0, -1]],
            points[[0, -1]],
            tangents[[0, -1]],
            (walls[0][[0, -1]], walls[1][[0, -1]]),
        )
    is_closed = edge.is_closed and span == edge.span
    if is_closed:
        points[-1], tangents[-1] = points[0], tangents[0] if _angles(tangents[[0, -1]])[0] < TURN else tangents[-1]
    return SeamLine(
        source=source,
        points=points,
        tangents=tangents,
        behind=edge.lengths(t),
        walls=dict(zip(names, walls, strict=True)),
        is_closed=is_closed,
    )


def reversed_line(line: SeamLine) -> SeamLine:
    """The same line the other way."""
    return replace(
        line,
        points=line.points[::-1],
        tangents=-line.tangents[::-1],
        behind=(line.behind[-1] - line.behind)[::-1],
        walls={name: line.walls[name][::-1] for name in reversed(list(line.walls))},
    )


def cut_line(line: SeamLine, first: float, last: float) -> SeamLine:
    """The stretch of a line between two lengths in [m]."""
    inside = (line.behind > first) & (line.behind < last)
    ends = [_at(line, np.array([length])) for length in (first, last)]
    rows = [
        np.concatenate([ends[0][k], values[inside], ends[1][k]])
        for k, values in enumerate((line.points, line.tangents, *line.walls.values()))
    ]
    return replace(
        line,
        points=rows[0],
        tangents=rows[1],
        behind=np.concatenate([[0.0], line.behind[inside] - first, [last - first]]),
        walls=dict(zip(line.walls, rows[2:], strict=True)),
        is_closed=False,
    )


def started_near(line: SeamLine, point: Array) -> SeamLine:
    """A closed line that begins at its point nearest to another one, shape (3,) in [m]."""
    k = int(np.argmin(np.linalg.norm(line.points - point, axis=1)))
    low, high = line.behind[max(k - 1, 0)], line.behind[min(k + 1, len(line.behind) - 1)]
    for _ in range(NEAREST_STEPS):
        thirds = np.array([low + (high - low) / 3.0, high - (high - low) / 3.0])
        near = np.linalg.norm(_at(line, thirds)[0] - point, axis=1)
        low, high = (low, float(thirds[1])) if near[0] < near[1] else (float(thirds[0]), high)
    start, total = 0.5 * (low + high), float(line.behind[-1])
    if min(start, total - start) < MEET:
        return line
    return replace(_joined(cut_line(line, start, total), cut_line(line, 0.0, start)), is_closed=True)


def chain(lines: Sequence[SeamLine]) -> SeamLine | int:
    """Lines joined end to end, each turned so that it goes on from the last one; or the place of one that cannot.

    Walls go by their sides: those on the left of travel are one wall, by its name on the first line. Where lines meet
    at an angle a corner is left.
    """
    whole = lines[0]
    if len(lines) > 1 and not _meets(whole.points[-1], lines[1]):
        whole = reversed_line(whole)
    for place, line in enumerate(lines[1:], start=1):
        end = whole.points[-1]
        if np.linalg.norm(line.points[0] - end) > MEET:
            line = reversed_line(line)  # noqa: PLW2901
        if np.linalg.norm(line.points[0] - end) > MEET:
            return place
        whole = _joined(whole, line)
    is_closed = bool(np.linalg.norm(whole.points[-1] - whole.points[0]) <= MEET)
    return replace(whole, is_closed=is_closed)


def _meets(end: Array, line: SeamLine) -> bool:
    """Whether a line begins or ends at a point."""
    return bool(min(np.linalg.norm(line.points[k] - end) for k in (0, -1)) <= MEET)


def _joined(first: SeamLine, second: SeamLine) -> SeamLine:
    """Two lines in one, with a corner between them unless they run on."""
    names = list(first.walls)
    walls = {name: [first.walls[name], other] for name, other in zip(names, second.walls.values(), strict=True)}
    skipped = 1 if float(_angles(np.stack([first.tangents[-1], second.tangents[0]]))[0]) < SMOOTH else 0
    return replace(
        first,
        points=np.concatenate([first.points, second.points[skipped:]]),
        tangents=np.concatenate([first.tangents, second.tangents[skipped:]]),
        behind=np.concatenate([first.behind, first.behind[-1] + second.behind[skipped:]]),
        walls={name: np.concatenate([a, b[skipped:]]) for name, (a, b) in walls.items()},
    )


def _at(line: SeamLine, length: Array) -> list[Array]:
    """Points, travel and normals of the walls at lengths in [m], shape (N,): by cubics, shape (N, 3) each."""
    b = line.behind
    k = np.clip(np.searchsorted(b, length, side="right") - 1, 0, len(b) - 2)
    while np.any(empty := b[k + 1] <= b[k]):
        k[empty] -= 1
    h = (b[k + 1] - b[k])[:, None]
    x = (length - b[k])[:, None] / h
    p, q, dp, dq = line.points[k], line.points[k + 1], h * line.tangents[k], h * line.tangents[k + 1]
    point = p + x * (dp + x * (3.0 * (q - p) - 2.0 * dp - dq + x * (2.0 * (p - q) + dp + dq)))
    turned = [values[k] + x * (values[k + 1] - values[k]) for values in (line.tangents, *line.walls.values())]
    return [point, *(values / np.linalg.norm(values, axis=1, keepdims=True) for values in turned)]


def _angles(vectors: Array) -> Array:
    """Angles in [rad] between neighbouring unit vectors, shape (N - 1,)."""
    return 2.0 * np.arcsin(np.minimum(0.5 * np.linalg.norm(np.diff(vectors, axis=0), axis=1), 1.0))
