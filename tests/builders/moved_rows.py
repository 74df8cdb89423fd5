"""Rows of smooth random motions of the robots of a cell, without solving anything."""

from collections.abc import Mapping

import numpy as np

from cellplan.model.cell.cell import Cell
from cellplan.model.report.exported import ProgramRows, RobotRows
from cellplan.programs.rows.interpolant import resting, row_velocities


def smooth_rows(cell: Cell, *, seed: int, count: int = 401, step: float = 0.01, size: float = 0.3) -> ProgramRows:
    """Sums of sines that begin and end at rest, within the limits of the joints; the process is on in the middle."""
    rng = np.random.default_rng(seed)
    times = np.round(step * np.arange(count), 12)
    share = times / times[-1]
    fade = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    robots = {}
    for robot in cell.robots:
        joints = robot.model.joints
        lower, upper = (np.array([getattr(joint, side) for joint in joints]) for side in ("lower", "upper"))
        waves = np.sin(2.0 * np.pi * fade[:, None, None] * rng.uniform(0.5, 1.5, (len(joints), 3)))
        margin = np.minimum(size, 0.1 * np.where(np.isfinite(upper - lower), upper - lower, 1.0))
        middle = np.where(np.isfinite(upper + lower), 0.5 * (upper + lower), 0.0)
        q = middle + margin * (waves * rng.uniform(-1.0, 1.0, (len(joints), 3))).mean(axis=2)
        process = (share >= 0.25) & (share < 0.75)
        qd = row_velocities(times, q, rests=resting(q), lower=lower, upper=upper)
        robots[robot.name] = RobotRows(robot=robot.name, q=q, times=times, qd=qd, process=process)
    return ProgramRows(name=None, robots=robots)


def linear_at(rows: Mapping[str, RobotRows], times: np.ndarray) -> dict[str, np.ndarray]:
    """Positions of all robots at some times when joints move evenly from row to row."""
    return {
        name: np.stack([np.interp(times, row.times, column) for column in row.q.T], axis=1)
        for name, row in rows.items()
    }
