"""A cell from above: outlines of robots, part and surroundings, the paths, and what the links sweep."""

from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.shapes import Box, Cylinder, support_point
from cellplan.model.motion import Schedule
from cellplan.model.task import Frame
from cellplan.model.units import MM
from cellplan.planning.start.given import part_pose
from cellplan.scene.scene import Scene

CORNERS: Final = 24  # [-] of an outline
ANGLES: Final = 2.0 * np.pi * (np.arange(CORNERS) + 0.5) / CORNERS
AROUND: Final = np.stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(CORNERS)], axis=1)  # horizontal directions
ALL_ROUND: Final = np.concatenate(
    [np.cos(tilt) * AROUND[::2] + np.sin(tilt) * np.array([0.0, 0.0, 1.0]) for tilt in np.radians((-60, -20, 20, 60))]
)  # directions all round a body, of which its corners are sought once
PATH_POINTS: Final = 121  # [-]
SQUARE: Final = 40.0  # [mm]
NEAR: Final = 1e-9  # of rounding


def drawing(scene: Scene, start: Array, schedule: Schedule) -> dict[str, Any]:
    """Outlines and paths in [mm] in the plane, with all robots at the start.

    Args:
        scene: The cell made computable.
        start: Start configuration in [rad] or [m], shape (nq,).
        schedule: The tasks on the common clock.
    """
    cell = scene.cell
    poses = scene.body_poses(start[None])
    outlines = [
        {
            "name": body.name,
            "kind": str(body.kind),
            "robot": body.robot,
            "is_at_rest": body.is_at_rest,
            "outline_mm": _rounded(_outline(scene.engine.bodies[index].hull, poses.R[index, 0], poses.p[index, 0])),
        }
        for index, body in ((index, scene.bodies[index]) for index in _solids(scene))
    ]
    paths = []
    X_WP = part_pose(cell, None if cell.carrier is None else start[cell.columns(cell.robots[cell.carrier].name)])
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


def footprint(shape: Box | Cylinder, X_WS: Array) -> list[list[float]]:
    """Outline in [mm] from above of an upright box or cylinder.

    Args:
        shape: The solid.
        X_WS: Its pose in the world, shape (4, 4).
    """
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    points = 0.5 * corners * np.array(shape.size[:2]) if isinstance(shape, Box) else shape.radius * AROUND[:, :2]
    found: list[list[float]] = _rounded(points @ X_WS[:2, :2].T + X_WS[:2, 3])
    return found


def swept_area(scene: Scene, q: Array) -> dict[str, Any]:
    """What the links and tools of each robot cover from above, as rows of squares.

    Args:
        scene: The cell made computable.
        q: Configurations of its motion in [rad] or [m], shape (N, nq).

    Returns:
        The size of a square in [mm], and by robot rows ``[y, first x, last x]`` of the middles of covered squares in
        [mm].
    """
    poses = scene.body_poses(q)
    found: dict[str, Any] = {}
    for robot in scene.cell.robots:
        covered = [np.empty((0, 3), dtype=np.intp)]
        for index in _solids(scene):
            if scene.bodies[index].robot == robot.name and not scene.bodies[index].is_at_rest:
                hull = scene.engine.bodies[index].hull
                points = np.array([support_point(hull, n) for n in ALL_ROUND])
                placed = (points @ np.swapaxes(poses.R[index], -1, -2) + poses.p[index][:, None])[..., :2]
                extreme = (placed @ AROUND[:, :2].T).argmax(axis=1)  # of each configuration and direction
                covered.append(_squares(np.take_along_axis(placed, extreme[..., None], axis=1)))
        found[robot.name] = (SQUARE * _stretches(np.concatenate(covered))).tolist()
    return {"square_mm": SQUARE, "robots": found}


def _solids(scene: Scene) -> list[int]:
    """Bodies of the cell that are solids, by their place in the scene and in its engine."""
    names = [body.name for body in scene.engine.bodies]
    return [index for index, body in enumerate(scene.bodies) if index < len(names) and body.name == names[index]]


def _squares(outlines: Array) -> Indices:
    """Squares whose middles lie in any of some convex outlines in [m], shape (K, C, 2).

    Returns:
        Row, first and last column of what each outline covers of a row, shape (M, 3).
    """
    first = MM / SQUARE * outlines
    second = np.roll(first, -1, axis=1)
    low, high = np.ceil(first[..., 1].min()), np.floor(first[..., 1].max())
    rows = np.arange(low, high + 1)[:, None, None]
    rise = second[..., 1] - first[..., 1]
    with np.errstate(divide="ignore", invalid="ignore"):  # sides along a row have no one place there
        share = np.clip((rows - first[..., 1]) / rise, 0.0, 1.0)
    at = first[..., 0] + np.where(rise == 0.0, 0.0, share) * (second[..., 0] - first[..., 0])
    is_met = (np.minimum(first[..., 1], second[..., 1]) <= rows) & (rows <= np.maximum(first[..., 1], second[..., 1]))
    begins = np.ceil(np.where(is_met, at, np.inf).min(axis=-1) - NEAR)
    ends = np.floor(np.where(is_met, at, -np.inf).max(axis=-1) + NEAR)
    flat = is_met & (rise == 0.0)
    ends = np.maximum(ends, np.floor(np.where(flat, second[..., 0], -np.inf).max(axis=-1) + NEAR))
    is_covered = begins <= ends
    found = np.broadcast_to(rows[..., 0], begins.shape)[is_covered], begins[is_covered], ends[is_covered]
    return np.stack(found, axis=-1).astype(np.intp)


def _stretches(covered: Indices) -> Indices:
    """Row, first and last column of each stretch of squares that any of some stretches covers, shape (M, 3)."""
    if not len(covered):
        return covered
    corner = np.array([covered[:, 0].min(), covered[:, 1].min()])
    row, first, last = covered.T - corner[[0, 1, 1]][:, None]
    changes = np.zeros((row.max() + 1, last.max() + 3), dtype=np.intp)  # with a free column on either side
    np.add.at(changes, (row, first + 1), 1)
    np.add.at(changes, (row, last + 2), -1)
    turns = np.diff((np.cumsum(changes, axis=1) > 0).astype(np.int8), axis=1)
    begins, ends = np.argwhere(turns > 0), np.argwhere(turns < 0)
    return np.column_stack([begins + corner, ends[:, 1] - 1 + corner[1]])


def _outline(shape: Any, R: Array, p: Array) -> Array:
    """Corners of a convex solid's outline from above in [m], shape (C, 2)."""
    return np.array([(R @ support_point(shape, R.T @ n) + p)[:2] for n in AROUND])


def _rounded(lengths: Any) -> Any:
    """Lengths in [m] as plain numbers in [mm], to a hundredth."""
    return (np.round(MM * np.asarray(lengths), 2) + 0.0).tolist()
