"""Tool errors against displacements put in by hand and the rotation vector; poses against pinocchio."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task, random_cell
from builders.scene_builders import make_cell, placed, slide_model

from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose, pose_from, rotation_exp, rotation_vector, rpy_from_rotation
from cellplan.measures.tool_errors import (
    _turn_between,
    closure_accuracy,
    errors_on_part,
    part_poses,
    relative_to_task_frame,
    task_accuracy,
)
from cellplan.model.cell.cell import Grasp, Part, Robot, Tool
from cellplan.model.motion.motion import TaskSchedule
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.task.task import Frame
from cellplan.scene.kinematics.pinocchio_model import CombinedModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

RNG = np.random.default_rng(3)


def gantry():
    """A robot whose joints are x, y, z and yaw, pitch, roll of its tool."""
    directions = np.eye(3)[[0, 1, 2, 2, 1, 0]]
    joints = tuple(
        Joint(
            name=f"j{i}",
            kind=JointKind.PRISMATIC if i < 3 else JointKind.REVOLUTE,
            parent=i - 1 if i else BASE,
            axis_B=direction,
            point_B=np.zeros(3),
            lower=-9.0,
            upper=9.0,
            velocity=9.0,
        )
        for i, direction in enumerate(directions)
    )
    model = RobotModel(name="gantry", source="test", joints=joints, flange_link=5, X_BF=np.eye(4), bodies=())
    tool = Tool(X_FT=np.eye(4), bodies=())
    return ScrewChain(Robot(name="arm", model=model, X_WB=np.eye(4), tool=tool, start=None, weights=np.ones(6)))


def accuracy_at(scheduled, X_WT, X_WP):
    """What is found of a task when the tool stands at given places in the world."""
    q = np.array([[*X[:3, 3], *rpy_from_rotation(X[:3, :3])[::-1]] for X in X_WT])
    return task_accuracy(scheduled, gantry(), q=q, X_WP=X_WP)


def scheduled_task(X_PT, **changes):
    n = len(X_PT)
    task = make_task(
        "arm", name="ring", tolerance=ToleranceEntry(position_mm=0.1, orientation_deg=np.degrees(1e-3)), **changes
    )
    return TaskSchedule(task=task, X_PT=X_PT, V_PT_P=np.zeros((n, 6)), travelled=np.zeros(n), length=1.0, end=1.0)


def random_poses(n):
    return pose_from(rotation_exp(RNG.normal(size=(n, 3))), RNG.normal(size=(n, 3)))


def accuracy_of(offset, turn, **options):
    """Displace a tool from its desired place by a known offset and turn in P."""
    desired, X_WP = random_poses(len(offset)), random_poses(len(offset))
    actual = desired.copy()
    actual[:, :3, 3] -= offset
    actual[:, :3, :3] = rotation_exp(-turn) @ desired[:, :3, :3]
    scheduled = scheduled_task(desired, **options)
    return accuracy_at(scheduled, X_WP @ actual, X_WP)


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1e-2, 1.0, 3.0])
def test_known_displacement_comes_back(size):
    offset = size * RNG.normal(size=(50, 3))
    direction = RNG.normal(size=(50, 3))
    turn = size * direction / np.linalg.norm(direction, axis=1, keepdims=True)

    accuracy = accuracy_of(offset, turn)

    np.testing.assert_allclose(accuracy.position_error, offset, atol=1e-14)  # rounding of poses of size 1
    np.testing.assert_allclose(accuracy.orientation_error, turn, atol=2e-15 if size < 1e-3 else 1e-12)


def test_half_turn_is_not_lost():
    accuracy = accuracy_of(np.zeros((1, 3)), np.array([[np.pi, 0.0, 0.0]]))
    assert np.linalg.norm(accuracy.orientation_error) == pytest.approx(np.pi, abs=1e-7)  # sin is flat there


def test_open_components_do_not_count():
    offset, turn = RNG.normal(size=(5, 3)), np.zeros((5, 3))
    turn[:, 2] = 0.2
    accuracy = accuracy_of(offset, turn, axes=(0, 1))
    np.testing.assert_allclose(accuracy.position_error[:, :2], offset[:, :2], atol=1e-14)
    assert not accuracy.position_error[:, 2].any()
    assert not accuracy.orientation_error.any()


def test_free_spin_counts_the_tilt_alone():
    desired, eye = random_poses(20), np.eye(4)[None]
    spun = desired.copy()
    spins = np.zeros((20, 3))
    spins[:, 2] = RNG.uniform(-3, 3, 20)
    spun[:, :3, :3] = desired[:, :3, :3] @ rotation_exp(spins)
    tilts = np.cross(desired[:, :3, 2], RNG.normal(size=(20, 3)))
    tilts *= 0.1 / np.linalg.norm(tilts, axis=1, keepdims=True)
    tilted = spun.copy()
    tilted[:, :3, :3] = rotation_exp(-tilts) @ spun[:, :3, :3]
    scheduled = scheduled_task(desired, is_spin_free=True)

    only_spun = accuracy_at(scheduled, spun, eye)
    also_tilted = accuracy_at(scheduled, tilted, eye)

    assert np.abs(only_spun.orientation_error).max() < 1e-15
    np.testing.assert_allclose(also_tilted.orientation_error, tilts, atol=1e-14)


def test_chord_formula_agrees_with_the_rotation_vector():
    turns = rotation_exp(RNG.uniform(-1.7, 1.7, (200, 3)))
    columns = np.swapaxes(turns, 1, 2)
    np.testing.assert_allclose(
        _turn_between(np.broadcast_to(np.eye(3), columns.shape), columns), rotation_vector(turns), atol=1e-12
    )


def two_slides(axes=(0, 1, 2, 3, 4, 5)):
    """Two sliding blocks hold a bar of 0.4 m; both slide along the world's x axis. The part lies turned by 90 deg."""
    block = Box((0.1, 0.1, 0.1))
    robots = (
        placed("first", slide_model(block), base=pose((0.0, -0.2, 0.0))),
        placed("second", slide_model(block), base=pose((0.0, 0.2, 0.0))),
    )
    quarter = (0.0, 0.0, 0.5 * np.pi)
    grasps = (
        Grasp(robot="first", X_PT=pose((-0.2, 0.0, 0.0), tuple(-a for a in quarter))),
        Grasp(robot="second", X_PT=pose((0.2, 0.0, 0.0), tuple(-a for a in quarter)), axes=axes),
    )
    part = Part(shape=Box((0.4, 0.05, 0.05)), X_PS=np.eye(4), held_by=grasps, X_WP=None)
    return make_cell(*robots, part=part)


