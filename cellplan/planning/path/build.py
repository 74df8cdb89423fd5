"""Toolpaths: from a task as written to tool poses on the part."""

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from cellplan.errors import CellplanError, InputError
from cellplan.geometry.curves.arc_length import ArcLength, measure
from cellplan.geometry.curves.curve import Curve, smooth_through
from cellplan.geometry.curves.extension import ExtendedCurve, ExtendedFrame
from cellplan.geometry.curves.orientation import (
    AxisFrame,
    FixedFrame,
    NormalFrame,
    Orientation,
    SpunFrame,
    rotations_through,
)
from cellplan.geometry.curves.rerun import Rerun, RerunFrame
from cellplan.geometry.curves.spline import spline_through
from cellplan.geometry.shapes import bounding_box
from cellplan.geometry.transforms import Array, frame_from_axes, inverse, is_rigid, pose_from, rotation_vector
from cellplan.model.cell.cell import Part
from cellplan.model.task.seam import Stretch
from cellplan.model.task.task import Frame, ProgrammedPath, SampledPath, Task, TimedPath
from cellplan.model.task.toolpath import Toolpath
from cellplan.planning.path.curve import PathCurve, path_curve
from cellplan.planning.path.formatting import MM, direction_name, in_mm, length
from cellplan.planning.path.programmed import programmed_curve, with_programmed_corners
from cellplan.planning.path.projection import along, project_path
from cellplan.planning.path.runs import with_runs
from cellplan.planning.path.seam import follow_seam
from cellplan.planning.path.stretch import along_stretches, back_at_end, stretch_of
from cellplan.planning.path.weave import WovenPath, woven_path

STANDSTILL: Final = 1e-4  # [-] of the largest speed by the parameter: a curve slower than this has a cusp there
SAME_POSE: Final = 1e-9  # [m], [-] entries of poses that differ by less are those of one pose
PROBES: Final = 257  # poses checked before a toolpath is handed on
SHORTEST: Final = 1e-4  # [m] of a path; a trajectory may turn the tool on the spot
FARTHEST: Final = 10.0  # [m] from the box round the part, of a path on the part
LONGEST_IN_METRES: Final = 3e-3  # [m] a longer path would be more than 3 m if its numbers were metres
AROUND: Final = 0.25  # [-] of the size of the part: so far beside it a path may run
LOOKED_AT: Final = 1025  # points of a path, beside its knots
PARALLEL: Final = 1e-3  # [rad] tool_x and tool axis nearer than this leave the turn about the axis to rounding
WIDEST_TURN: Final = np.deg2rad(170.0)  # [rad] between neighbouring orientations: beyond it the way round is not clear
WIDEST_LEAN: Final = np.deg2rad(90.0)  # [rad] between neighbouring axes
UNIT: Final = 1e-6  # [-] room for axes and rotations that were computed elsewhere
_CHOICES: Final = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))


def build_toolpath(task: Task, part: Part) -> Toolpath:
    """The toolpath of a task: its curve, projected onto the part, with the tool's orientation along it and its stops.

    Raises:
        InputError: The path cannot be drawn, misses the part, runs over an edge, leaves the tool's turn open, or is to
            be gone through again and does not come back to its start.
    """
    outline = _outline(task)
    refuse_path_in_metres(outline.curve, task=task, part=part)
    held = _with_tool(task, project_path(outline, task, part))
    curve, orientation = with_runs(task, held.curve, held.orientation)
    arc = measure(curve.curve)
    refuse_unlikely_path(curve.curve, arc, task=task, part=part)
    is_timed = isinstance(task.path, TimedPath)
    if not is_timed:
        _refuse_standstill(curve.curve, arc, task.where("path"))
    tip, seam, woven = curve.curve, curve.seam, None
    if task.weave is not None:
        woven = woven_path(task, task.weave, curve, arc, orientation)
        tip, orientation, seam = woven
    is_closed = curve.is_closed and _comes_back(tip, orientation, curve.stops)
    if task.repeat > 1 and not is_closed:
        raise InputError(
            f"{task.where('repeat')}: expected 1 for a path that does not end in the pose of its "
            f"start, got {task.repeat}; close the path"
        )
    toolpath = Toolpath(
        name=task.name,
        tip=tip,
        line=None if task.weave is None else curve.curve,
        orientation=orientation,
        arc=arc,
        stops=curve.stops,
        turn=task.turn,
        is_closed=is_closed,
        runs_on=curve.runs_on,
        stand_off=task.approach.distance if task.approach else 0.0,
        is_timed=is_timed,
        bulge=curve.bulge,
        seam=seam,
        runs=_runs(task, curve, arc),
    )
    if not is_rigid(toolpath.spread(PROBES)):
        raise CellplanError(f"toolpath '{task.name}': a tool pose is not finite or not rigid")
    return replace(toolpath, listed=_as_listed(task, toolpath, _Construction(held.reruns, curve.curve, woven)))


