"""The cooperation Jacobian against the derivative of an independent kinematics."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task, moved, random_cell

from cellplan.geometry.transforms import inverse, pose, pose_from, rotation_about, rotation_exp, rotation_vector
from cellplan.model.robot.robot import JointKind
from cellplan.planning.tracking.cooperation_jacobian import cooperation_jacobian, pose_errors
from cellplan.planning.tracking.task_constraints import TaskConstraints, constraint_rows
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

SOME_POSE = pose([1.0, -2.0, 0.5], [0.3, -0.8, 2.0])
DERIVATIVE_TOL = 1e-6  # relative; central differences with h = 1e-5 leave h^2 and eps / h, both near 1e-10
H = 1e-5


def relative_poses(cell, q):
    """Tool poses on the part by screw displacements: shares no code with the planner's kinematics."""
    poses = {r.name: ScrewChain(r).tool_poses(q[None, cell.columns(r.name)])[0] for r in cell.robots}
    X_WP = poses["holder"] @ inverse(cell.part.held_by[0].X_PT) if cell.part.held_by else cell.part.X_WP
    return np.stack([inverse(X_WP) @ poses[task.robot] for task in cell.tasks])


def planners_jacobian(cell, q, moving):
    model = CombinedModel(cell)
    state = model.state(q)
    names = [r.name for r in cell.robots]
    p_WT = state.X_WT[[names.index(t.robot) for t in cell.tasks], :3, 3]
    return cooperation_jacobian(
        state, p_WT, TaskConstraints.of(cell, cell.tasks, moving).column_signs(model.carries_flange)
    )


def central_differences(cell, q, moving):
    columns = []
    for j in range(cell.joint_count):
        step = np.zeros_like(q)
        if any(cell.columns(name).start <= j < cell.columns(name).stop for name in moving):
            step[j] = H
        ahead, behind, here = (relative_poses(cell, x) for x in (q + step, q - step, q))
        linear = (ahead - behind)[:, :3, 3] / (2 * H)
        R_T = np.swapaxes(here[:, :3, :3], 1, 2)
        angular = rotation_vector(ahead[:, :3, :3] @ R_T) - rotation_vector(behind[:, :3, :3] @ R_T)
        columns.append(np.concatenate([linear, angular / (2 * H)], axis=1))
    return np.stack(columns, axis=2)


@pytest.mark.parametrize("operators", [1, 2, 4, *(pytest.param(n, marks=pytest.mark.slow) for n in (3, 5, 6, 7, 8))])
@pytest.mark.parametrize("with_follower", [False, True], ids=["plain", "follower"])
def test_jacobian_is_the_derivative_of_the_relative_poses(operators, with_follower):
    cell = random_cell(operators, operators=operators, with_follower=with_follower)
    q = np.random.default_rng(7).uniform(-1.5, 1.5, cell.joint_count)
    moving = [r.name for r in cell.robots]

    J = planners_jacobian(cell, q, moving)

    expected = central_differences(cell, q, moving)
    assert np.abs(J - expected).max() <= DERIVATIVE_TOL * np.abs(expected).max()


def test_random_cells_have_prismatic_joints_in_positioner_and_operator():
    cell = random_cell(3, operators=3)
    for robot in cell.robots:
        assert {joint.is_revolute for joint in robot.model.joints} == {True, False}


def test_part_at_rest_gives_zero_positioner_columns():
    cell = random_cell(11, operators=3)
    q = np.random.default_rng(1).uniform(-1.5, 1.5, cell.joint_count)
    operators = [task.robot for task in cell.tasks]

    J = planners_jacobian(cell, q, operators)

    assert not J[:, :, cell.columns("holder")].any()
    assert np.abs(J - central_differences(cell, q, operators)).max() <= DERIVATIVE_TOL * np.abs(J).max()


def test_part_on_a_fixture_needs_no_positioner():
    cell = random_cell(12, operators=2, held=False)
    q = np.random.default_rng(2).uniform(-1.5, 1.5, cell.joint_count)
    moving = [r.name for r in cell.robots]

    J = planners_jacobian(cell, q, moving)

    assert np.abs(J - central_differences(cell, q, moving)).max() <= DERIVATIVE_TOL * np.abs(J).max()


def test_blocks_form_an_arrow():
    cell = random_cell(13, operators=4)
    q = np.random.default_rng(3).uniform(-1.5, 1.5, cell.joint_count)
    J = planners_jacobian(cell, q, [r.name for r in cell.robots])
    for i, task in enumerate(cell.tasks):
        assert J[i][:, cell.columns(task.robot)].any()
        assert J[i][:, cell.columns("holder")].any()
        for other in cell.tasks:
            if other is not task:
                assert not J[i][:, cell.columns(other.robot)].any()


def test_moving_the_whole_cell_changes_nothing():
    cell = random_cell(14, operators=3)
    q = np.random.default_rng(4).uniform(-1.5, 1.5, cell.joint_count)
    moving = [r.name for r in cell.robots]

    here, there = planners_jacobian(cell, q, moving), planners_jacobian(moved(cell, SOME_POSE), q, moving)

    assert np.abs(here - there).max() < 1e-12 * np.abs(here).max() * 10  # rounding of a few products


