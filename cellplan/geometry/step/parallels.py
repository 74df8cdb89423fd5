"""Parallels on a face: lengths along a base line and distances from it, both measured on the surface.

The base line is a geodesic, and from each of its points a geodesic leaves at a right angle. The points at one distance
along these form a line that has this distance from the base line everywhere and crosses them at right angles: Gauss's
lemma. Two such lines are as far apart on the surface as their distances differ.

Beyond its border a face goes on along its surface, and beyond the end of that in the tangent planes there.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.step.kernel import MM, Face
from cellplan.geometry.transforms import cross, rotated, rotation_about

SHARE: Final = 1.0 / 32.0  # [-] of half of the extent of a face: spacing of the points of a chart
LARGEST_TURN: Final = 0.15  # [rad] of the normal between two points of a chart
FINER: Final = 2  # halvings of the spacing until that is kept
FARTHEST: Final = 3.3  # [-] half extents that a geodesic runs for at most: once round a ball
AHEAD: Final = 6.0  # spacings by which it runs on behind the last point of the face
SPREAD: Final = 33  # points along both directions of a face that stand for it, and the fewest along an edge
MOST_OF_EDGE: Final = 2001
NARROWEST: Final = 0.02  # [-] of the distance of two geodesics at the base line: nearer ones are about to meet
CLOSING: Final = 0.1  # spacings by which a closed geodesic may miss its begin
ON_FACE: Final = 1e-7  # [m] along the surface, to its nearest point: farther ones are beyond its end
COVERED: Final = 0.8  # spacings from a place to the nearest point of a chart that covers it
SHEETS: Final = 4.0  # spacings within a chart between two points of it that cover one place twice
UPRIGHT: Final = 0.98  # [-] along x of a normal on which x has no direction
MOVED: Final = 1e-3  # [-] of half of the extent: move of the middle on trial
STEADY: Final = 4.0  # times as far the nearest point may then move
ORDER: Final = 4  # points of a chart along the base line through which a cubic runs
REFINED: Final = 3  # steps of Newton's method to the lengths and distances of a place
CURE: Final = "choose another direction_deg, or divide the face"


class _Ends(NamedTuple):
    """Ends of geodesics, or stretches of them behind one another."""

    points: Array  # in [m], shape (..., 3)
    along: Array  # unit directions, likewise
    normals: Array  # outward unit normals, likewise
    uv: Array  # parameters, shape (..., 2)


class Places(NamedTuple):
    """Points of a surface."""

    points: Array  # in [m], shape (N, 3)
    normals: Array  # outward unit normals, likewise
    is_on: Flags  # whether they lie within the border of the face or on it, shape (N,)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chart:
    """Points of a face at even lengths s of a base line and even distances d from it, to its left seen from outside.

    Attributes:
        face: The face.
        spacing: Spacing of lengths and of distances in [m].
        first: Length and distance in [m] of the first point.
        nodes: Points and directions of growing distance, by distance and length, shape (K, S, ...).
        is_on: Whether a point is on the face, shape (K, S).
        is_used: Whether a point is on the face or next to it, before geodesics meet or come back, shape (K, S).
        around: Lengths in [m] after which the base line, and geodesics across, come back; infinite for open ones.
    """

    face: Face
    spacing: float
    first: tuple[float, float]
    nodes: _Ends
    is_on: Flags
    is_used: Flags
    around: tuple[float, float]

    def at(self, s: Array, d: Array) -> Places:
        """The surface at lengths and distances in [m], shape (N,) each."""
        points, k, i = self._between(s, d)
        uv, feet, normals = self.face.project(points, self.nodes.uv[k, i])
        points, is_over = _extended(points, feet, normals)
        return Places(points, normals, self.face.holds(uv) & is_over)

    def place(self, points: Array) -> tuple[Array, Array]:
        """Lengths and distances in [m], shape (N,) each, of points of the face, shape (N, 3).

        Raises:
            InputError: A point is not covered by the chart, or twice.
        """
        k, i = self._nearest(points)
        s: Array = self.first[0] + i.astype(np.float64) * self.spacing
        d: Array = self.first[1] + k.astype(np.float64) * self.spacing
        across, along = self.nodes.along[k, i], cross(self.nodes.along[k, i], self.nodes.normals[k, i])
        width = np.maximum(_widths(self.nodes, self.spacing)[k, i], NARROWEST)
        for _ in range(REFINED):
            off = points - self._between(s, d)[0]
            s, d = s + np.sum(off * along, axis=1) / width, d + np.sum(off * across, axis=1)
        return s, d

    @property
    def sharpest(self) -> float:
        """Greatest curvature in [1/m] of the geodesics across within the face."""
        is_on = self.is_used & self.is_on
        turns = np.linalg.norm(np.diff(self.nodes.normals, axis=0), axis=2)
        return float(np.where(is_on[1:] & is_on[:-1], turns, 0.0).max() / self.spacing)

    @property
    def turn(self) -> float:
        """Greatest angle in [rad] between the normals at neighbouring points."""
        n, is_used = self.nodes.normals, self.is_used & self.is_on
        down = np.linalg.norm(np.diff(n, axis=0), axis=2) * (is_used[1:] & is_used[:-1])
        lateral = np.linalg.norm(np.diff(n, axis=1), axis=2) * (is_used[:, 1:] & is_used[:, :-1])
        return float(max(down.max(), lateral.max()))

    def _nearest(self, points: Array) -> tuple[Indices, Indices]:
        """Row and column of the nearest point of the chart to each of some points of the face."""
        used, reach = np.argwhere(self.is_used), COVERED * self.spacing
        nodes = self.nodes.points[tuple(used.T)]
        widest = max(1.0, float(_widths(self.nodes, self.spacing).max()))
        best = np.empty((len(points), 2), dtype=np.intp)
        for row, point in enumerate(points):
            apart = np.linalg.norm(nodes - point, axis=1)
            best[row] = used[int(np.argmin(apart))]
            if apart.min() > reach * widest:
                raise InputError(f"expected a face that parallel lines reach, but not at {_in_mm(point)}: {CURE}")
            off = self.spacing * np.abs(used[apart < reach] - best[row])[:, ::-1]
            off = np.minimum(off, np.abs(off - self.around))
            if np.linalg.norm(off, axis=1).max(initial=0.0) > SHEETS * self.spacing:
                text = f"expected a face that parallel lines cover once, but they meet at {_in_mm(point)}"
                raise InputError(f"{text}: {CURE}")
        return best[:, 0], best[:, 1]

    def _between(self, s: Array, d: Array) -> tuple[Array, Indices, Indices]:
        """Points between those of the chart by cubics, shape (N, 3), and row and column of one that is near each."""
        x, y = (s - self.first[0]) / self.spacing, (d - self.first[1]) / self.spacing
        i = np.clip(np.floor(x).astype(np.intp) - 1, 0, self.is_used.shape[1] - ORDER)
        k = np.clip(np.floor(y).astype(np.intp), 0, self.is_used.shape[0] - 2)
        x, y = (x - i)[:, None], (y - k)[:, None]
        points, along = self.nodes.points, self.spacing * self.nodes.along
        total = np.zeros((len(s), 3))
        for n in range(ORDER):
            p, q, dp, dq = (values[row, i + n] for values in (points, along) for row in (k, k + 1))
            column = p + y * (dp + y * (3.0 * (q - p) - 2.0 * dp - dq + y * (2.0 * (p - q) + dp + dq)))
            total += column * np.prod([(x - m) / (n - m) for m in range(ORDER) if m != n], axis=0)
        return total, k, i + 1


def chart_of(face: Face, angle: float) -> Chart:
    """Lengths and distances on a face, from the point of its surface that is nearest to the middle of its area.

    Args:
        face: The face.
        angle: Direction of the base line in that point, in [rad] from the x axis of the file as it lies on the face
            (from its y axis where x stands upright on it), counter-clockwise seen from outside.
    """
    places = np.concatenate([*border_of(face), _within(face)])
    begin = _begin(face, places, angle)
    spacing = SHARE * float(np.linalg.norm(places - begin.points, axis=1).max())
    chart = _charted(face, begin, places, spacing)
    for _ in range(FINER):
        if chart.turn <= LARGEST_TURN:
            break
        spacing *= 0.5
        chart = _charted(face, begin, places, spacing)
    return chart


def border_of(face: Face) -> list[Array]:
    """Points along each edge of a face, shape (N, 3) each."""
    lines = []
    for edge in face.border():
        length = float(edge.lengths(np.array(edge.span))[-1])
        spacing = SHARE * 0.5 * float(np.linalg.norm(face.box[1] - face.box[0]))
        lines.append(edge.at(np.linspace(*edge.span, int(np.clip(4.0 * length / spacing, SPREAD, MOST_OF_EDGE))))[0])
    return lines


def _within(face: Face) -> Array:
    """Points spread over a face by its parameters, shape (N, 3)."""
    low_u, high_u, low_v, high_v = face.bounds()
    u, v = np.meshgrid(np.linspace(low_u, high_u, SPREAD), np.linspace(low_v, high_v, SPREAD))
    uv = np.column_stack([u.ravel(), v.ravel()])
    return face.at(uv[face.holds(uv)])[0]


def _begin(face: Face, places: Array, angle: float) -> _Ends:
    """The middle of a face with the direction of its base line; of one that is bent round, that of its parameters."""
    middle = face.middle
    size = float(np.linalg.norm(places - middle, axis=1).max())
    feet = face.project(middle + np.concatenate([np.zeros((1, 3)), MOVED * size * np.eye(3)]))[1]
    if np.linalg.norm(feet - feet[0], axis=1).max() > STEADY * MOVED * size:
        low_u, high_u, low_v, high_v = face.bounds()
        feet, _ = face.at(np.array([[0.5 * (low_u + high_u), 0.5 * (low_v + high_v)]]))
    uv, feet, normals = face.project(feet[:1])
    axis = np.eye(3)[1 if abs(normals[0, 0]) > UPRIGHT else 0]
    along = _on_surface(axis[None], normals)[0]
    return _Ends(feet, rotated(rotation_about(normals[0], angle), along), normals, uv)


def _charted(face: Face, begin: _Ends, places: Array, spacing: float) -> Chart:
    """The chart with a spacing that reaches over some points of the face."""
    base, before, around = _ahead_and_behind(face, begin, places, spacing)
    most = before if np.isinf(around) else min(before, int(0.5 * around / spacing) + ORDER)
    base = _Ends(*(values[before - most : before + most + 1, 0] for values in base))
    across = base._replace(along=cross(base.normals, base.along))
    nodes, below, around_across = _ahead_and_behind(face, across, places, spacing)
    is_apart = _widths(nodes, spacing) > NARROWEST
    is_apart[below:] = np.logical_and.accumulate(is_apart[below:], axis=0)
    is_apart[below::-1] = np.logical_and.accumulate(is_apart[below::-1], axis=0)
    is_on = face.holds(nodes.uv.reshape(-1, 2)).reshape(is_apart.shape)
    s, d = (spacing * (np.arange(n) - zero) for n, zero in ((len(base.points), most), (len(is_apart), below)))
    return Chart(
        face=face,
        spacing=spacing,
        first=(float(s[0]), float(d[0])),
        nodes=nodes,
        is_on=is_on,
        is_used=is_apart & _grown(is_on) & (np.abs(s) <= 0.5 * around) & (np.abs(d) <= 0.5 * around_across)[:, None],
        around=(around, around_across),
    )


def _grown(flags: Flags) -> Flags:
    """Flags with their neighbours in a grid, shape (K, S)."""
    rows = np.pad(flags, 1)
    rows = rows[:-2] | rows[1:-1] | rows[2:]
    return rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]


def _ahead_and_behind(face: Face, begin: _Ends, places: Array, spacing: float) -> tuple[_Ends, int, float]:
    """Geodesics through points, from their ends behind to those ahead, shape (K, N, ...).

    Returns:
        The geodesics, the row of the points that they begin at, and the length after which all come back.
    """
    ahead = _geodesics(face, begin, places, spacing)
    behind = _geodesics(face, begin._replace(along=-begin.along), places, spacing)
    behind = behind._replace(along=-behind.along)
    rows = _Ends(*(np.concatenate([one[:0:-1], other]) for one, other in zip(behind, ahead, strict=True)))
    return rows, len(behind.points) - 1, _around(ahead, spacing)


def _geodesics(face: Face, begin: _Ends, places: Array, spacing: float) -> _Ends:
    """Geodesics from points at even lengths, until no place of the face is ahead of them, shape (K, N, ...)."""
    rows = [begin]
    half = float(np.linalg.norm(places - begin.points[len(begin.points) // 2], axis=1).max())
    for _ in range(max(int(np.ceil(FARTHEST * half / spacing)), ORDER)):
        end = rows[-1]
        ahead = (places @ end.along.T).max(axis=0) - np.sum(end.points * end.along, axis=1)
        if len(rows) > ORDER and np.all(ahead < -AHEAD * spacing):
            break
        rows.append(_farther(face, end, spacing))
    return _Ends(*(np.stack(values) for values in zip(*rows, strict=True)))


def _farther(face: Face, end: _Ends, length: float) -> _Ends:
    """Ends of geodesics that are longer by a length: along the circle that bends as the surface does."""
    x, t, n, uv = end
    _, tilted = _foot(face, x + length * t, uv)[1:]
    angle = np.arctan2(np.sum(tilted * t, axis=1), np.sum(tilted * n, axis=1))[:, None]
    bend = np.tan(np.clip(angle, -1.0, 1.0))  # length of the step by the radius of curvature
    along, off = length * np.sinc(bend / np.pi), length * 0.5 * bend * np.sinc(0.5 * bend / np.pi) ** 2
    uv, y, normals = _foot(face, x + along * t - off * n, uv)
    chord = (y - x) / np.linalg.norm(y - x, axis=1, keepdims=True)
    return _Ends(y, _on_surface(2.0 * np.sum(t * chord, axis=1, keepdims=True) * chord - t, normals), normals, uv)


def _foot(face: Face, points: Array, near: Array) -> tuple[Array, Array, Array]:
    """Parameters, nearest points of a surface that goes on beyond its end, and outward normals."""
    uv, feet, normals = face.project(points, near)
    return uv, _extended(points, feet, normals)[0], normals


def _extended(points: Array, feet: Array, normals: Array) -> tuple[Array, Flags]:
    """Points moved onto a surface, or into the tangent plane at its end, and whether the surface is below them."""
    off = points - feet
    lateral = off - np.sum(off * normals, axis=1, keepdims=True) * normals
    return feet + lateral, np.linalg.norm(lateral, axis=1) <= ON_FACE


def _on_surface(vectors: Array, normals: Array) -> Array:
    """Unit vectors along others in the tangent planes with some normals, shape (N, 3)."""
    flat = vectors - np.sum(vectors * normals, axis=1, keepdims=True) * normals
    return flat / np.linalg.norm(flat, axis=1, keepdims=True)


def _around(rows: _Ends, spacing: float) -> float:
    """Length in [m] after which all of some geodesics come back to their begin; infinite where one does not."""
    off = rows.points[ORDER:] - rows.points[0]
    along = np.sum(off * rows.along[0], axis=2)
    miss = np.linalg.norm(off - along[..., None] * rows.along[0], axis=2)
    is_back = (np.abs(along) <= spacing) & (miss <= CLOSING * spacing)
    if not np.all(is_back.any(axis=0)):
        return np.inf
    first, columns = np.argmax(is_back, axis=0), np.arange(is_back.shape[1])
    return float(np.min((first + ORDER) * spacing - along[first, columns]))


def _widths(nodes: _Ends, spacing: float) -> Array:
    """Distances of neighbouring geodesics as shares of those at the base line, shape (K, S)."""
    return np.sum(np.gradient(nodes.points, spacing, axis=1) * cross(nodes.along, nodes.normals), axis=2)


def _in_mm(point: Sequence[float] | Array) -> str:
    """A point for a message."""
    return "(" + ", ".join(f"{MM * x:.4g}" for x in point) + ") mm"