def _outline(task: Task) -> PathCurve:
    """The curve of a path before it is projected."""
    return programmed_curve(task.path) if isinstance(task.path, ProgrammedPath) else path_curve(task)


def _runs(task: Task, path: PathCurve, arc: ArcLength) -> tuple[float, float]:
    """Lengths in [m] of the run-in and of the run-out, lifted or not; nil where there is none."""
    ends = path.stops[[0, -1]]
    work = ends if path.work is None else path.work
    if isinstance(task.path, ProgrammedPath) and task.path.is_run is not None:
        work = path.given[np.flatnonzero(~task.path.is_run)[[0, -1]] + [0, 1]]
    begin, end = arc.lengths(work).tolist()
    return begin if work[0] > ends[0] else 0.0, arc.total - end if work[1] < ends[1] else 0.0


Reruns = tuple[Rerun | None, Rerun | None]  # along a path, and back at its end; None for all of it, and not at all


class _HeldTool(NamedTuple):
    """The curve of the tip along its stretches of a path, the orientation of the tool, and these stretches."""

    curve: PathCurve
    orientation: Orientation
    reruns: Reruns


class _Construction(NamedTuple):
    """How a path became a toolpath."""

    reruns: Reruns
    line: Curve  # with its runs
    woven: WovenPath | None


def _as_listed(task: Task, toolpath: Toolpath, how: _Construction) -> Toolpath | None:
    """A smoothed path by the points of its file, at the same parameters; None for another one.

    Its weave has the offsets from the smoothed line, so that the tips are as far apart as the lines are.
    """
    if not isinstance(task.path, SampledPath) or task.path.smoothing is None:
        return None
    by_file = replace(task, path=task.path.listed)
    curve, orientation, _ = _with_tool(by_file, _outline(by_file), how.reruns)
    tip: Curve = curve.curve
    if isinstance(how.line, ExtendedCurve):
        extension = how.line.extension
        orientation = ExtendedFrame(frame=orientation, curve=tip, extension=extension)
        tip = ExtendedCurve(curve=tip, extension=extension)
    if how.woven is not None:
        tip, orientation = how.woven.about(tip, orientation)
    return replace(toolpath, tip=tip, orientation=orientation)


def _with_tool(task: Task, path: PathCurve, reruns: Reruns | None = None) -> _HeldTool:
    """The curve of the tip along its stretch of a path, and the orientation of the tool along it.

    Args:
        reruns: The stretches in parameters of the path; those of the task by lengths along it when absent.
    """
    stretch = task.stretch or Stretch()
    whole = stretch == Stretch(back=stretch.back)
    rerun, back = reruns or (None if whole else stretch_of(path, stretch, task), None)
    if task.seam is None:
        orientation = orient_tool(task, path)
        curve = path if rerun is None else along_stretches(path, rerun)
        orientation = orientation if rerun is None else RerunFrame(frame=orientation, rerun=rerun)
    else:
        curve, axes = follow_seam(task, path if rerun is None else along_stretches(path, rerun), task.seam.angles)
        orientation = _by_axes(axes, task, curve)
    if stretch.back:
        back = back or back_at_end(curve, stretch.back, task)
        curve, orientation = along_stretches(curve, back), RerunFrame(frame=orientation, rerun=back)
    if task.spin:
        orientation = SpunFrame(frame=orientation, angle=task.spin)
    return _HeldTool(curve, orientation, (rerun, back))


def _comes_back(tip: Curve, orientation: Orientation, stops: Array) -> bool:
    """Whether the last pose is the first one; a file may come back to a point with another orientation."""
    poses = []
    for u, interval in ((stops[:1], (stops[0], stops[1])), (stops[-1:], (stops[-2], stops[-1]))):
        p, dp = tip.evaluate(u, interval)
        R, _ = orientation.frames(u, interval, p=p, dp=dp)
        poses.append(pose_from(R, p)[0])
    return bool(np.abs(poses[1] - poses[0]).max() <= SAME_POSE)


