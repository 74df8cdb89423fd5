"""What a map shows besides its places: outlines of robots, part and surroundings from above, and the paths."""

from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import support_point
from cellplan.model.motion import Schedule
from cellplan.model.task import Frame
from cellplan.model.units import MM
from cellplan.planning.start.given import part_pose
from cellplan.search.base_map.verdicts import MapJob

CORNERS: Final = 24  # [-] of an outline
PATH_POINTS: Final = 121  # [-]


def drawing(asked: MapJob, schedule: Schedule) -> dict[str, Any]:
    """Outlines and paths in [mm] in the plane, with all robots at the start.

    Args:
        asked: The job and the scene.
        schedule: The tasks on the common clock.
    """
    scene, cell = asked.scene, asked.scene.cell
    poses = scene.body_poses(asked.start[None])
    solids = [(index, body) for index, body in enumerate(scene.bodies) if index < len(scene.engine.bodies)]
    outlines = [
        {
            "name": body.name,
            "kind": str(body.kind),
            "robot": body.robot,
            "is_at_rest": body.is_at_rest,
            "outline_mm": _rounded(_outline(scene.engine.bodies[index].hull, poses.R[index, 0], poses.p[index, 0])),
        }
        for index, body in solids
        if body.name == scene.engine.bodies[index].name
    ]
    X_WP = part_pose(cell, None if cell.carrier is None else cell.robots[cell.carrier].start)
    paths = []
    for each in schedule.tasks:
        rows = np.unique(np.linspace(0, len(each.X_PT) - 1, PATH_POINTS).round().astype(np.intp))
        X_WR = np.eye(4) if each.task.relative_to is not Frame.PART or X_WP is None else X_WP
        points = each.X_PT[rows, :3, 3] @ X_WR[:3, :3].T + X_WR[:3, 3]
        paths.append({"task": each.task.name, "robot": each.task.robot, "points_mm": _rounded(points[:, :2])})
    robots = [
        {"name": robot.name, "x_mm": _rounded(robot.X_WB[0, 3]), "y_mm": _rounded(robot.X_WB[1, 3])}
        for robot in cell.robots
    ]
    return {"robots": robots, "outlines": outlines, "paths": paths}


def _outline(shape: Any, R: Array, p: Array) -> Array:
    """Corners of a convex solid's outline from above in [m], shape (C, 2)."""
    angles = 2.0 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(CORNERS)], axis=1)
    return np.array([(R @ support_point(shape, R.T @ n) + p)[:2] for n in directions])


def _rounded(lengths: Any) -> Any:
    """Lengths in [m] as plain numbers in [mm], to a hundredth."""
    return (np.round(MM * np.asarray(lengths), 2) + 0.0).tolist()