def test_two_engines_agree_on_poses_and_screws():
    cell = random_cell(15, operators=3, with_follower=True)
    q = np.random.default_rng(5).uniform(-2.0, 2.0, cell.joint_count)

    state = CombinedModel(cell).state(q)

    for index, robot in enumerate(cell.robots):
        columns = cell.columns(robot.name)
        chain = ScrewChain(robot)
        np.testing.assert_allclose(state.X_WT[index], chain.tool_poses(q[None, columns])[0], atol=1e-12)
        np.testing.assert_allclose(state.screws_W[:, columns], chain.flange_screws(q[None, columns])[0], atol=1e-11)


def test_planar_pair_has_the_closed_form():
    """Two joints in line: the relative speed is lever arm times rate, with a minus for the positioner."""
    cell = random_cell(16, operators=1)
    hinge = replace(
        cell.robots[0].model.joints[0],
        kind=JointKind.REVOLUTE,
        axis_B=np.array([0.0, 0.0, 1.0]),
        point_B=np.zeros(3),
    )
    model = replace(
        cell.robots[0].model, joints=(hinge,), flange_link=0, X_BF=pose_from(np.eye(3), np.array([1.0, 0, 0]))
    )
    eye = np.eye(4)
    robots = tuple(
        replace(r, model=model, X_WB=base, tool=replace(r.tool, X_FT=eye), weights=np.ones(1))
        for r, base in zip(cell.robots, (eye, pose_from(np.eye(3), np.array([0.0, 2.0, 0.0]))), strict=True)
    )
    part = replace(cell.part, held_by=(replace(cell.part.held_by[0], X_PT=eye),))
    cell = replace(cell, robots=robots, part=part)

    J = planners_jacobian(cell, np.zeros(2), ["holder", "op0"])[0]

    np.testing.assert_allclose(J[:, 0], [2.0, -1.0, 0, 0, 0, -1.0], atol=1e-15)  # -(z x (1, 2, 0)) and -z
    np.testing.assert_allclose(J[:, 1], [0.0, 1.0, 0, 0, 0, 1.0], atol=1e-15)  # z x (1, 0, 0) and z


def test_feedback_on_the_pose_error_closes_it():
    """Moving along the error by its full length must land on the desired pose."""
    rng = np.random.default_rng(6)
    X = pose_from(rotation_exp(rng.normal(size=(20, 3))), rng.normal(size=(20, 3)))
    desired = pose_from(rotation_exp(rng.normal(size=(20, 3))), rng.normal(size=(20, 3)))

    error = pose_errors(desired, X, [False] * 20)

    np.testing.assert_allclose(X[:, :3, 3] + error[:, :3], desired[:, :3, 3], atol=1e-14)
    np.testing.assert_allclose(rotation_exp(error[:, 3:]) @ X[:, :3, :3], desired[:, :3, :3], atol=1e-12)


def test_free_spin_error_lays_the_axis_and_ignores_the_turn():
    rng = np.random.default_rng(8)
    desired = pose_from(rotation_exp(rng.normal(size=(20, 3))), np.zeros((20, 3)))
    turned = desired.copy()
    turned[:, :3, :3] = desired[:, :3, :3] @ rotation_about(np.array([0.0, 0, 1]), rng.uniform(-3, 3, 20))
    tilt = rotation_exp(0.3 * rng.normal(size=(20, 3)))
    tilted = turned.copy()
    tilted[:, :3, :3] = tilt @ turned[:, :3, :3]

    assert np.abs(pose_errors(desired, turned, [True] * 20)).max() < 1e-14
    error = pose_errors(desired, tilted, [True] * 20)
    corrected = (rotation_exp(error[:, 3:]) @ tilted[:, :3, :3])[:, :, 2]
    np.testing.assert_allclose(corrected, desired[:, :3, 2], atol=1e-12)


def test_constraint_rows_pick_named_axes_and_leave_the_spin():
    X_PT = pose_from(rotation_exp(np.array([[0.2, 0.4, -0.1]])), np.zeros((1, 3)))
    planar = constraint_rows(make_task("op0", axes=(0, 1, 5)), X_PT)[0]
    spinning = constraint_rows(make_task("op0", is_spin_free=True), X_PT)[0]

    np.testing.assert_array_equal(planar, np.eye(6)[[0, 1, 5]])
    assert spinning.shape == (5, 6)
    about_tool_axis = np.concatenate([np.zeros(3), X_PT[0, :3, 2]])
    np.testing.assert_allclose(spinning @ about_tool_axis, 0.0, atol=1e-15)
    assert np.linalg.matrix_rank(spinning) == 5


@pytest.mark.parametrize("z", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -0.6, 0.8]])
def test_a_tool_that_points_the_other_way_is_half_a_turn_off(z):
    """Also where it points exactly backwards, so that the cross product of both axes says nothing."""
    x = np.cross(z, [0.1, 0.2, 0.3])
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    reversed_ = R * [1.0, -1.0, -1.0]

    error = pose_errors(pose_from(R, np.zeros(3))[None], pose_from(reversed_, np.zeros(3))[None], [True])[0, 3:]

    assert np.linalg.norm(error) == pytest.approx(np.pi, abs=1e-15)
    np.testing.assert_allclose(rotation_exp(error) @ reversed_[:, 2], z, atol=1e-15)