def _refuse_standstill(tip: Curve, arc: ArcLength, where: str) -> None:
    """Refuse a path that has no direction somewhere: a side along the projection, or a cusp."""
    u = np.concatenate([arc.edges, 0.5 * (arc.edges[:-1] + arc.edges[1:])])
    p, dp = tip.evaluate(u, (float(arc.edges[0]), float(arc.edges[-1])))
    speed = np.linalg.norm(dp, axis=1)
    k = int(np.argmin(speed))
    if not speed[k] > STANDSTILL * speed.max():
        raise InputError(
            f"{where}: expected a path with a direction everywhere, but it stands still near {in_mm(p[k])}: "
            "a side runs along the projection, or the curve turns back on itself"
        )


def refuse_path_in_metres(curve: Curve, *, task: Task, part: Part) -> None:
    """Refuse a path of a few millimetres at the origin of the part that would lie on the part if it were in metres.

    Args:
        curve: The path as it is listed, in P, before it is projected.
    """
    first, last = float(curve.knots[0]), float(curve.knots[-1])
    p, _ = curve.evaluate(np.union1d(curve.knots, np.linspace(first, last, LOOKED_AT)), (first, last))
    size = float(np.linalg.norm(np.diff(p, axis=0), axis=1).sum())
    if isinstance(task.path, TimedPath) or task.relative_to is not Frame.PART or size > LONGEST_IN_METRES:
        return
    X_SP = inverse(part.X_PS)
    middle, half = bounding_box(part.shape)
    across = np.ones(3) if task.project is None else np.abs(task.project) < np.abs(task.project).max()
    beyond = np.abs(MM * p @ X_SP[:3, :3].T + X_SP[:3, 3] - middle) - half - AROUND * 2.0 * half.max()
    if np.all((beyond <= 0.0) | (across == 0.0)) and MM * size > half.min():
        raise InputError(
            f"{task.where('path')}: expected a path in mm, got one of {length(size)} mm at the origin of the part: is "
            "it in metres? A thousand times as large it lies on the part"
        )


def refuse_unlikely_path(tip: Curve, arc: ArcLength, *, task: Task, part: Part) -> None:
    """Refuse a path that is shorter than anybody works, or far from the part that it is given on.

    ``tip`` has the positions of the tool in P; of a task in the world only the length is judged.
    """
    if not isinstance(task.path, TimedPath) and arc.total < SHORTEST:
        raise InputError(
            f"{task.where('path')}: expected a path of at least {length(SHORTEST)} mm, got {length(arc.total)} mm; "
            "is the unit right?"
        )
    if task.relative_to is not Frame.PART:
        return
    first, last = float(arc.edges[0]), float(arc.edges[-1])
    p_PT, _ = tip.evaluate(np.union1d(arc.edges, np.linspace(first, last, LOOKED_AT)), (first, last))
    X_SP = inverse(part.X_PS)
    middle, half = bounding_box(part.shape)
    beyond = np.maximum(np.abs(p_PT @ X_SP[:3, :3].T + X_SP[:3, 3] - middle) - half, 0.0)
    away = np.linalg.norm(beyond, axis=1)
    k = int(np.argmax(away))
    if not away[k] <= FARTHEST:
        raise InputError(
            f"{task.where('path')}: expected a path within {FARTHEST:g} m of the part, got the point {in_mm(p_PT[k])}, "
            f"{away[k]:.3g} m from it; is the unit right?"
        )


def orient_tool(task: Task, curve: PathCurve) -> Orientation:
    """Tool frames along a path: z is the tool axis, x leans to the task's ``tool_x``.

    Rotations of a file are taken as they are. Between points of a file, axes and rotations are interpolated with
    continuous rates; at stops each side is interpolated on its own.

    Raises:
        InputError: No orientation or two are given, neighbouring ones differ too much, or ``tool_x`` runs along the
            tool axis.
    """
    where = task.where("tool_axis")
    path = task.path
    if isinstance(path, SampledPath | TimedPath) and (path.axes is not None or path.rotations is not None):
        if task.project is not None or task.tool_axis is not None:
            other = "tool_axis" if task.tool_axis is not None else "path.project"
            raise InputError(
                f"{task.where(other)}: {path.source} gives the tool's orientation already; "
                f"leave {other.removeprefix('path.')} out, or the columns of the orientation"
            )
        return _from_file(path, task, curve)
    if task.tool_axis is not None:
        _refuse_parallel(task.tool_axis[None], np.zeros((1, 3)), task)
        return FixedFrame(R=frame_from_axes(task.tool_axis, task.tool_x))
    u = along(curve.curve)
    p, _ = curve.curve.evaluate(u, (u[0], u[-1]))
    if curve.patch is not None:
        _refuse_parallel(-curve.patch.normals(p), p, task)
        return NormalFrame(patch=curve.patch, x_hint=task.tool_x)
    if curve.inward is not None:
        return _by_axes(curve.inward, task, curve)
    raise InputError(
        f"{where}: 'normal' needs a surface: expected a path with project, a file with axes or rotations, or a "
        "direction such as -z"
    )


