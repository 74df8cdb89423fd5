"""Links and axes of the combined model against the other kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import random_cell

from cellplan.scene.kinematics.pinocchio_model import MAX_AXES, CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

ROUNDING = 1e-12  # [-] products of a dozen matrices of order one
H = 1e-6  # [rad] or [m]


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_links_stand_where_successive_screws_put_them(with_follower: bool) -> None:
    cell = random_cell(2, operators=2, with_follower=with_follower)
    q = np.random.default_rng(2).uniform(-1.5, 1.5, cell.joint_count)
    D = CombinedModel(cell).links(q).D
    expected = [ScrewChain(r).link_displacements(q[None, cell.columns(r.name)])[0, 1:] for r in cell.robots]
    np.testing.assert_allclose(D, np.concatenate(expected), atol=100 * ROUNDING)


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_points_of_links_move_as_their_screws_say(with_follower: bool) -> None:
    """Also links beside the way to the flange, which the screws of the flange do not know."""
    cell = random_cell(3, operators=1, with_follower=with_follower)
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, cell.joint_count)
    model = CombinedModel(cell)
    links, point = model.links(q), np.append(rng.normal(size=3), 1.0)
    places = (links.D @ point)[:, :3]
    speeds = links.screws_W[:3, None] + np.cross(links.screws_W[3:, None], places.T[:, :, None], axis=0)

    velocities = model.along_joints(speeds * model.carries_link)

    for joint, e in enumerate(np.eye(len(q))):
        expected = ((model.links(q + H * e).D - model.links(q - H * e).D) @ point)[:, :3] / (2 * H)
        np.testing.assert_allclose(velocities[:, :, joint].T, expected, atol=1e-8)  # eps / H


def test_first_links_follow_the_order_of_the_robots() -> None:
    cell = random_cell(4, operators=2, with_follower=True)
    counts = [len(robot.model.joints) + len(robot.model.followers) for robot in cell.robots]
    assert CombinedModel(cell).first_link == [0, counts[0], counts[0] + counts[1]]


def test_a_cell_of_one_single_joint_has_one_column() -> None:
    cell = random_cell(4, operators=1, held=False, joints=1)
    cell = replace(cell, robots=cell.robots[1:])
    q = np.array([0.3])
    model = CombinedModel(cell)
    assert model.state(q).screws_W.shape == model.links(q).screws_W.shape == (6, 1)
    assert np.array_equal(model.state(q).screws_W, model.links(q).screws_W)


@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_more_robots_than_one_model_takes_stand_where_successive_screws_put_them(with_follower: bool) -> None:
    cell = random_cell(5, operators=11, with_follower=with_follower)
    assert cell.joint_count > MAX_AXES
    q = np.random.default_rng(5).uniform(-1.5, 1.5, cell.joint_count)
    chains = [ScrewChain(robot) for robot in cell.robots]
    by_robot = [q[None, cell.columns(robot.name)] for robot in cell.robots]
    model = CombinedModel(cell)

    state, links = model.state(q), model.links(q)

    tools = np.concatenate([chain.tool_poses(q_robot) for chain, q_robot in zip(chains, by_robot, strict=True)])
    np.testing.assert_allclose(state.X_WT, tools, atol=100 * ROUNDING)
    screws = np.concatenate(
        [chain.flange_screws(q_robot)[0] for chain, q_robot in zip(chains, by_robot, strict=True)], axis=1
    )
    np.testing.assert_allclose(state.screws_W, screws, atol=100 * ROUNDING)
    D = np.concatenate(
        [chain.link_displacements(q_robot)[0, 1:] for chain, q_robot in zip(chains, by_robot, strict=True)]
    )
    np.testing.assert_allclose(links.D, D, atol=100 * ROUNDING)
    owner = np.repeat(np.arange(12), [len(r.model.joints) + len(r.model.followers) for r in cell.robots])
    assert not model.carries_link[owner[:, None] != owner[None, :]].any()
    assert model.carries_link.diagonal().all()
