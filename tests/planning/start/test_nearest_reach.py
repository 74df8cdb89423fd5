"""Nearest reach: distances to goals out of reach, against closed forms of a planar arm and of limits."""

import numpy as np
import pytest

from cellplan import load_cell
from cellplan.geometry.transforms import pose
from cellplan.kinematics.screw_chain import ScrewChain
from cellplan.planning.start.inverse_kinematics import random_configurations
from cellplan.planning.start.nearest_reach import nearest_reach


@pytest.fixture(scope="module")
def arm(cells):
    """The right planar arm of the cell with its task, whose longest link is stretched out at zero."""
    cell = load_cell(cells / "planar_pair.yaml")
    return cell.robot("right"), cell.task("circle")


def tip_left(robot, task, goal):
    seeds = random_configurations(robot.model, 12, np.random.default_rng(0))
    return nearest_reach(robot, task, goal, X_WP=np.eye(4), seeds=seeds, tip_only=True)[0]


def test_a_goal_beyond_the_stretched_arm_is_as_far_as_it_is_beyond(arm):
    robot, task = arm
    base = robot.X_WB[:3, 3]
    stretched = ScrewChain(robot).tool_poses(np.zeros((1, 3)))[0, :3, 3]
    length = float(np.linalg.norm((stretched - base)[:2]))
    direction = np.array([np.cos(2.0), np.sin(2.0), 0.0])
    for beyond in (0.05, 0.7, 5.0):
        goal = pose(base + (length + beyond) * direction)
        assert tip_left(robot, task, goal) == pytest.approx(beyond, abs=1e-4)


def test_a_goal_within_reach_leaves_nothing(arm):
    robot, task = arm
    goal = ScrewChain(robot).tool_poses(np.array([[0.3, 0.9, -0.5]]))[0]
    assert tip_left(robot, task, goal) < 1e-6
