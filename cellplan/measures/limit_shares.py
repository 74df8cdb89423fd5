"""How near joints come to their limits in each row: the loads by which rows are timed and feeds are judged."""

from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import jerks, joint_accelerations, point_accelerations
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.joint_limits import acceleration_limits, retimed_jerk_limit

KINDS: Final = ("velocity", "acceleration", "jerk")
ORDERS: Final = np.array([1.0, 0.5, 1.0 / 3.0])  # how the time that a limit asks for grows with its share


def row_loads(robot: Robot, times: Array, q: Array) -> Array:
    """Speeds in the steps from each row, accelerations and jerks at the rows, of the joints of a robot.

    Args:
        times: Times in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n).

    Returns:
        Their sizes, shape (3, N, n); the last row has no speed.
    """
    speeds = np.zeros_like(q)
    speeds[:-1] = np.abs(np.diff(q, axis=0)) / np.diff(times)[:, None]
    cycle = robot.controller_cycle
    accelerations = joint_accelerations(times, q, cycle=cycle).values
    return np.stack([speeds, accelerations, jerks(times, point_accelerations(times, q)[..., None], window=cycle)])


def rate_limits(cell: Cell) -> Array:
    """Largest velocities, accelerations and jerks of all joints, stated or assumed, inf for none, shape (3, nq)."""
    numbers = [(robot, index) for robot in cell.robots for index in range(len(robot.model.joints))]
    jerk = [retimed_jerk_limit(cell, robot, index) or np.inf for robot, index in numbers]
    return np.stack([cell.joint_limits.velocity, acceleration_limits(cell), np.array(jerk)])
