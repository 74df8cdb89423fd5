"""The zero of the controller: stated once, in the robot file, and checked against arms that count as the maker does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.robots.joint_table import bundled_names, load_bundled
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf
from cellplan.geometry.shapes import support
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import Body, RobotModel
from cellplan.scene.kinematics.reach import arm_reach
from cellplan.scene.kinematics.screw_chain import ScrewChain

POSITION_TOL = 1e-12  # [m] rounding of a few metres


def chain(model: RobotModel) -> ScrewChain:
    """The kinematics of a robot alone."""
    tool = Tool(X_FT=np.eye(4), bodies=())
    weights = np.ones(len(model.joints))
    return ScrewChain(Robot(name="arm", model=model, X_WB=np.eye(4), tool=tool, start=None, weights=weights))


@pytest.fixture(scope="module")
def configurations() -> Array:
    """Configurations of six joints in [rad], shape (50, 6)."""
    return np.random.default_rng(9).uniform(-3.0, 3.0, (50, 6))


def test_both_kuka_files_are_one_arm(configurations: Array) -> None:
    printed, maker = load_bundled("kuka_kr6"), load_bundled("kuka_kr6_maker_zero")
    assert printed.controller is not None
    assert maker.controller is not None
    assert maker.controller.is_identity

    counted = printed.controller.from_model(configurations)

    np.testing.assert_allclose(
        chain(maker).flange_poses(counted), chain(printed).flange_poses(configurations), atol=POSITION_TOL
    )


def test_the_links_of_both_kuka_files_carry_the_same_bodies(configurations: Array) -> None:
    """Each body reaches equally far in the world along each axis, in both senses."""
    printed, maker = load_bundled("kuka_kr6"), load_bundled("kuka_kr6_maker_zero")
    assert printed.controller is not None
    moved = chain(printed).link_displacements(configurations)
    counted = chain(maker).link_displacements(printed.controller.from_model(configurations))

    assert len(printed.bodies) == len(maker.bodies)
    for body, other in zip(printed.bodies, maker.bodies, strict=True):
        assert (body.name, body.link, body.accuracy) == (other.name, other.link, other.accuracy)
        expected = extents(body, moved[:, body.link + 1])
        np.testing.assert_allclose(extents(other, counted[:, other.link + 1]), expected, atol=POSITION_TOL)


def extents(body: Body, D: Array) -> Array:
    """How far a body reaches along the axes of the world, both ways, for displacements of its link, shape (N, 6)."""
    X = D @ body.X_BS
    directions = np.concatenate([np.eye(3), -np.eye(3)])
    return np.asarray(support(body.shape, directions @ X[:, :3, :3]) + X[:, :3, 3] @ directions.T)


def test_the_kuka_stands_upright_where_its_maker_says_so() -> None:
    """A2 = -90 deg and A3 = 90 deg: upper arm upright, forearm level, as the figures of the maker's manual."""
    printed = load_bundled("kuka_kr6").controller
    assert printed is not None

    np.testing.assert_allclose(np.rad2deg(printed.from_model(np.zeros(6))), [0, -90, 90, 0, 0, 0], atol=1e-12)


def test_the_kuka_turns_as_the_arms_of_its_family(configurations: Array, shared_robots: Path) -> None:
    """The orientation of the flange depends on axes' directions alone, which all of these arms share."""
    maker = load_bundled("kuka_kr6_maker_zero")
    folder = shared_robots / "kuka_kr16_2"
    kr16 = load_urdf(folder / "kuka_kr16_2.urdf", UrdfOptions(package_dirs=(shared_robots,))).model

    result = chain(maker).flange_poses(configurations)[:, :3, :3]
    expected = chain(kr16).flange_poses(configurations)[:, :3, :3]

    np.testing.assert_allclose(result, expected, atol=1e-9)  # the URDF writes pi with 16 digits


def test_the_limits_of_the_kuka_belong_to_the_maker_s_zero() -> None:
    """The wrist reaches 1611 mm from the first axis, as the maker states, with limits that count from its zero."""
    model = load_bundled("kuka_kr6_maker_zero")
    wrist = model.joints[4].point_B
    to_wrist = replace(model, X_BF=np.block([[np.eye(3), wrist[:, None]], [0.0, 0.0, 0.0, 1.0]]))

    assert arm_reach(to_wrist) == pytest.approx(1.611, abs=5e-4)  # the maker rounds to millimetres


def test_robots_of_unknown_counting_say_so() -> None:
    stated = {name for name in bundled_names() if load_bundled(name).controller is not None}

    assert {"abb_irb1600", "kuka_kr6", "kuka_kr6_maker_zero"} <= stated
    assert not stated & {"reis_rv20_16", "staubli_rx90l", "staubli_rx90l_as_printed", "planar_3r"}
