"""All links of a cell at once against the chains of its robots, and the bound of their reach."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.scene.kinematics.link_forest import WORLD, LinkForest
from cellplan.scene.kinematics.reach import arm_reach, reach_bound
from cellplan.scene.kinematics.screw_chain import ScrewChain

FOLDER = Path(__file__).resolve().parents[3] / "cells"


@pytest.fixture(scope="module", params=["four_robots", "rail", "turntable"])
def cell(request: pytest.FixtureRequest) -> Cell:
    return load_cell(FOLDER / f"{request.param}.yaml")


def axis_screws(robot: Robot, D: Array) -> Array:
    """Twists of unit speed of the axes of ``robot``, (N, axes, 6), one axis after the other."""
    screws = []
    for axis in robot.model.axes:
        X = D[:, axis.parent + 1]
        s, point = X[:, :3, :3] @ axis.axis_B, X[:, :3, :3] @ axis.point_B + X[:, :3, 3]
        screws.append(np.hstack([np.cross(point, s), s] if axis.is_revolute else [s, np.zeros_like(s)]))
    return np.stack(screws, axis=1)


def test_links_and_axes_are_those_of_the_chains(cell: Cell) -> None:
    forest, q = LinkForest(cell.robots), np.random.default_rng(0).uniform(-1.0, 1.0, (4, cell.joint_count))
    D = forest.displacements(q, np.array([robot.X_WB for robot in cell.robots]))
    screws, first = forest.screws(D), 0
    np.testing.assert_array_equal(D[WORLD], np.tile(np.eye(4), (4, 1, 1)))
    for robot in cell.robots:
        chain = ScrewChain(robot)
        expected = chain.link_displacements(q[:, cell.columns(robot.name)])
        for link in range(-1, len(robot.model.axes)):
            np.testing.assert_allclose(D[forest.place(robot.name, link)], expected[:, link + 1], atol=1e-13)
        axes = slice(first, first + len(robot.model.axes))
        np.testing.assert_allclose(np.swapaxes(screws[axes], 0, 1), axis_screws(robot, expected), atol=1e-13)
        first = axes.stop


def test_tool_motion_is_that_of_poses_and_screws(cell: Cell) -> None:
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (4, cell.joint_count))
    for robot in cell.robots:
        chain, q_robot = ScrewChain(robot), q[:, cell.columns(robot.name)]
        X_WT, screws = chain.tool_motion(q_robot)
        np.testing.assert_allclose(X_WT, chain.tool_poses(q_robot), atol=1e-13)
        np.testing.assert_allclose(screws, chain.flange_screws(q_robot), atol=1e-13)


def test_positions_that_are_no_numbers_have_no_links(cell: Cell) -> None:
    forest = LinkForest(cell.robots)
    with pytest.raises(ValueError, match="a joint position or a base is not finite"):
        forest.displacements(np.full((1, cell.joint_count), np.nan), np.array([r.X_WB for r in cell.robots]))


def test_no_tool_is_farther_than_the_bound_of_its_reach(cell: Cell) -> None:
    for robot in cell.robots:
        reach, tool = arm_reach(robot.model), float(np.linalg.norm(robot.tool.X_FT[:3, 3]))
        q = np.random.default_rng(2).uniform(-1.0, 1.0, (200, len(robot.model.joints)))
        first = robot.X_WB @ np.append(robot.model.axes[robot.model.links_to_flange[0]].point_B, 1.0)
        farthest = np.linalg.norm(ScrewChain(robot).tool_poses(q)[:, :3, 3] - first[:3], axis=1).max()
        assert farthest <= reach_bound(robot)
        assert reach - tool <= reach_bound(robot)
