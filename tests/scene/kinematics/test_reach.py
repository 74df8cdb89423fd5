"""Reach of arms whose reach is known in closed form."""

import numpy as np
import pytest

from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.scene.kinematics.reach import arm_reach, has_round_reach, reach_outline

ROUNDING = 1e-9  # [m] the search ends on a grid far below this; errors grow with its square

RAIL = Joint(
    name="rail",
    kind=JointKind.PRISMATIC,
    parent=BASE,
    axis_B=np.array([1.0, 0.0, 0.0]),
    point_B=np.zeros(3),
    lower=0.0,
    upper=2.0,
    velocity=1.0,
)


def arm(*joints: Joint, flange: tuple[float, float, float]) -> RobotModel:
    return RobotModel(
        name="arm", source="test", joints=joints, flange_link=len(joints) - 1, X_BF=pose(flange), bodies=()
    )


def turning(parent: int, point: tuple[float, float, float], *, lower: float = -3.0, upper: float = 3.0) -> Joint:
    return Joint(
        name=f"j{parent + 1}",
        kind=JointKind.REVOLUTE,
        parent=parent,
        axis_B=np.array([0.0, 0.0, 1.0]),
        point_B=np.array(point),
        lower=lower,
        upper=upper,
        velocity=1.0,
    )


def test_a_planar_arm_reaches_as_far_as_its_links_are_long() -> None:
    model = arm(turning(BASE, (0, 0, 0)), turning(0, (0.5, 0, 0)), turning(1, (0.9, 0, 0)), flange=(0.9, 0.2, 0.3))

    assert arm_reach(model) == pytest.approx(0.5 + 0.4 + 0.2, abs=ROUNDING)


def test_a_limit_keeps_an_arm_from_stretching() -> None:
    model = arm(turning(BASE, (0, 0, 0)), turning(0, (0.5, 0, 0), lower=1.0, upper=2.0), flange=(0.8, 0, 0))

    assert arm_reach(model) == pytest.approx(np.sqrt(0.5**2 + 0.3**2 + 2 * 0.5 * 0.3 * np.cos(1.0)), abs=ROUNDING)


def test_a_joint_without_end_may_turn_all_the_way() -> None:
    model = arm(turning(BASE, (0, 0, 0)), turning(0, (0.5, 0, 0), lower=-np.inf, upper=np.inf), flange=(0.2, 0, 0))

    assert arm_reach(model) == pytest.approx(0.8, abs=ROUNDING)


def test_a_rail_counts_its_own_length() -> None:
    model = arm(RAIL, turning(0, (0, 0, 0)), flange=(0.5, 0, 0))

    assert arm_reach(model) == pytest.approx(2.5, abs=ROUNDING)


def placed(model: RobotModel, X_WB: np.ndarray) -> Robot:
    bare = Tool(X_FT=np.eye(4), bodies=())
    return Robot(name="arm", model=model, X_WB=X_WB, tool=bare, start=None, weights=np.ones(len(model.joints)))


def test_from_above_an_arm_on_a_rail_reaches_a_stadium() -> None:
    robot = placed(arm(RAIL, turning(0, (0, 0, 0), lower=-3.2, upper=3.2), flange=(0.5, 0, 0)), pose((1.0, 3.0, 0.5)))

    corners = reach_outline(robot) - [1.0, 3.0]

    assert not has_round_reach(robot)
    from_track = corners - np.column_stack([np.clip(corners[:, 0], 0.0, 2.0), np.zeros(len(corners))])
    np.testing.assert_allclose(np.linalg.norm(from_track, axis=1), 0.5, atol=1e-6)
    assert np.ptp(corners, axis=0) == pytest.approx([3.0, 1.0], abs=1e-6)


def test_an_arm_that_turns_about_a_level_axis_covers_a_line_from_above() -> None:
    robot = placed(
        arm(turning(BASE, (0, 0, 0), lower=-3.2, upper=3.2), flange=(0.5, 0, 0.2)), pose(rpy=(np.pi / 2, 0.0, 0.0))
    )

    corners = reach_outline(robot)

    assert not has_round_reach(robot)
    assert has_round_reach(placed(robot.model, pose(rpy=(np.pi, 0.0, 1.0))))  # hanging
    np.testing.assert_allclose(corners[:, 1], -0.2, atol=1e-9)
    assert (corners[:, 0].min(), corners[:, 0].max()) == pytest.approx((-0.5, 0.5), abs=1e-6)
