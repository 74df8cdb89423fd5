"""Mirror: a part and the tasks on it on the other side of a plane of the part frame, as for left and right parts.

A point p goes to S p, with S = diag(+-1) across the plane. A tool is its own mirror image across the plane of its x and
z axes: its orientation R goes to S R diag(1, -1, 1). Push stays push; left and right of travel are exchanged.
"""

from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Mesh
from cellplan.model.cell.cell import Part
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.path_direction import PLANE_AXES, outside_of, plane_axes
from cellplan.model.task.seam import Seam, WallPlace
from cellplan.model.task.task import (
    CirclePath,
    PathSpec,
    PlaneName,
    PolygonPath,
    RunDirection,
    SampledPath,
    SpacePolylinePath,
    Task,
    TimedPath,
)

Targets = TypeVar("Targets", SampledPath, TimedPath)
OF_TOOL: Final = np.array([1.0, -1.0, 1.0])  # signs of the axes of a tool that is its own mirror image
OPPOSITE: Final = {
    RunDirection.CLOCKWISE: RunDirection.COUNTERCLOCKWISE,
    RunDirection.COUNTERCLOCKWISE: RunDirection.CLOCKWISE,
}
OTHER_SIDE: Final = {WallPlace.LEFT: WallPlace.RIGHT, WallPlace.RIGHT: WallPlace.LEFT}


def signs_of(plane: PlaneName) -> Array:
    """Signs of the coordinates of mirror images, shape (3,)."""
    return np.array([1.0 if axis in PLANE_AXES[plane] else -1.0 for axis in range(3)])


def mirrored_part(part: Part, plane: PlaneName) -> Part:
    """The part on the other side of a plane of its frame; what holds it stays where it is."""
    S, shape = signs_of(plane), part.shape
    X_PS = part.X_PS * np.outer(np.append(S, 1.0), np.append(S, 1.0))
    if isinstance(shape, Mesh):
        shape = replace(shape, vertices=S * shape.vertices, faces=shape.faces[:, ::-1].copy())
    return replace(part, shape=shape, X_PS=X_PS, centre=None if part.centre is None else S * part.centre)


def mirrored_task(task: Task, plane: PlaneName) -> Task:
    """A task on the other side of a plane of the part frame; one in the world is not mirrored."""
    if not task.is_on_part:
        return task
    S = signs_of(plane)
    is_across = isinstance(task.path, CirclePath | PolygonPath) and task.path.plane is plane
    project, axis = (None if it is None else S * it for it in (task.project, task.tool_axis))
    mirrored = replace(
        task,
        project=project,
        tool_axis=axis,
        tool_x=S * task.tool_x,
        spin=-task.spin,
        turn=-task.turn,
        plane_offset=-task.plane_offset if is_across else task.plane_offset,
        seam=None if task.seam is None else _seam(task.seam, S),
        weave=None if task.weave is None else replace(task.weave, side=-task.weave.side),
        process=None if task.process is None else _process(task.process, S),
    )
    return replace(mirrored, path=_path(task, mirrored, S))


def _process(process: ProcessEntry, S: Array) -> ProcessEntry:
    """A process whose force is mirrored with its frame; that in the world stays, as the world does."""
    if process.force is None or process.force.frame == "world":
        return process
    return process.changed(force=process.force.mirrored(OF_TOOL if process.force.frame == "tool" else S))


def _seam(seam: Seam, S: Array) -> Seam:
    """Walls on the other side; what is left of travel is right of it."""
    walls = {name: OTHER_SIDE.get(it, it) if isinstance(it, WallPlace) else S * it for name, it in seam.walls.items()}
    return replace(seam, walls=walls, angles=replace(seam.angles, is_mirrored=not seam.angles.is_mirrored))


def _path(task: Task, mirrored: Task, S: Array) -> PathSpec:
    """The path of a task on the other side."""
    path = task.path
    match path:
        case CirclePath() | PolygonPath():
            first, second = (S[axis] for axis in PLANE_AXES[path.plane])
            direction = path.direction and _run_direction(task, mirrored, path.plane, path.direction, S)
            if isinstance(path, PolygonPath):
                corners = tuple((first * u, second * v) for u, v in path.corners)
                return replace(path, corners=corners, direction=direction)
            (u, v), (a, b) = path.center, path.start
            start = (first * a, second * b)
            return replace(path, center=(first * u, second * v), start=start, direction=direction or path.direction)
        case SpacePolylinePath():
            return replace(path, points=tuple((S[0] * x, S[1] * y, S[2] * z) for x, y, z in path.points))
        case SampledPath():
            return _by_file(path, S)
        case TimedPath():
            return _by_file(path, S)
        case _:
            walls = {name: S * normals for name, normals in path.walls.items()}
            return replace(path, points=S * path.points, tangents=S * path.tangents, walls=walls)


def _by_file(path: Targets, S: Array) -> Targets:
    """Tool targets of a file on the other side, those before smoothing too."""
    axes = None if path.axes is None else S * path.axes
    rotations = None if path.rotations is None else S[:, None] * path.rotations * OF_TOOL
    moved = replace(path, points=S * path.points, axes=axes, rotations=rotations)
    if isinstance(moved, SampledPath) and moved.smoothing is not None:
        return replace(moved, smoothing=replace(moved.smoothing, listed=_by_file(moved.listed, S)))
    return moved


def _run_direction(task: Task, mirrored: Task, plane: PlaneName, direction: RunDirection, S: Array) -> RunDirection:
    """The way round of the mirror image, seen from its own outside."""
    normal = plane_axes(plane)[2]
    is_same_side = (S * outside_of(task, normal)) @ outside_of(mirrored, normal) > 0.0
    return OPPOSITE[direction] if is_same_side else direction
