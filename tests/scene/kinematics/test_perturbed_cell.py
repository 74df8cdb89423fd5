"""The cell as it really stands, against the nominal chain moved by hand."""

from dataclasses import replace

import numpy as np
import pytest
from builders.dynamic_robots import random_robot
from builders.random_cells import random_model, random_pose

from cellplan import load_cell
from cellplan.geometry.transforms import inverse, pose
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.cell.cell_errors import CellErrors, Draw, RobotDraw, link_vector, sample
from cellplan.model.settings.cell_errors import PoseErrorEntry, RobotErrorsEntry, ShiftSpreadEntry, TurnSpreadEntry
from cellplan.model.settings.units import Mm
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.kinematics.perturbed_cell import draw_errors, perturbed_cell
from cellplan.scene.kinematics.screw_chain import ScrewChain

ROUNDING = 1e-12  # [m], [-] a few hundred operations on numbers near one


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "planar_pair.yaml")


def robot_of(model, rng):
    tool = Tool(X_FT=random_pose(rng), bodies=())
    n = len(model.joints)
    return Robot(name="left", model=model, X_WB=random_pose(rng), tool=tool, start=None, weights=np.ones(n))


def exact(robot):
    n = len(robot.model.joints)
    return RobotDraw(joint_offsets=np.zeros(n), link_lengths=np.zeros(n), X_base=np.eye(4), X_tool=np.eye(4))


def draw_of(cell, **changes):
    robots = {robot.name: exact(robot) for robot in cell.robots}
    robots |= {name: replace(robots[name], **change) for name, change in changes.items()}
    return Draw(robots=robots, X_grasps={grasp.robot: np.eye(4) for grasp in cell.part.held_by})


def with_robot(cell, robot):
    return replace(cell, robots=(robot, cell.robot("right")))


def test_a_joint_offset_means_a_posture_that_much_further_on(cell):
    """Chains with sliding joints and followers, one of them on the way to the flange."""
    rng = np.random.default_rng(1)
    robot = robot_of(random_model(rng, 6, with_follower=True), rng)
    offsets, q = 0.3 * rng.normal(size=6), rng.normal(size=(5, 6))
    written = with_robot(cell, robot)

    real = perturbed_cell(written, draw_of(written, left={"joint_offsets": offsets})).robot("left")

    np.testing.assert_allclose(
        ScrewChain(real).tool_poses(q), ScrewChain(robot).tool_poses(q + offsets), atol=100 * ROUNDING
    )


def test_one_offset_of_a_planar_arm_moves_the_tool_by_its_lever_times_the_angle(cell):
    arm, offset = cell.robot("left"), 1e-4
    q = np.deg2rad([[50.0, -85.0, 35.0]])

    real = perturbed_cell(cell, draw_of(cell, left={"joint_offsets": np.array([0.0, offset, 0.0])})).robot("left")

    tip, moved = (ScrewChain(robot).tool_poses(q)[0, :3, 3] for robot in (arm, real))
    lever = np.linalg.norm((tip - ScrewChain(arm).axis_points(q)[0, 1])[:2])
    assert np.linalg.norm(moved - tip) == pytest.approx(2 * lever * np.sin(offset / 2), rel=1e-9)  # the chord


def test_a_longer_link_moves_all_that_comes_after_it_along_the_link(cell):
    arm = cell.robot("left")
    along = link_vector(arm.model, 1)
    q = np.zeros((1, 3))

    real = perturbed_cell(cell, draw_of(cell, left={"link_lengths": np.array([0.0, 2e-3, 0.0])})).robot("left")

    before, after = ScrewChain(arm), ScrewChain(real)
    shift = arm.X_WB[:3, :3] @ along * (2e-3 / np.linalg.norm(along))
    assert np.linalg.norm(link_vector(real.model, 1)) == pytest.approx(np.linalg.norm(along) + 2e-3)
    np.testing.assert_allclose(after.tool_poses(q)[0, :3, 3], before.tool_poses(q)[0, :3, 3] + shift, atol=ROUNDING)
    np.testing.assert_allclose(after.axis_points(q)[0, 0], before.axis_points(q)[0, 0], atol=ROUNDING)
    np.testing.assert_allclose(link_vector(real.model, 2), link_vector(arm.model, 2), atol=ROUNDING)


def test_a_link_without_length_cannot_grow(cell):
    written = cell.robot("left")
    first, second, third = written.model.joints
    joints = (first, replace(second, point_B=first.point_B), third)
    folded = with_robot(cell, replace(written, model=replace(written.model, joints=joints)))

    with pytest.raises(ValueError, match=f"the link before joint '{second.name}' has no length"):
        perturbed_cell(folded, draw_of(folded, left={"link_lengths": np.array([0.0, 1e-3, 0.0])}))


