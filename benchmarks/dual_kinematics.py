"""The tool's speed and place on a curve from rows of joints, by products of exponentials of the joint screws.

It shares nothing with planning or checks but the numbers of the robots: axes, points on them, and the fixed poses.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from cellplan import Cell
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Robot

BETWEEN: Final = 8  # places from a row to the next, joints along the cubic through the rows
DENSE: Final = 400  # places from a point of the file to the next


@dataclass(frozen=True, slots=True, kw_only=True)
class Followed:
    """How a tool runs along a curve."""

    slowest: float  # its least speed on the part in [mm/s] where the process is on
    fastest: float  # its largest one
    off: float  # largest distance from the smooth curve through the points of the file in [mm]
    turned: float  # largest angle between its axis and the axes of the file in [deg]


def followed(cell: Cell, times: Array, q: Array, file: Path, straight: float) -> Followed:
    """How the tool of the first task runs along a table of points and axes.

    Args:
        times: Times of the rows in [s], shape (N,).
        q: Stacked joint positions in [rad], shape (N, nq).
        file: The table, with a line above it: points in [mm] and axes.
        straight: Length in [mm] at both ends on which the tool comes to its speed.
    """
    fine = np.interp(np.arange((len(times) - 1) * BETWEEN + 1) / BETWEEN, np.arange(len(times)), times)
    X_PT = poses_on_part(cell, CubicSpline(times, q)(fine))
    moved = 1e3 * np.linalg.norm(np.diff(X_PT[:, :3, 3], axis=0), axis=1).reshape(-1, BETWEEN).sum(axis=1)
    ends, total = np.cumsum(moved), moved.sum()
    on = (ends - moved >= straight) & (ends <= total - straight)
    speeds = (moved / np.diff(times))[on]
    table = np.loadtxt(file, delimiter=",", skiprows=1)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(table[:, :3], axis=0), axis=1)))
    places = np.interp(np.arange((len(table) - 1) * DENSE + 1) / DENSE, np.arange(len(table)), along)
    curve, axes = CubicSpline(along, table[:, :3])(places), CubicSpline(along, table[:, 3:])(places)
    rows = X_PT[::BETWEEN]
    distances, nearest = cKDTree(curve).query(1e3 * rows[:, :3, 3])
    given = axes[nearest] / np.linalg.norm(axes[nearest], axis=1)[:, None]
    angles = np.arctan2(np.linalg.norm(np.cross(rows[:, :3, 2], given), axis=1), (rows[:, :3, 2] * given).sum(axis=1))
    return Followed(
        slowest=float(speeds.min()),
        fastest=float(speeds.max()),
        off=float(distances.max()),
        turned=float(np.degrees(angles.max())),
    )


def poses_on_part(cell: Cell, q: Array) -> Array:
    """Poses of the tool of the first task on the part that the first holder carries, shape (N, 4, 4)."""
    grasp, task = cell.part.held_by[0], cell.tasks[0]
    X_WH, X_WT = (tips(cell.robot(name), q[:, cell.columns(name)]) for name in (grasp.robot, task.robot))
    return np.asarray(grasp.X_PT @ np.linalg.inv(X_WH) @ X_WT)


def tips(robot: Robot, q: Array) -> Array:
    """Poses of a tool tip in the world: base, exponentials of all joints in turn, flange and tool, shape (N, 4, 4)."""
    X = np.tile(robot.X_WB, (len(q), 1, 1))
    for joint, positions in zip(robot.model.joints, q.T, strict=True):
        turn = np.tile(np.eye(4), (len(q), 1, 1))
        turn[:, :3, :3] = Rotation.from_rotvec(positions[:, None] * joint.axis_B).as_matrix()
        turn[:, :3, 3] = joint.point_B - turn[:, :3, :3] @ joint.point_B
        X = X @ turn
    return np.asarray(X @ robot.model.X_BF @ robot.tool.X_FT)
