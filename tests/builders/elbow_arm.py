"""The elbow arm of the tests in closed form: where its tool is, and the eight ways to come there."""

from dataclasses import replace

import numpy as np

from builders.scene_builders import arm_model, placed
from cellplan.geometry.transforms import Array, rotation_exp
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.robot import RobotModel


def tip(robot: Robot, q: Array) -> Array:
    """Tool tip in the world by a product of rotations about lines, joint by joint."""
    X = robot.X_WB.copy()
    for joint, position in zip(robot.model.joints, q, strict=True):
        step = np.eye(4)
        if joint.is_revolute:
            step[:3, :3] = rotation_exp(joint.axis_B * position)
            step[:3, 3] = joint.point_B - step[:3, :3] @ joint.point_B
        else:
            step[:3, 3] = joint.axis_B * position
        X = X @ step
    return X @ robot.model.X_BF @ robot.tool.X_FT


def wide(name: str) -> Robot:
    """The elbow arm without limits that matter here."""
    model: RobotModel = arm_model()
    joints = tuple(replace(joint, lower=-7.0, upper=7.0) for joint in model.joints)
    return placed(name, replace(model, joints=joints))


def closed_form(robot: Robot, target: Array, shoulder: int, elbow: int, wrist: int) -> Array:
    """Joints of the elbow arm, whose links are 0.6 m long: two links in a plane, then the angles x, y, x of a wrist."""
    R = target[:3, :3] @ robot.model.X_BF[:3, :3].T
    centre = target[:3, 3] - R @ np.array([0.1, 0.0, 0.0])  # the flange is 0.1 m in front of it
    a1 = np.arctan2(shoulder * centre[1], shoulder * centre[0])
    w = np.array([shoulder * np.hypot(centre[0], centre[1]), centre[2] - 0.4])
    across = np.array([-w[1], w[0]]) / np.linalg.norm(w)
    upper = 0.5 * w + elbow * across * np.sqrt(0.36 - 0.25 * (w @ w))
    lean, bend = np.arctan2(upper[0], upper[1]), np.arctan2(upper[1] - w[1], w[0] - upper[0])
    W = (rotation_exp(np.array([0.0, 0.0, a1])) @ rotation_exp(np.array([0.0, bend, 0.0]))).T @ R
    sine = wrist * np.sqrt(1.0 - W[0, 0] ** 2)
    turns = np.arctan2([W[1, 0] / sine, sine, W[0, 1] / sine], [-W[2, 0] / sine, W[0, 0], W[0, 2] / sine])
    return np.array([a1, lean, bend - lean, *turns])
