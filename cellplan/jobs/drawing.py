"""A cell from above: outlines of robots, part and surroundings, the paths, and what the links sweep."""

from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.outlines import AROUND, outlines, swept_outlines
from cellplan.geometry.raster import covered, stretches
from cellplan.geometry.shapes import Box, Cylinder
from cellplan.model.motion.motion import Schedule
from cellplan.model.task.task import Frame
from cellplan.model.units import MM
from cellplan.planning.start.given import part_pose
from cellplan.scene.scene import Scene

PATH_POINTS: Final = 121  # [-]
SQUARE: Final = 40.0  # [mm]


def drawing(scene: Scene, start: Array, schedule: Schedule) -> dict[str, Any]:
    """Outlines and paths in [mm] in the plane, with all robots at ``start`` in [rad] or [m], shape (nq,)."""
    cell = scene.cell
    poses = scene.body_poses(start[None])
    shown = [
        {
            "name": body.name,
            "kind": str(body.kind),
            "robot": body.robot,
            "is_at_rest": body.is_at_rest,
            "outline_mm": _rounded(outlines(scene.engine.bodies[index].hull, poses.R[index], poses.p[index])[0]),
        }
        for index, body in ((index, scene.bodies[index]) for index in _solids(scene))
    ]
    paths = []
    X_WP = part_pose(cell, None if cell.carrier is None else start[cell.columns(cell.robots[cell.carrier].name)])
    for task in schedule.tasks:
        rows = np.unique(np.linspace(0, len(task.X_PT) - 1, PATH_POINTS).round().astype(np.intp))
        X_WR = np.eye(4) if task.task.relative_to is not Frame.PART or X_WP is None else X_WP
        points = task.X_PT[rows, :3, 3] @ X_WR[:3, :3].T + X_WR[:3, 3]
        paths.append({"task": task.task.name, "robot": task.task.robot, "points_mm": _rounded(points[:, :2])})
    robots = [
        {"name": robot.name, "x_mm": _rounded(robot.X_WB[0, 3]), "y_mm": _rounded(robot.X_WB[1, 3])}
        for robot in cell.robots
    ]
    return {"robots": robots, "outlines": shown, "paths": paths}


def footprint(shape: Box | Cylinder, X_WS: Array) -> list[list[float]]:
    """Outline in [mm] from above of an upright box or cylinder at a pose in the world, shape (4, 4)."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = 0.5 * corners * np.array(shape.size[:2]) if isinstance(shape, Box) else shape.radius * AROUND[:, :2]
    return _rounded(points @ X_WS[:2, :2].T + X_WS[:2, 3])


def swept_area(scene: Scene, q: Array) -> dict[str, Any]:
    """What the links and tools of each robot cover from above, as rows of squares.

    Args:
        q: Configurations of its motion in [rad] or [m], shape (N, nq).

    Returns:
        The size of a square in [mm], and by robot rows ``[y, first x, last x]`` of the middles of covered squares in
        [mm].
    """
    poses = scene.body_poses(q)
    areas: dict[str, Any] = {}
    for robot in scene.cell.robots:
        squares = [np.empty((0, 3), dtype=np.intp)]
        for index in _solids(scene):
            if scene.bodies[index].robot == robot.name and not scene.bodies[index].is_at_rest:
                lines = swept_outlines(scene.engine.bodies[index].hull, poses.R[index], poses.p[index])
                squares.append(covered(MM / SQUARE * lines))
        areas[robot.name] = (SQUARE * stretches(np.concatenate(squares))).tolist()
    return {"square_mm": SQUARE, "robots": areas}


def _solids(scene: Scene) -> list[int]:
    """Bodies of the cell that are solids, by their place in the scene and in its engine."""
    names = [body.name for body in scene.engine.bodies]
    return [index for index, body in enumerate(scene.bodies) if index < len(names) and body.name == names[index]]


def _rounded(lengths: Any) -> Any:
    """Lengths in [m] as plain numbers in [mm], to a hundredth."""
    return (np.round(MM * np.asarray(lengths), 2) + 0.0).tolist()
