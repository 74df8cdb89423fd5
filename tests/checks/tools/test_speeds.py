"""Speeds in the world against a turning arm with known radii."""

import numpy as np
import pytest

from cellplan.checks.tools.speeds import robot_speed
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain


def two_joint_arm():
    joints = tuple(
        Joint(
            name=name,
            kind=JointKind.REVOLUTE,
            parent=parent,
            axis_B=np.array([0.0, 0, 1]),
            point_B=np.array([x, 0.0, 0.0]),
            lower=-9.0,
            upper=9.0,
            velocity=9.0,
        )
        for name, parent, x in (("shoulder", BASE, 0.0), ("elbow", 0, 0.6))
    )
    model = RobotModel(name="arm", source="test", joints=joints, flange_link=1, X_BF=pose([1.0, 0, 0]), bodies=())
    return Robot(
        name="arm",
        model=model,
        X_WB=pose([5.0, 0, 0], [0.1, 0.2, 0.3]),
        tool=Tool(X_FT=np.eye(4), bodies=()),
        start=None,
        weights=np.ones(2),
    )


def test_turning_arm_gives_radius_times_rate():
    """Shoulder at 1 rad/s for the first half, at 0.2 rad/s for the second: tip 1 m out, elbow 0.6 m out."""
    robot = two_joint_arm()
    times = np.arange(2001) * 1e-3
    shoulder = np.where(times <= 1.0, times, 1.0 + 0.2 * (times - 1.0))
    q = np.stack([shoulder, np.zeros_like(times)], axis=1)

    speed = robot_speed(robot, ScrewChain(robot), times, q)

    assert speed.tool_peak == pytest.approx(1.0, rel=1e-6)  # chord of 1 ms against the arc: (1e-3)^2 / 24
    assert speed.share_above_reduced == pytest.approx(0.5)  # 0.2 m/s afterwards is below the reduced speed
    assert speed.axis == "elbow"
    assert speed.axis_peak == pytest.approx(0.6, rel=1e-6)


def test_a_robot_that_stands_still_has_no_speed():
    robot = two_joint_arm()
    speed = robot_speed(robot, ScrewChain(robot), np.arange(11) * 0.1, np.ones((11, 2)))
    assert (speed.tool_peak, speed.axis_peak, speed.share_above_reduced) == (0.0, 0.0, 0.0)
