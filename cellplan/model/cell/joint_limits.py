"""Largest accelerations and jerks of joints: stated, or assumed."""

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.acceleration import LimitSource, full_speed_in
from cellplan.model.cell.cell import Cell, Robot


def acceleration_limit(robot: Robot, index: int) -> tuple[float | None, LimitSource]:
    """Largest allowed acceleration of one joint in [rad/s^2] or [m/s^2], and where it comes from."""
    joint, rule = robot.model.joints[index], robot.acceleration
    if rule.is_unlimited:
        return None, LimitSource.UNLIMITED
    if joint.acceleration is not None:
        return joint.acceleration, LimitSource.STATED
    seconds = full_speed_in(rule, index)
    return (None, LimitSource.NOT_STATED) if seconds is None else (joint.top_speed / seconds, LimitSource.ASSUMED)


def acceleration_limits(cell: Cell) -> Array:
    """Largest accelerations that the joints of a cell are judged by in [rad/s^2] or [m/s^2], inf for none, (nq,)."""
    limits = [acceleration_limit(robot, i)[0] for robot in cell.robots for i in range(len(robot.model.joints))]
    return np.array([np.inf if limit is None else limit for limit in limits])


def retimed_jerk_limit(cell: Cell, robot: Robot, index: int) -> float | None:
    """Largest jerk of one joint in [rad/s^3] or [m/s^3] that a retimed program has: stated, or assumed."""
    joint, limit = robot.model.joints[index], acceleration_limit(robot, index)[0]
    if joint.jerk is not None and not robot.acceleration.is_unlimited:
        return joint.jerk
    return None if limit is None or not cell.motion.build_up else limit / cell.motion.build_up
