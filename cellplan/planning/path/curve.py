"""The curve of a task's path in the part frame, with its stops, before projection."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array, Flags
from cellplan.geometry.curves.curve import (
    BezierCurve,
    CircleCurve,
    Curve,
    chord_lengths,
    rounded_sides,
    smooth_through,
    straight_sides,
)
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
from cellplan.planning.path.point_spacing import largest_bulge, named_points, refuse_near_points, refuse_near_times

SAME_POINT: Final = 1e-9  # [m] points nearer than this are one point written twice
STRAIGHT_ON: Final = 1e-9  # [rad] a change of direction below this is no corner
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
    inward: BezierCurve | None = None  # inward normals of a mesh along the curve; None elsewhere
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
            return _smooth(points, path.is_closed) if path.is_smooth else _sides(points, task)
        case TimedPath():
            refuse_near_times(path, where)
            return _timed(path)


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


def _smooth(points: Array, is_closed: bool) -> PathCurve:
    """Smooth curve through points; a closed one passes its start smoothly."""
    given = chord_lengths(points)
    breaks = np.zeros(len(points), dtype=bool)
    breaks[[0, -1]] = not is_closed
    curve = smooth_through(given, points, breaks=breaks)
    return _run_on(curve, given, is_closed=is_closed)


def _timed(path: TimedPath) -> PathCurve:
    """Smooth curve over time."""
    curve = spline_through(path.times, path.points, is_closed=path.is_closed)
    return _run_on(curve, path.times, is_closed=path.is_closed)


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
    angles = _turns(points)
    is_corner = np.concatenate([[True], angles > STRAIGHT_ON, [True]])
    if task.project is not None:
        _refuse_hidden_sides(points, task.project, task.where("path"))
    if task.blend is None:
        curve = straight_sides(given, points)
        return PathCurve(curve=curve, stops=given[is_corner], given=given, is_closed=is_closed)
    corners, at = points[is_corner], given[is_corner]
    seen = corners if task.project is None else corners - np.outer(corners @ task.project, task.project)
    _refuse_blend(
        corners, np.maximum(_turns(corners), _turns(seen)), task.blend, task.where("corners", shared="motion.corners")
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


def _turns(points: Array) -> Array:
    """Change of direction in [rad] at each inner point of straight sides, shape (N - 2,)."""
    sides = np.diff(points, axis=0)
    t = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    sine = np.linalg.norm(np.cross(t[:-1], t[1:]), axis=1)
    return np.arctan2(sine, np.sum(t[:-1] * t[1:], axis=1))


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