def closures_of(cell, first, second):
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    q = {"first": np.array(first)[:, None], "second": np.array(second)[:, None]}
    return closure_accuracy(cell, chains, q, part_poses(cell, chains, q))


def test_blocks_that_slide_together_keep_the_loop_closed():
    (closure,) = closures_of(two_slides(), [0.0, 0.3, -0.5], [0.0, 0.3, -0.5])
    assert closure.robot == "second"
    assert np.abs(closure.position_error).max() < 1e-15
    assert np.abs(closure.orientation_error).max() < 1e-15


def test_a_block_that_runs_ahead_is_away_from_its_grasp_by_as_much():
    (closure,) = closures_of(two_slides(), [0.0, 0.1, 0.2], [0.0, 0.1 + 2e-6, 0.2 - 5e-6])
    np.testing.assert_allclose(closure.position_error[:, 1], [0.0, 2e-6, -5e-6], atol=1e-15)  # the part's -y is x
    np.testing.assert_allclose(closure.position_error[:, [0, 2]], 0.0, atol=1e-15)


def test_a_tool_that_is_turned_in_its_grasp_is_away_by_that_angle_and_no_distance():
    cell = two_slides()
    first, second = cell.part.held_by
    turned = replace(second, X_PT=second.X_PT @ pose((0.0, 0.0, 0.0), (0.0, 1e-3, 0.0)))

    (closure,) = closures_of(replace(cell, part=replace(cell.part, held_by=(first, turned))), [0.0] * 3, [0.0] * 3)

    assert closure.position_error.shape == (3, 3)
    assert np.abs(closure.position_error).max() < 1e-15
    np.testing.assert_allclose(np.abs(closure.orientation_error), [[1e-3, 0.0, 0.0]] * 3, atol=1e-12)


def test_components_that_the_grasp_leaves_open_do_not_count():
    (closure,) = closures_of(two_slides(axes=(0, 2)), [0.0, 0.1, 0.2], [0.0, 0.4, 0.2])
    assert not closure.position_error[:, 1].any()
    assert np.abs(closure.position_error).max() < 1e-15


def test_a_cell_with_one_holder_has_no_closures():
    cell = two_slides()
    cell = replace(cell, part=replace(cell.part, held_by=cell.part.held_by[:1]))
    assert closures_of(cell, [0.0, 0.1, 0.2], [0.0, 0.4, 0.2]) == ()


@pytest.mark.parametrize("held", [False, True], ids=["at rest", "held"])
def test_poses_of_the_part_and_of_tools_on_it_are_those_of_pinocchio(held):
    cell = random_cell(7, operators=2, held=held)
    q = np.random.default_rng(7).uniform(-1.5, 1.5, (9, cell.joint_count))
    states = [CombinedModel(cell).state(row) for row in q]
    by_robot = {robot.name: q[:, cell.columns(robot.name)] for robot in cell.robots}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}

    X_WP = part_poses(cell, chains, by_robot)

    expected = np.array([state.X_WP for state in states])
    np.testing.assert_allclose(np.broadcast_to(X_WP, expected.shape), expected, atol=1e-12)
    for frame, X_WF in ((Frame.PART, expected), (Frame.WORLD, np.eye(4)[None])):
        X_WT = np.array([state.X_WT[1] for state in states])
        relative = relative_to_task_frame(make_task("op0", relative_to=frame), X_WT, X_WP)
        np.testing.assert_allclose(X_WF @ relative, X_WT, atol=1e-12)


def test_errors_are_the_rate_of_poses_that_drift_with_a_constant_twist():
    """Of ``exp(t w) X`` in P the error grows with t w: central differences, another way to the same rotation vector."""
    desired, twist, h = random_poses(30), RNG.normal(size=6), 1e-5
    task = scheduled_task(desired).task

    def drifted(t):
        X = desired.copy()
        X[:, :3, 3] += t * twist[:3]
        X[:, :3, :3] = rotation_exp(t * twist[None, 3:]) @ desired[:, :3, :3]
        return errors_on_part(X, desired, task)

    np.testing.assert_allclose((drifted(-h) - drifted(h)) / (2.0 * h), np.tile(twist, (30, 1)), rtol=1e-6, atol=1e-8)
