"""Orientation of the tool along its path: by the surface, by a fixed direction or by the file."""

from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.curves.curve import smooth_through
from cellplan.geometry.curves.orientation import AxisFrame, FixedFrame, NormalFrame, Orientation, rotations_through
from cellplan.geometry.curves.spline import spline_through
from cellplan.geometry.transforms import Array, frame_from_axes, is_rigid, pose_from, rotation_vector
from cellplan.model.task import SampledPath, Task, TimedPath
from cellplan.planning.path.curve import PathCurve
from cellplan.planning.path.formatting import direction_name, in_mm
from cellplan.planning.path.projection import along

PARALLEL: Final = 1e-3  # [rad] tool_x and tool axis nearer than this leave the turn about the axis to rounding
WIDEST_TURN: Final = np.deg2rad(170.0)  # [rad] between neighbouring orientations: beyond it the way round is not clear
WIDEST_LEAN: Final = np.deg2rad(90.0)  # [rad] between neighbouring axes
UNIT: Final = 1e-6  # [-] room for axes and rotations that were computed elsewhere

_CHOICES: Final = tuple(sign * axis for axis in np.eye(3) for sign in (1.0, -1.0))


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
        _refuse_parallel(_unit(curve.inward.evaluate(u, (u[0], u[-1]))[0]), p, task)
        return AxisFrame(axes=curve.inward, x_hint=task.tool_x)
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
    if isinstance(path, TimedPath):
        curve = spline_through(path.times, axes, is_closed=path.is_closed)
    else:
        curve = smooth_through(drawing.given, axes, breaks=breaks)
    u = along(curve)
    p, _ = drawing.curve.evaluate(u, (u[0], u[-1]))
    _refuse_parallel(_unit(curve.evaluate(u, (u[0], u[-1]))[0]), p, task)
    return AxisFrame(axes=curve, x_hint=task.tool_x)


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
