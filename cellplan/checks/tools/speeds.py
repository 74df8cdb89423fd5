"""Speeds of tools and arms in the world, as a risk assessment needs them."""

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.model.cell import Robot
from cellplan.model.report import REDUCED_SPEED, RobotSpeed


def robot_speed(robot: Robot, chain: ScrewChain, times: Array, q: Array) -> RobotSpeed:
    """Largest speeds of one robot's tool tip and joint axes; between two samples a point moves along the chord.

    Args:
        robot: The robot.
        chain: Its kinematics.
        times: Instants in [s], shape (N,).
        q: Positions, shape (N, n).
    """
    tool = _speeds(chain.tool_poses(q)[:, :3, 3], times)
    axes = _speeds(chain.axis_points(q), times)
    fastest = int(np.argmax(tool))
    instant, joint = np.unravel_index(int(np.argmax(axes)), axes.shape)
    return RobotSpeed(
        tool_peak=float(tool[fastest]),
        tool_peak_at_s=float(times[fastest + 1]),
        share_above_reduced=float(np.mean(tool > REDUCED_SPEED)),
        axis_peak=float(axes[instant, joint]),
        axis=robot.model.joint_names[int(joint)],
        axis_peak_at_s=float(times[instant + 1]),
    )


def _speeds(points: Array, times: Array) -> Array:
    """Speeds of points, shape (N, ..., 3), between the samples in [m/s], shape (N - 1, ...)."""
    steps = np.diff(times).reshape(-1, *[1] * (points.ndim - 2))
    return np.linalg.norm(np.diff(points, axis=0), axis=-1) / steps
