"""Direction of a closed path, seen from outside the surface."""

from typing import Final

import numpy as np

from cellplan.geometry.curves.seam_line import SeamLine
from cellplan.geometry.transforms import Array
from cellplan.model.task.task import (
    CirclePath,
    PlaneName,
    PolygonPath,
    RunDirection,
    SampledPath,
    SpacePolylinePath,
    Task,
    TimedPath,
)

EDGE_ON_TOL: Final = (
    1e-9  # [-] a direction that leans less out of a plane does not tell its outside; nor an area this small
)
PLANE_AXES: Final = {PlaneName.XY: (0, 1), PlaneName.YZ: (1, 2), PlaneName.XZ: (0, 2)}


def plane_axes(plane: PlaneName) -> tuple[Array, Array, Array]:
    """First and second axis of a plane and their cross product."""
    first, second = (np.eye(3)[axis] for axis in PLANE_AXES[plane])
    return first, second, np.cross(first, second)


def outside_of(task: Task, normal: Array) -> Array:
    """Direction that a path is seen from: the side of its projection, else against the tool axis, else ``normal``.

    ``normal`` is that of the plane that the path lies in, shape (3,).
    """
    if task.project is not None:
        return task.project
    if task.tool_axis is None or abs(task.tool_axis @ normal) <= EDGE_ON_TOL:
        return normal
    return -task.tool_axis


def run_direction(task: Task) -> tuple[RunDirection | None, Array | None]:
    """Direction of a task's path, and the side in P from which it is seen, shape (3,).

    Listed points run as they are listed; where they are closed and enclose an area, that has a way round. None for an
    open path, or for one that encloses no area or has no outside.
    """
    path = task.path
    if isinstance(path, CirclePath):
        return path.direction, outside_of(task, plane_axes(path.plane)[2])
    if not path.is_closed:
        return None, None
    points, outside = _listed(task)
    if isinstance(path, PolygonPath) and path.direction is not None:
        return path.direction, outside
    centred = points - points.mean(axis=0)
    area = 0.5 * np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    if outside is None or abs(area @ outside) <= EDGE_ON_TOL * float(np.sum(centred * centred)):
        return None, None
    return (RunDirection.COUNTERCLOCKWISE if area @ outside > 0.0 else RunDirection.CLOCKWISE), outside


def _listed(task: Task) -> tuple[Array, Array | None]:
    """Points of a closed path in P as they are listed, shape (N, 3), and the side that they are seen from."""
    path = task.path
    match path:
        case PolygonPath():
            first, second, normal = plane_axes(path.plane)
            return np.asarray(path.corners) @ np.stack([first, second]), outside_of(task, normal)
        case SeamLine():
            return path.points, None if task.tool_axis is None else -task.tool_axis
        case SampledPath() | TimedPath():
            return path.points, _outside_of_file(task, path)
        case SpacePolylinePath():
            against = None if task.tool_axis is None else -task.tool_axis
            return np.asarray(path.points), against if task.project is None else task.project
        case CirclePath():
            raise ValueError("a circle has no list of points")


def _outside_of_file(task: Task, path: SampledPath | TimedPath) -> Array | None:
    """The side that a path from a file is seen from: that of its projection, else against its mean tool axis."""
    if task.project is not None:
        return task.project
    if task.tool_axis is not None:
        return -task.tool_axis
    axes = path.axes if path.axes is not None else None if path.rotations is None else path.rotations[:, :, 2]
    if axes is None:
        return None
    mean = -axes.mean(axis=0)
    length = float(np.linalg.norm(mean))
    return mean / length if length > EDGE_ON_TOL else None
