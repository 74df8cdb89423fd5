"""Toolpaths: from a task as written to tool poses on the part."""

from typing import Final

import numpy as np

from cellplan.errors import CellplanError, InputError
from cellplan.geometry.curves.arc_length import ArcLength, measure
from cellplan.geometry.curves.curve import Curve
from cellplan.geometry.curves.orientation import Orientation, SpunFrame
from cellplan.geometry.transforms import Array, is_rigid, pose_from
from cellplan.model.cell import Part
from cellplan.model.task import Task, TimedPath
from cellplan.model.toolpath import Toolpath
from cellplan.planning.path.curve import path_curve
from cellplan.planning.path.formatting import in_mm
from cellplan.planning.path.plausible_size import refuse_path_in_metres, refuse_unlikely_path
from cellplan.planning.path.projection import project_path
from cellplan.planning.path.tool_orientation import orient_tool

STANDSTILL: Final = 1e-4  # [-] of the largest speed by the parameter: a curve slower than this has a cusp there
SAME_POSE: Final = 1e-9  # [m], [-] entries of poses that differ by less are those of one pose
PROBES: Final = 257  # poses checked before a toolpath is handed on


def build_toolpath(task: Task, part: Part) -> Toolpath:
    """The toolpath of a task: its curve, projected onto the part, with the tool's orientation along it and its stops.

    Raises:
        InputError: The path cannot be drawn, misses the part, runs over an edge, leaves the tool's turn open, or is to
            be gone through again and does not come back to its start.
    """
    outline = path_curve(task)
    refuse_path_in_metres(outline.curve, task=task, part=part)
    curve = project_path(outline, task, part)
    arc = measure(curve.curve)
    refuse_unlikely_path(curve.curve, arc, task=task, part=part)
    orientation = orient_tool(task, curve)
    if task.spin:
        orientation = SpunFrame(frame=orientation, angle=task.spin)
    is_timed = isinstance(task.path, TimedPath)
    if not is_timed:
        _refuse_standstill(curve.curve, arc, task.where("path"))
    is_closed = curve.is_closed and _comes_back(curve.curve, orientation, curve.stops)
    if task.repeat > 1 and not is_closed:
        raise InputError(
            f"{task.where('repeat')}: expected 1 for a path that does not end in the pose of its "
            f"start, got {task.repeat}; close the path"
        )
    toolpath = Toolpath(
        name=task.name,
        tip=curve.curve,
        orientation=orientation,
        arc=arc,
        stops=curve.stops,
        turn=task.turn,
        is_closed=is_closed,
        runs_on=curve.runs_on,
        stand_off=task.approach.distance if task.approach else 0.0,
        is_timed=is_timed,
        bulge=curve.bulge,
    )
    if not is_rigid(toolpath.spread(PROBES)):
        raise CellplanError(f"toolpath '{task.name}': a tool pose is not finite or not rigid")
    return toolpath


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