def test_base_tool_and_grasp_are_seen_from_their_written_places(cell):
    rng = np.random.default_rng(2)
    E_B, E_T, E_P = (pose(1e-3 * rng.normal(size=3), 1e-3 * rng.normal(size=3)) for _ in range(3))
    draw = replace(draw_of(cell, left={"X_base": E_B, "X_tool": E_T}), X_grasps={"left": E_P})
    q = np.deg2rad([[50.0, -85.0, 35.0]])

    real = perturbed_cell(cell, draw)

    base = cell.robot("left").X_WB
    X_BT = inverse(base) @ ScrewChain(cell.robot("left")).tool_poses(q)[0]
    X_WT = ScrewChain(real.robot("left")).tool_poses(q)[0]
    np.testing.assert_allclose(X_WT, base @ E_B @ X_BT @ E_T, atol=ROUNDING)
    X_TP = inverse(cell.part.held_by[0].X_PT)
    np.testing.assert_allclose(X_WT @ inverse(real.part.held_by[0].X_PT), X_WT @ X_TP @ E_P, atol=ROUNDING)


def test_no_errors_give_the_same_cell(cell):
    rng = np.random.default_rng(3)
    q = rng.normal(size=(3, 3))

    real = perturbed_cell(cell, draw_of(cell))

    for robot in cell.robots:
        np.testing.assert_allclose(
            ScrewChain(real.robot(robot.name)).tool_poses(q), ScrewChain(robot).tool_poses(q), atol=ROUNDING
        )
        bodies = zip(real.robot(robot.name).model.bodies, robot.model.bodies, strict=True)
        assert all(np.allclose(new.X_BS, old.X_BS, atol=ROUNDING) for new, old in bodies)


def test_draws_follow_the_cell_and_not_the_order_of_the_file(cell):
    wide, turning = ShiftSpreadEntry(normal=1000.0), TurnSpreadEntry(normal=45.0)
    names = [joint.name for joint in cell.robot("left").model.joints]
    left = RobotErrorsEntry(joint_offsets_deg=dict.fromkeys(names, turning))
    right = RobotErrorsEntry(base=PoseErrorEntry(xyz_mm=(wide, wide, wide)))
    forwards = CellErrors(robots={"left": left, "right": right}, seed=4)
    turned = RobotErrorsEntry(joint_offsets_deg=dict.fromkeys(reversed(names), turning))
    backwards = CellErrors(robots={"right": right, "left": turned}, seed=4)

    first, second = draw_errors(cell, forwards, 0), draw_errors(cell, backwards, 0)

    np.testing.assert_array_equal(first.robots["left"].joint_offsets, second.robots["left"].joint_offsets)
    np.testing.assert_array_equal(first.robots["right"].X_base, second.robots["right"].X_base)
    assert not np.array_equal(first.robots["right"].X_base, draw_errors(cell, forwards, 1).robots["right"].X_base)


def test_distributions_are_centred_and_as_wide_as_stated():
    rng = np.random.default_rng(5)
    normal = np.array([1e3 * sample(ShiftSpreadEntry(normal=2.0), rng) for _ in range(4000)])
    uniform = np.array([1e3 * sample(ShiftSpreadEntry(uniform=3.0), rng) for _ in range(4000)])

    assert abs(normal.mean()) < 4 * 2.0 / np.sqrt(4000)  # four standard errors of the mean
    assert normal.std() == pytest.approx(2.0, rel=4 / np.sqrt(2 * 4000))
    assert np.abs(uniform).max() <= 3.0
    assert uniform.std() == pytest.approx(3.0 / np.sqrt(3), rel=0.05)
    assert sample(Mm(0.5), rng) == 5e-4


def test_what_is_mounted_on_a_link_goes_with_it_as_its_own_bodies_do(cell):
    left = cell.robot("left")
    twin = replace(left.model.bodies[-1], name="valve")
    draw = draw_of(
        cell, left={"joint_offsets": np.array([0.1, -0.2, 0.3]), "link_lengths": np.array([0.0, 0.01, 0.02])}
    )

    real = perturbed_cell(with_robot(cell, replace(left, attachments=(twin,))), draw).robot("left")

    assert len(real.model.bodies) == len(left.model.bodies)
    np.testing.assert_allclose(real.attachments[0].X_BS, real.model.bodies[-1].X_BS, atol=ROUNDING)


def test_masses_go_with_their_links(cell):
    """A joint offset means a posture that much further on for what weighs on the joints, too."""
    rng = np.random.default_rng(5)
    robot = replace(random_robot(4), name="left")
    offsets, q = 0.1 * rng.normal(size=6), rng.normal(size=(3, 6))
    still = JointRows(q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))

    real = with_robot(cell, robot)
    moved = perturbed_cell(real, draw_of(real, left={"joint_offsets": offsets})).robot("left")

    expected = joint_torques(ScrewChain(robot), robot.model, replace(still, q=q + offsets)).joints
    np.testing.assert_allclose(joint_torques(ScrewChain(moved), moved.model, still).joints, expected, atol=1e-9)
