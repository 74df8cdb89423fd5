"""How joints are used in rows that were read back: positions, margins, velocities, travel."""

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.model.cell.cell import Robot
from cellplan.model.report.report import JointUse


def joint_uses(robot: Robot, times: Array, q: Array) -> tuple[JointUse, ...]:
    """How each joint of one robot is used.

    Between two samples a joint moves linearly, so its speed there is the difference quotient.

    Args:
        times: Times in [s], shape (N,).
        q: Positions, shape (N, n).
    """
    speeds = np.abs(np.diff(q, axis=0)) / np.diff(times)[:, None]
    return tuple(_use(robot, index, times, q[:, index], speeds=speeds[:, index]) for index in range(q.shape[1]))


def _use(robot: Robot, index: int, times: Array, q: Array, *, speeds: Array) -> JointUse:
    """Extremes of one joint and when they happen."""
    joint = robot.model.joints[index]
    margins = np.minimum(q - joint.lower, joint.upper - q)
    nearest, fastest = int(np.argmin(margins)), first_peak(speeds)
    return JointUse(
        robot=robot.name,
        joint=joint.name,
        is_revolute=joint.is_revolute,
        min=float(q.min()),
        max=float(q.max()),
        lower=joint.lower,
        upper=joint.upper,
        margin=float(margins[nearest]),
        margin_at_s=float(times[nearest]),
        peak_velocity=float(speeds.max()),
        velocity_limit=joint.velocity,
        peak_velocity_at_s=float(times[fastest + 1]),
        travel=float(np.abs(np.diff(q)).sum()),
    )
