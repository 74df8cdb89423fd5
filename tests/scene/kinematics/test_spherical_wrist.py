"""Closed-form configurations against the forward kinematics and the multi-start of searches."""

import numpy as np
import pytest
from builders.scene_builders import placed

from cellplan.files.robots.joint_table import load_bundled
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.kinematics.spherical_wrist import SphericalWristArm

WRISTED = (
    "abb_irb1600",
    "abb_irb1600_8_145",
    "kuka_kr16_2",
    "kuka_kr6",
    "reis_rv20_16",
    "staubli_rx160",
    "staubli_rx90l",
)
OTHERS = ("ur5e", "franka_panda", "kuka_lbr_iiwa_7_r800", "motopos_d500", "planar_3r")


def arm_of(model: RobotModel) -> SphericalWristArm:
    arm = SphericalWristArm.of(model)
    assert arm is not None
    return arm


def random_q(model: RobotModel, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, len(model.joints)))


@pytest.mark.parametrize("name", WRISTED)
def test_every_branch_leads_to_the_pose_and_one_is_where_it_came_from(name: str) -> None:
    model = load_bundled(name)
    chain, q = ScrewChain(placed("arm", model)), random_q(model, 60, 1)
    D = chain.link_displacements(q)[:, 6]

    branches = arm_of(model).configurations(D)

    reached = ~np.isnan(branches[..., 0])
    again = chain.link_displacements(branches[reached])[:, 6]
    assert np.abs(again - np.repeat(D, reached.sum(axis=1), axis=0)).max() < 1e-6
    turns = np.remainder(branches - q[:, None] + np.pi, 2.0 * np.pi) - np.pi
    assert np.nanmin(np.abs(turns).max(axis=-1), axis=1).max() < 1e-5
    assert set(reached.sum(axis=1).tolist()) <= {2, 4, 6, 8}


@pytest.mark.parametrize("name", OTHERS)
def test_arms_that_are_built_otherwise_have_none(name: str) -> None:
    assert SphericalWristArm.of(load_bundled(name)) is None
