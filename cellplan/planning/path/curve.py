"""The curve of a task's path in the part frame, with its stops, before projection; which points it may pass."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import (
    BezierCurve,
    CircleCurve,
    Curve,
    chord_lengths,
    cubic_controls,
    rounded_sides,
    smooth_through,
    straight_sides,
    tangents,
    turns,
)
from cellplan.geometry.curves.seam_line import SeamLine, SeamPlaces
from cellplan.geometry.curves.spline import spline_through
from cellplan.geometry.curves.surface_patch import Patch
from cellplan.model.task.path_direction import outside_of, plane_axes
from cellplan.model.task.task import (
    CirclePath,
    PolygonPath,
    RunDirection,
    SampledPath,
    SpacePolylinePath,
    Task,
    TimedPath,
)
from cellplan.planning.path.formatting import direction_name, in_mm, length

NEAR_SMOOTH: Final = 0.01  # [-] of the distance to their other neighbours: a smooth curve turns with such a pair …
NEAR_STRAIGHT: Final = 1e-4  # [-] … and straight sides do not: there it is a point written twice with rounding
UNEVEN: Final = 0.1  # [-] of the longer side at a point: the shorter one alone gives the direction there
WIDEST_TURN: Final = np.deg2rad(20.0)  # [rad] at such a point: the longer side bends by up to 5 % of its length
BULGE: Final = 4.0 / 27.0  # [-] of a side's length, times the sine of the angle at one end: the bend of a cubic
MOST_JOINED_MM: Final = 1.0  # [mm] farther points are joined by hand
LOOKED_AT: Final = 33  # places of each side at which a curve is held against it
SAME_POINT: Final = 1e-9  # [m] points nearer than this are one point written twice
STRAIGHT_ON: Final = 1e-9  # [rad] a change of direction below this is no corner
SMOOTH_START: Final = 1e-6  # [rad] a change of direction below this is none where a seam line comes back to its start
SHARPEST_BLEND: Final = np.deg2rad(175.0)  # a path that turns back more sharply cannot be rounded without a cusp
IN_PLANE: Final = np.sin(np.deg2rad(1.0))  # [-] a side seen at a flatter angle than 1 deg squeezes the path to a line


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathCurve:
    """The curve of a tool tip in P: as its task states it, or projected onto the part."""

    curve: Curve
    stops: Array  # parameters at which the tool rests: the start, corners that are not rounded, the end
    given: Array  # parameters of the points as they were listed, shape (N,); a closed path ends with its start
    is_closed: bool  # whether the end is the start
    runs_on: bool = False  # whether a closed curve passes its start without a corner
    patch: Patch | None = None  # the smooth patch of the part under it; None on a mesh or where it is not projected
    inward: Curve | None = None  # inward normals of a mesh along the curve; None elsewhere
    walls: Mapping[str, Curve] = field(
        default_factory=dict
    )  # outward normals of walls that a seam line states, by name
    seam: SeamPlaces | None = None  # the seam that the tool follows; None without walls
    work: Array | None = None  # parameters between which the work is, where runs come before and behind it, shape (2,)
    bulge: float | None = None  # greatest distance in [m] of a smooth curve from its chords, unprojected; else None


def path_curve(task: Task) -> PathCurve:
    """Draw the path of a task in the part frame.

    Listed points are passed in their order; shapes that have none run the way round that their task says.
    """
    path = task.path
    where = task.where("path")
    match path:
        case CirclePath():
            return _circle(path, task, where)
        case PolygonPath():
            return _sides(_polygon_points(path, task, where), task)
        case SpacePolylinePath():
            _refuse_poor_points(np.asarray(path.points), path.is_closed, where=where)
            return _sides(_closed(np.asarray(path.points, dtype=float), path.is_closed), task)
        case SampledPath():
            _refuse_poor_points(path.points, path.is_closed, where=where, path=path)
            points = _closed(path.points, path.is_closed)
            given = chord_lengths(_closed(path.listed.points, path.is_closed))
            return _smooth(points, given, path.is_closed) if path.is_smooth else _sides(points, task)
        case TimedPath():
            refuse_near_times(path, where)
            return _timed(path)
        case SeamLine():
            return _seam_line(path, task)


def _circle(path: CirclePath, task: Task, where: str) -> PathCurve:
    """Full circle from its start."""
    if not path.radius > SAME_POINT:
        raise InputError(f"{where}: expected a circle with a radius above zero, got {length(path.radius)} mm")
    first, second, normal = plane_axes(path.plane)
    turn = 1.0 if path.direction is RunDirection.COUNTERCLOCKWISE else -1.0
    if _outside(task, normal, where) @ normal < 0.0:
        turn = -turn
    u, v = path.start
    curve = CircleCurve(
        centre=path.center[0] * first + path.center[1] * second + task.plane_offset * normal,
        first=path.radius * (u * first + v * second),
        second=turn * path.radius * (u * second - v * first),
    )
    return PathCurve(curve=curve, stops=curve.knots, given=curve.knots, is_closed=True, runs_on=True)


def _polygon_points(path: PolygonPath, task: Task, where: str) -> Array:
    """Corners in P in the order they are passed; the first is repeated at the end of a closed path."""
    corners = np.asarray(path.corners, dtype=float).reshape(-1, 2)
    first, second, normal = plane_axes(path.plane)
    points = corners @ np.stack([first, second]) + task.plane_offset * normal
    _refuse_poor_points(points, path.is_closed, where=where)
    outside = _outside(task, normal, where)
    if path.direction is not None:
        u, v = (corners - corners.mean(axis=0)).T
        area = 0.5 * float(np.sum(u * np.roll(v, -1) - v * np.roll(u, -1))) * (outside @ normal)
        if (area < 0.0) == (path.direction is RunDirection.COUNTERCLOCKWISE):
            points = np.concatenate([points[:1], points[:0:-1]])
    return _closed(points, path.is_closed)


def _outside(task: Task, normal: Array, where: str) -> Array:
    """Direction a planar path is seen from: the side it is projected from, else against the tool axis."""
    if task.project is not None and abs(task.project @ normal) < IN_PLANE:
        raise InputError(
            f"{where}.project: expected a side that faces the path's plane, got {direction_name(task.project)}, which "
            f"lies in it; project from {direction_name(normal)} or {direction_name(-normal)}"
        )
    return outside_of(task, normal)


def _refuse_poor_points(points: Array, is_closed: bool, *, where: str, path: SampledPath | None = None) -> None:
    """Refuse too few points, points that are not finite and points that are written twice, exactly or nearly."""
    fewest = 3 if is_closed else 2
    if len(points) < fewest:
        kind = "a closed path" if is_closed else "a path"
        raise InputError(f"{where}: expected at least {fewest} points for {kind}, got {len(points)}")
    if not np.all(np.isfinite(points)):
        raise InputError(f"{where}: expected finite coordinates, but point {_first(~np.isfinite(points))} has none")
    repeated = np.linalg.norm(np.diff(points, axis=0), axis=1) <= SAME_POINT
    if np.any(repeated):
        k = _first(repeated)
        raise InputError(
            f"{where}: expected points that differ, but {named_points(k - 1, len(points), path)} are both at "
            f"{in_mm(points[k])}; leave one out"
        )
    if is_closed and np.linalg.norm(points[-1] - points[0]) <= SAME_POINT:
        raise InputError(
            f"{where}: expected a closed path to be listed without its return, but the last point repeats the first "
            f"at {in_mm(points[0])}; leave the last point out"
        )
    refuse_near_points(points, path, where=where, is_closed=is_closed, is_smooth=path is not None and path.is_smooth)


def _first(marks: Flags) -> int:
    """Number, from 1, of the first marked row."""
    return int(np.argmax(marks.reshape(len(marks), -1).any(axis=1))) + 1


def _closed(points: Array, is_closed: bool) -> Array:
    """Points with the first one repeated at the end when the path is closed."""
    return np.vstack([points, points[:1]]) if is_closed else points


def _smooth(points: Array, given: Array, is_closed: bool) -> PathCurve:
    """Smooth curve through points at parameters, shape (N,); a closed one passes its start smoothly."""
    breaks = np.zeros(len(points), dtype=bool)
    breaks[[0, -1]] = not is_closed
    curve = smooth_through(given, points, breaks=breaks)
    return _run_on(curve, given, is_closed=is_closed)


def _timed(path: TimedPath) -> PathCurve:
    """Smooth curve over time."""
    curve = spline_through(path.times, path.points, is_closed=path.is_closed)
    return _run_on(curve, path.times, is_closed=path.is_closed)


def _seam_line(path: SeamLine, task: Task) -> PathCurve:
    """Cubics by the points and directions of a seam line, with stops at its corners, and the normals of its walls."""
    is_side = np.diff(path.behind) > 0.0
    knots = np.append(path.behind[:-1][is_side], path.behind[-1])
    width = np.diff(knots)[:, None]

    def spans(values: Array, rates: Array | None = None) -> BezierCurve:
        """Cubics through values, by their rates if they are known."""
        start, end = values[:-1][is_side], values[1:][is_side]
        at_ends = tangents((end - start) / width, width, breaks)
        if rates is not None:
            at_ends = rates[:-1][is_side], rates[1:][is_side]
        return BezierCurve(knots=knots, control=cubic_controls(width, (start, end), at_ends))

    corners = path.behind[:-1][~is_side]
    if len(corners) and task.blend is not None:
        raise InputError(
            f"{task.where('corners', shared='motion.corners')}: expected stop for a chain of edges with corners, got a "
            "rounding: its corners are where its edges meet"
        )
    is_smooth = path.is_closed and bool(np.linalg.norm(path.tangents[0] - path.tangents[-1]) <= SMOOTH_START)
    breaks = np.isin(knots, corners)
    breaks[[0, -1]] = not is_smooth
    walls = {name: spans(normals) for name, normals in path.walls.items()}
    stops = np.unique(np.concatenate([knots[[0, -1]], corners]))
    return PathCurve(
        curve=spans(path.points, path.tangents),
        stops=stops,
        given=knots,
        is_closed=path.is_closed,
        runs_on=is_smooth and not len(corners),
        walls=walls,
    )


def _run_on(curve: BezierCurve, given: Array, *, is_closed: bool) -> PathCurve:
    """A smooth curve through points at parameters, shape (N,), that stops at its ends alone."""
    bulge = largest_bulge(curve)
    return PathCurve(
        curve=curve, stops=given[[0, -1]], given=given, is_closed=is_closed, runs_on=is_closed, bulge=bulge
    )


def _sides(points: Array, task: Task) -> PathCurve:
    """Straight sides that stop at every corner, or rounded corners without a stop."""
    given = chord_lengths(points)
    is_closed = bool(np.linalg.norm(points[-1] - points[0]) <= SAME_POINT)
    angles = turns(points)
    is_corner = np.concatenate([[True], angles > STRAIGHT_ON, [True]])
    if task.project is not None:
        _refuse_hidden_sides(points, task.project, task.where("path"))
    if task.blend is None:
        curve = straight_sides(given, points)
        return PathCurve(curve=curve, stops=given[is_corner], given=given, is_closed=is_closed)
    corners, at = points[is_corner], given[is_corner]
    seen = corners if task.project is None else corners - np.outer(corners @ task.project, task.project)
    _refuse_blend(
        corners, np.maximum(turns(corners), turns(seen)), task.blend, task.where("corners", shared="motion.corners")
    )
    rounded: BezierCurve = rounded_sides(at, corners, task.blend)
    return PathCurve(curve=rounded, stops=given[[0, -1]], given=given, is_closed=is_closed)


def _refuse_hidden_sides(points: Array, direction: Array, where: str) -> None:
    """Refuse a straight side that runs along the projection: on the part it would be a point."""
    sides = np.diff(points, axis=0)
    lengths = np.linalg.norm(sides, axis=1)
    is_hidden = np.linalg.norm(np.cross(sides, direction), axis=1) < IN_PLANE * lengths
    if np.any(is_hidden):
        k = int(np.argmax(is_hidden))
        raise InputError(
            f"{where}: expected sides across the projection from {direction_name(direction)}, but the side from "
            f"{in_mm(points[k])} to {in_mm(points[k + 1])} runs along it"
        )


def _refuse_blend(corners: Array, angles: Array, blend: float, where: str) -> None:
    """Refuse a rounding that does not fit the sides, or a corner that turns back."""
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    half = 0.5 * np.minimum(sides[:-1], sides[1:])
    if not blend > 0.0:
        raise InputError(f"{where}: expected a rounding above zero, got {length(blend)} mm; or write corners: stop")
    if np.any(blend > half + SAME_POINT):
        k = int(np.argmin(half))
        raise InputError(
            f"{where}: expected a rounding of at most {length(half[k])} mm, half of the shorter side at the corner "
            f"{in_mm(corners[k + 1])}, got {length(blend)} mm"
        )
    if np.any(angles > SHARPEST_BLEND):
        k = int(np.argmax(angles))
        raise InputError(
            f"{where}: expected corners that turn by at most {np.rad2deg(SHARPEST_BLEND):g} deg to be rounded, "
            f"got {np.rad2deg(angles[k]):.4g} deg at {in_mm(corners[k + 1])}; write corners: stop"
        )


def refuse_near_points(
    points: Array, path: SampledPath | TimedPath | None, *, where: str, is_closed: bool, is_smooth: bool
) -> None:
    """Refuse points that are nearly one point, and a smooth curve whose direction hangs on a very short side.

    Args:
        points: Points as listed, shape (N, 3); all differ.
        path: Where they come from, for messages; None for a list in the cell file.
        is_closed: Whether the last point is joined to the first.
        is_smooth: Whether a smooth curve joins them.
    """
    ends = np.vstack([points, points[:1]]) if is_closed else points
    sides = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    share = NEAR_SMOOTH if is_smooth else NEAR_STRAIGHT
    k, others = _isolated(sides, share, is_closed=is_closed)
    if k is not None:
        cure = "leave one out"
        if isinstance(path, SampledPath) and 1e3 * sides[k] < MOST_JOINED_MM:
            enough = 10.0 ** np.ceil(np.log10(1e3 * sides[k] * (1.0 + 1e-6)))
            cure += f", or join them with csv: {{file: {path.source}, join_mm: {enough:g}}}"
        raise InputError(
            f"{where}: expected points that are at least {100.0 * share:g} % of the distance to their other neighbours "
            f"apart ({length(others)} mm), but {named_points(k, len(points), path)} are {length(sides[k])} mm apart at "
            f"{in_mm(ends[k])}; {cure}"
        )
    if is_smooth:
        _refuse_bends(ends, sides, path, where=where, is_closed=is_closed)


def refuse_near_times(path: TimedPath, where: str) -> None:
    """Refuse two rows of a trajectory between which hardly any time passes."""
    steps = np.diff(path.times)
    k, others = _isolated(steps, NEAR_SMOOTH, is_closed=path.is_closed)
    if k is not None:
        raise InputError(
            f"{where}: expected rows that are at least {100.0 * NEAR_SMOOTH:g} % of the time to their other neighbours "
            f"apart ({others:.6g} s), but {named_points(k, len(path.times), path)} are {steps[k]:.6g} s apart, at "
            f"{path.times[k]:.6g} s: a smooth motion takes its speed from them; leave one out"
        )


def largest_bulge(curve: BezierCurve) -> float:
    """Largest distance in [m] of a curve from the straight line between the knots of each of its spans."""
    share = np.linspace(0.0, 1.0, LOOKED_AT)
    low, width = curve.knots[:-1, None], np.diff(curve.knots)[:, None]
    u = np.minimum(low + share * width, curve.knots[1:, None])
    p, _ = curve.evaluate(u.ravel(), (float(curve.knots[0]), float(curve.knots[-1])))
    from_start = p.reshape(*u.shape, 3) - curve.control[:, None, 0]
    chord = (curve.control[:, -1] - curve.control[:, 0])[:, None]
    square = np.maximum(np.sum(chord**2, axis=2), np.finfo(float).tiny)
    along = np.clip(np.sum(from_start * chord, axis=2) / square, 0.0, 1.0)
    return float(np.linalg.norm(from_start - along[..., None] * chord, axis=2).max())


def named_points(k: int, count: int, path: SampledPath | TimedPath | None) -> str:
    """The two points of a side, with their lines."""
    return f"points {k + 1} and {(k + 1) % count + 1}{_lines(path, k, (k + 1) % count)}"


def _isolated(sides: Array, share: float, *, is_closed: bool) -> tuple[int | None, float]:
    """The first side that is shorter than a share of each of its neighbours, and the shorter one of these."""
    if len(sides) < 2:
        return None, 0.0
    before, after = np.roll(sides, 1), np.roll(sides, -1)
    if not is_closed:
        before[0], after[-1] = np.inf, np.inf
    others = np.minimum(before, after)
    is_near = sides < share * others
    k = int(np.argmax(is_near))
    return (k, float(others[k])) if is_near[k] else (None, 0.0)


def _refuse_bends(
    ends: Array, sides: Array, path: SampledPath | TimedPath | None, *, where: str, is_closed: bool
) -> None:
    """Refuse a turn at a point between a very short side and a long one, which would bend with the short one."""
    t = np.diff(ends, axis=0) / sides[:, None]
    before, after = (t, np.roll(t, -1, axis=0)) if is_closed else (t[:-1], t[1:])
    turns = np.arctan2(np.linalg.norm(np.cross(before, after), axis=1), np.sum(before * after, axis=1))
    pairs = np.stack([sides, np.roll(sides, -1)])[:, : len(turns)]
    is_bad = (pairs.min(axis=0) < UNEVEN * pairs.max(axis=0)) & (turns > WIDEST_TURN)
    if not np.any(is_bad):
        return
    bends = BULGE * pairs.max(axis=0) * np.sin(np.minimum(turns, np.pi / 2.0))
    k = int(np.argmax(np.where(is_bad, bends, 0.0)))
    place = (k + 1) % (len(sides) if is_closed else len(ends))
    short, long = sorted(pairs[:, k])
    raise InputError(
        f"{where}: expected a smooth curve to turn by at most {np.rad2deg(WIDEST_TURN):g} deg between sides of less "
        f"than a tenth of each other's length, but at point {place + 1}{_lines(path, place)}, {in_mm(ends[k + 1])}, it "
        f"turns by {np.rad2deg(turns[k]):.3g} deg between sides of {length(short)} and {length(long)} mm: the longer "
        f"one would bend by about {length(round(bends[k], 6))} mm; add points between, leave points out, or set "
        "smooth: false"
    )


def _lines(path: SampledPath | TimedPath | None, *places: int) -> str:
    """Lines of points in their file: `` (p.csv, lines 4 and 5)``."""
    if path is None:
        return ""
    given = path.lines if isinstance(path, SampledPath) else ()
    rows = given or range(2, len(path.points) + 2)  # below the header
    return f" ({path.source}, line{'s' if len(places) > 1 else ''} {' and '.join(str(rows[k]) for k in places)})"