def _from_file(path: SampledPath | TimedPath, task: Task, drawing: PathCurve) -> Orientation:
    """Interpolate the axes or rotations of a file over the parameters of its points."""
    where = task.where("path")
    breaks = np.isin(drawing.given, drawing.stops)
    if path.is_smooth and path.is_closed:
        breaks[[0, -1]] = False
    if path.rotations is not None:
        rotations = _returning(path.rotations, drawing)
        if not is_rigid(pose_from(rotations, np.zeros(3)), UNIT):
            raise InputError(f"{where}: expected rotations that are orthogonal and right-handed in {path.source}")
        between = np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:]
        _refuse_wide(np.linalg.norm(rotation_vector(between), axis=1), WIDEST_TURN, path, where=where)
        return rotations_through(drawing.given, rotations, breaks=breaks)
    axes = _returning(np.asarray(path.axes), drawing)
    if not np.all(np.abs(np.linalg.norm(axes, axis=1) - 1.0) <= UNIT):
        raise InputError(f"{where}: expected tool axes of length 1 in {path.source}")
    cross, dot = np.linalg.norm(np.cross(axes[:-1], axes[1:]), axis=1), np.sum(axes[:-1] * axes[1:], axis=1)
    _refuse_wide(np.arctan2(cross, dot), WIDEST_LEAN, path, where=where)
    if isinstance(path, ProgrammedPath):
        curve = with_programmed_corners(path, axes)
    elif isinstance(path, TimedPath):
        curve = spline_through(path.times, axes, is_closed=path.is_closed)
    else:
        curve = smooth_through(drawing.given, axes, breaks=breaks)
    return _by_axes(curve, task, drawing)


def _by_axes(axes: Curve, task: Task, drawing: PathCurve) -> AxisFrame:
    """Tool frames by a moving axis, of any length, along a path."""
    u = along(axes)
    p, _ = drawing.curve.evaluate(u, (u[0], u[-1]))
    _refuse_parallel(_unit(axes.evaluate(u, (u[0], u[-1]))[0]), p, task)
    return AxisFrame(axes=axes, x_hint=task.tool_x)


def _returning(values: Array, drawing: PathCurve) -> Array:
    """Values at the listed points, the first repeated where the path returns to it."""
    return values if len(values) == len(drawing.given) else np.concatenate([values, values[:1]])


def _refuse_wide(angles: Array, widest: float, path: SampledPath | TimedPath, *, where: str) -> None:
    """Refuse neighbouring orientations between which the way is not clear."""
    k = int(np.argmax(angles))
    if angles[k] > widest:
        raise InputError(
            f"{where}: expected neighbouring orientations that differ by at most {np.rad2deg(widest):g} deg, got "
            f"{np.rad2deg(angles[k]):.4g} deg between points {k + 1} and {k + 2} of {path.source}; add points between"
        )


def _unit(axes: Array) -> Array:
    """Vectors of length one along others, shape (N, 3)."""
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def _sines(z: Array, direction: Array) -> Array:
    """Lower bound of the angle in [rad] between a direction and a moving axis, at each axis and just after it.

    Between two neighbours the axis is within half of their angle of the nearer one.
    """
    d = direction / np.linalg.norm(direction)
    lean = np.arcsin(np.clip(np.linalg.norm(np.cross(z, d), axis=1), 0.0, 1.0))
    moved = np.append(np.linalg.norm(np.diff(z, axis=0), axis=1), 0.0)
    return np.minimum(lean, np.append(lean[1:], lean[-1:])) - 0.5 * moved


def _refuse_parallel(z: Array, p: Array, task: Task) -> None:
    """Refuse a ``tool_x`` that runs along the tool axis somewhere, and name the best direction instead."""
    distance = _sines(z, task.tool_x)
    k = int(np.argmin(distance))
    if distance[k] < PARALLEL:
        best = max(_CHOICES, key=lambda choice: (round(float(_sines(z, choice).min()), 6), float(choice.sum())))
        place = f" at {in_mm(p[k])}" if len(z) > 1 else ""
        raise InputError(
            f"{task.where('tool_x')}: expected a direction across the tool axis, but "
            f"{direction_name(task.tool_x)} runs along it{place}; write tool_x: {direction_name(best)}"
        )
