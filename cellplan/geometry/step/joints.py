"""Joints between the solids of an assembly: where an edge of one lies on a face of another.

Plates of an assembly share no edge. A seam is where an edge of one solid lies on a face of another one, within a gap,
and both the face and a side of the edge can be seen from outside: a fillet where the side rises from the face, or a
flush seam where it goes on in the plane of another face of that solid. It ends where the face ends, and where another
solid covers it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.step.kernel import Edge, Face, Solid
from cellplan.geometry.step.lines import reversed_line, sampled_line
from cellplan.geometry.transforms import cross

PROBE: Final = 5e-5  # [m] from a seam at which it is looked whether there is material
TOUCH: Final = 1e-6  # [m] solids nearer than this touch
DEEP: Final = 1e-5  # [m] solids that reach farther than this into each other penetrate each other
STEP: Final = 5e-3  # [m] between places of an edge at which seams are looked for
FEWEST: Final = 33  # such places
SHORTEST: Final = 2e-3  # [m] of a seam
SAME_PLACE: Final = 1e-6  # [-] of an edge: places that are nearer than this are one
HALVINGS: Final = 40  # of the stretch in which a seam ends
FACING: Final = np.cos(np.deg2rad(10.0))  # [-] of two normals that face each other, or are those of one plane
STEEPEST: Final = 0.9  # [-] of an edge to a face along which it runs, as a sine
NARROW: Final = 0.5  # [-] of the area of the largest face of a plate, which its narrow faces do not reach
RISING: Final = np.sin(np.deg2rad(10.0))  # [-] of a side that rises from a face


class Place(NamedTuple):
    """A seam of an assembly before it has a name."""

    kind: str  # T, lap, corner, butt or edge
    parts: tuple[int, int]  # places of the solid with the edge and of that with the face
    gap: float  # greatest distance in [m] of the edge from the face
    line: SeamLine


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Meeting:
    """An edge of one solid, one of its two sides, and a face of another solid."""

    edge: Edge
    side: Face  # the face of the edge that is to be seen
    under: Face  # the other face of the edge
    turn: float  # 1.0 where the side lies on the left of the edge, else -1.0
    face: Face
    neighbours: tuple[Face, ...]  # the other faces of the solid of the face
    others: tuple[Solid, ...]  # solids that may cover the seam
    both: tuple[Solid, Solid]
    gap: float

    def seen(self, t: Array) -> tuple[Flags, Flags, Array]:
        """Where there is a fillet, where a flush seam, and the distance of the edge from the face in [m]; (N,)."""
        points, tangents = self.edge.at(t)
        uv, feet, up = self.face.project(points)
        distance = np.linalg.norm(points - feet, axis=1)
        is_on = (distance <= self.gap + TOUCH) & self.face.holds(uv)
        _, _, out = self.side.project(points)
        rise = self.turn * cross(out, tangents)  # along the side, away from the edge
        along = out - np.sum(out * up, axis=1, keepdims=True) * up
        size = np.linalg.norm(along, axis=1, keepdims=True)
        along = along / np.where(size > 0.0, size, 1.0)
        reaches = self.reaches(feet + PROBE * along)
        fillet = is_on & reaches & (np.sum(rise * up, axis=1) > RISING)
        fillet[fillet] = self._is_open(feet[fillet], up[fillet], out[fillet])
        flush = is_on & ~reaches & self._faces(points, up) & (np.abs(np.sum(out * up, axis=1)) < RISING)
        flush[flush] = self.reaches((feet - PROBE * along)[flush])
        flush[flush] = self._goes_on(points[flush], (feet - TOUCH * along)[flush], out[flush], rise[flush])
        return fillet, flush, distance

    @property
    def may_join(self) -> bool:
        """Whether the edge runs along the face anywhere, and not only up to it or through it."""
        t = np.linspace(*self.edge.span, FEWEST)
        points, tangents = self.edge.at(t)
        _, feet, up = self.face.project(points)
        spacing = np.linalg.norm(np.diff(points, axis=0), axis=1).max()
        is_near = np.linalg.norm(points - feet, axis=1) <= self.gap + TOUCH + spacing
        return bool(np.any(is_near & (np.abs(np.sum(tangents * up, axis=1)) < STEEPEST)))

    def reaches(self, points: Array) -> Flags:
        """Whether the face reaches to points in its plane."""
        return self.face.holds(self.face.project(points)[0])

    def _faces(self, points: Array, up: Array) -> Flags:
        """Whether the other face of the edge lies on the face."""
        return np.sum(self.under.project(points)[2] * up, axis=1) < -FACING

    def _is_open(self, feet: Array, up: Array, out: Array) -> Flags:
        """Whether no solid is in the corner between the face and the side."""
        middle = up + out
        middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-9)
        is_open = ~np.any([solid.holds(feet + PROBE * middle) for solid in (*self.both, *self.others)], axis=0)
        if self.others:
            further = feet + (self.gap + PROBE) * (up + out)
            is_open &= ~np.any([solid.holds(further) for solid in self.others], axis=0)
        return is_open

    def _goes_on(self, points: Array, feet: Array, out: Array, rise: Array) -> Flags:
        """Whether another face of the solid goes on in the plane of the side, on the other side of the edge."""
        goes_on = np.zeros(len(points), dtype=bool)
        for face in self.neighbours:
            uv, near, normal = face.project(feet - (PROBE * rise))
            is_flush = np.linalg.norm(near - (feet - PROBE * rise), axis=1) <= 10.0 * TOUCH
            goes_on |= is_flush & (np.sum(normal * out, axis=1) > FACING) & face.holds(uv)
        covered = np.any([solid.holds(points + PROBE * out) for solid in (*self.both, *self.others)], axis=0)
        return goes_on & ~covered

    def at_fillet(self, t: Array) -> tuple[Array, Array, tuple[Array, Array]]:
        """Feet of the edge on the face, travel, and the normals of the side and of the face."""
        points, tangents = self.edge.at(t)
        _, feet, up = self.face.project(points)
        travel = tangents - np.sum(tangents * up, axis=1, keepdims=True) * up
        return feet, travel / np.linalg.norm(travel, axis=1, keepdims=True), (self.side.project(points)[2], up)

    def at_flush(self, t: Array) -> tuple[Array, Array, tuple[Array, Array]]:
        """Middles of the gap, travel, and the normals of both sides."""
        points, tangents = self.edge.at(t)
        _, feet, _ = self.face.project(points)
        out = self.side.project(points)[2]
        return 0.5 * (points + feet), tangents, (out, out)


def joints(solids: Sequence[Solid], gap: float, source: str) -> list[Place]:
    """All seams between solids that are nearer than a gap in [m]; each once.

    The first wall of a seam is that of the first solid, by its name; travel has it on its left, seen from outside.
    """
    places: list[Place] = []
    for first, second in ((a, b) for a in range(len(solids)) for b in range(len(solids)) if a != b):
        if not _near(solids[first].box, solids[second].box, gap):
            continue
        others = tuple(
            other
            for k, other in enumerate(solids)
            if k not in {first, second} and _near(other.box, solids[first].box, gap)
        )
        for place in _between(solids, (first, second), gap, others, source):
            if not any(_is_same(place, other, gap) for other in places):
                places.append(place)
    return places


def penetrating(solids: Sequence[Solid]) -> Iterator[tuple[int, int]]:
    """Places of solids that penetrate each other: no seam is found where the edges of one are inside the other."""
    for a, b in combinations(range(len(solids)), 2):
        if _near(solids[a].box, solids[b].box, -DEEP - TOUCH) and solids[a].penetrates(solids[b], DEEP):
            yield a, b


def _between(
    solids: Sequence[Solid], pair: tuple[int, int], gap: float, others: tuple[Solid, ...], source: str
) -> Iterator[Place]:
    """Seams of the edges of one solid on the faces of another."""
    one, other = solids[pair[0]], solids[pair[1]]
    corners = [solid.corners for solid in (other, *others)]
    for edge in one.edges:
        for face in other.faces:
            if not _near(edge.box, face.box, gap):
                continue
            neighbours = tuple(it for it in other.faces if it is not face and _near(it.box, edge.box, gap))
            for k in (0, 1):
                meeting = _Meeting(
                    edge=edge,
                    side=one.faces[edge.faces[k]],
                    under=one.faces[edge.faces[1 - k]],
                    turn=edge.turns[k],
                    face=face,
                    neighbours=neighbours,
                    others=others,
                    both=(one, other),
                    gap=gap,
                )
                if not meeting.may_join:
                    break
                yield from _seams(meeting, pair, np.concatenate(corners), source)


def _seams(meeting: _Meeting, pair: tuple[int, int], corners: Array, source: str) -> Iterator[Place]:
    """Seams of one meeting: a line for each stretch of the edge."""
    t = _looked_at(meeting, corners)
    middle = 0.5 * (t[:-1] + t[1:])
    fillet, flush, distance = meeting.seen(middle)
    names = (meeting.both[0].name, meeting.both[1].name)
    for kind, marks in ((0, fillet), (1, flush)):
        at = meeting.at_flush if kind else meeting.at_fillet
        for first, last in _stretches(marks):
            span = (_border(meeting, kind, t, middle, first, -1), _border(meeting, kind, t, middle, last, 1))
            line = sampled_line(meeting.edge, span, at, names, source=source)
            if meeting.turn < 0.0:
                line = reversed_line(line)
                line = replace(line, walls={name: line.walls[name] for name in names})
            if line.behind[-1] >= max(SHORTEST, 2.0 * meeting.gap):
                word = _flush_kind(meeting) if kind else _fillet_kind(meeting, 0.5 * (middle[first] + middle[last]))
                yield Place(word, pair, float(distance[first : last + 1].max()), line)


def _looked_at(meeting: _Meeting, corners: Array) -> Array:
    """Parameters of an edge between which seams are looked for: evenly spread, and at corners of other solids."""
    first, last = meeting.edge.span
    length = float(meeting.edge.lengths(np.array([first, last]))[-1])
    t = np.linspace(first, last, max(FEWEST, int(np.ceil(length / STEP)) + 1))
    points, tangents = meeting.edge.at(t)
    reach = 2.0 * meeting.gap + 2.0 * PROBE + np.linalg.norm(np.diff(points, axis=0), axis=1).max()
    apart = np.linalg.norm(points[None] - corners[:, None], axis=2)
    nearest = np.argmin(apart, axis=1)
    is_near = apart.min(axis=1) < reach
    k = nearest[is_near]
    near = t[k] + np.sum((corners[is_near] - points[k]) * tangents[k], axis=1) * (last - first) / length
    every = np.unique(np.clip(np.concatenate([t, near]), first, last))
    every = every[np.concatenate([[True], np.diff(every) > SAME_PLACE * (last - first)])]
    every[-1] = last
    return every


def _stretches(marks: Flags) -> Iterator[tuple[int, int]]:
    """First and last place of each run of marks."""
    ends = np.diff(np.concatenate([[0], marks.astype(int), [0]]))
    yield from zip(np.flatnonzero(ends == 1), np.flatnonzero(ends == -1) - 1, strict=True)


def _border(meeting: _Meeting, kind: int, t: Array, middle: Array, k: int, step: int) -> float:
    """Parameter at which a stretch ends that holds one place and not the next one."""
    if not 0 <= k + step < len(middle):
        return float(t[0] if step < 0 else t[-1])
    inside, outside = float(middle[k]), float(middle[k + step])
    edge = float(t[k] if step < 0 else t[k + 1])
    probes = np.array([edge - step * 1e-7 * abs(t[-1] - t[0]), edge + step * 1e-7 * abs(t[-1] - t[0])])
    is_in, is_out = meeting.seen(probes)[kind]
    if is_in and not is_out:
        return edge
    for _ in range(HALVINGS):
        half = 0.5 * (inside + outside)
        if meeting.seen(np.array([half]))[kind][0]:
            inside = half
        else:
            outside = half
    return inside


def _fillet_kind(meeting: _Meeting, t: float) -> str:
    """Lap where the solid lies flat on the face; else T, or corner where the face ends behind it."""
    if not _is_narrow(meeting.under, meeting.both[0]):
        return "lap"
    points, _ = meeting.edge.at(np.array([t]))
    _, feet, up = meeting.face.project(points)
    out = meeting.side.project(points)[2]
    along = out - np.sum(out * up, axis=1, keepdims=True) * up
    along /= np.linalg.norm(along)
    depth = float(((points - meeting.both[0].corners) @ along[0]).max(initial=0.0))
    behind = feet - (min(depth, _thickness(meeting, points, out)) + 2.0 * PROBE) * along
    return "T" if meeting.reaches(behind)[0] else "corner"


def _thickness(meeting: _Meeting, points: Array, out: Array) -> float:
    """Thickness in [m] of the solid behind a side: to its face that looks the other way."""
    thickness = np.inf
    for face in meeting.both[0].faces:
        _, near, normal = face.project(points)
        if face is not meeting.side and float(np.sum(normal * out)) < -FACING:
            thickness = min(thickness, float(np.linalg.norm(near - points)))
    return thickness


def _flush_kind(meeting: _Meeting) -> str:
    """Butt where both solids meet with their narrow faces, edge where they lie flat on each other, else corner."""
    narrow = _is_narrow(meeting.under, meeting.both[0]), _is_narrow(meeting.face, meeting.both[1])
    return "butt" if all(narrow) else "corner" if any(narrow) else "edge"


def _is_narrow(face: Face, solid: Solid) -> bool:
    """Whether a face is one of the narrow ones of a plate."""
    return face.area < NARROW * max(it.area for it in solid.faces)


def _is_same(one: Place, other: Place, gap: float) -> bool:
    """Whether two seams lie on each other: those of flush edges come up from both solids."""
    if set(one.parts) != set(other.parts):
        return False
    ends = [place.line.points[[0, len(place.line.points) // 2, -1]] for place in (one, other)]
    apart = [np.linalg.norm(ends[0][[0, -1]] - ends[1][order], axis=1).max() for order in ([0, -1], [-1, 0])]
    lengths = abs(one.line.behind[-1] - other.line.behind[-1])
    return bool(min(apart) <= gap + 10.0 * TOUCH and lengths <= gap + 10.0 * TOUCH)


def _near(one: tuple[Array, Array], other: tuple[Array, Array], gap: float) -> bool:
    """Whether two boxes are nearer than a gap in [m]."""
    reach = gap + TOUCH
    return bool(np.all(one[0] - reach <= other[1]) and np.all(other[0] - reach <= one[1]))
