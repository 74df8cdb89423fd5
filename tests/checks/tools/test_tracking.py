"""The reported tool error against errors put in by hand."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task
from builders.scene_builders import make_cell, placed, slide_model

from cellplan.checks.tools.tracking import (
    _turn_between,
    check_accuracy,
    check_closure,
    closure_accuracy,
    part_poses,
    task_accuracy,
)
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose, pose_from, rotation_exp, rotation_vector, rpy_from_rotation
from cellplan.model.cell.cell import Grasp, Part, Robot, Tool
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel
from cellplan.model.settings.task import ToleranceEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain

RNG = np.random.default_rng(3)
TIMES = np.array([0.0, 0.1, 0.2])


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


def test_check_names_instant_and_amount():
    offset = np.zeros((3, 3))
    offset[1, 0] = 2e-4
    accuracy = accuracy_of(offset, np.zeros((3, 3)))
    schedule = Schedule(times=np.array([0.0, 0.5, 1.0]), tasks=())
    position, orientation = check_accuracy(schedule, accuracy, scheduled_task(random_poses(1)).task)
    assert not position.passed
    assert position.message == "position error of task 'ring': 0.2 mm at 0.500 s, allowed 0.1 mm"
    assert orientation.passed


def test_errors_are_judged_from_the_instant_on_that_the_tool_has_settled():
    offset = np.zeros((5, 3))
    offset[:, 0] = [0.7, 0.1, 5e-5, 2e-5, 1e-5]
    accuracy = accuracy_of(offset, np.zeros((5, 3)))
    schedule = Schedule(times=np.array([0.0, 0.5, 1.0, 1.5, 2.0]), tasks=())
    task = scheduled_task(random_poses(1), start=0.5, settle=0.5).task

    settled, _ = check_accuracy(schedule, accuracy, task)
    early, _ = check_accuracy(schedule, accuracy, replace(task, settle=0.49))

    assert settled.passed
    assert settled.message == "position error of task 'ring': 0.05 mm at 1.000 s, allowed 0.1 mm, evaluated from 1 s"
    assert early.passed
    assert not check_accuracy(schedule, accuracy, replace(task, start=0.0))[0].passed
    assert check_accuracy(schedule, accuracy, replace(task, settle=99.0))[0].at_s == 2.0  # the last instant at least


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


def test_an_error_beyond_what_is_allowed_is_named_with_instant_and_cure():
    cell = two_slides()
    closures = closures_of(cell, [0.0, 0.0, 0.0], [0.0, 1e-6, 5e-6])

    position, orientation = check_closure(cell, TIMES, closures)

    assert (position.name, position.subject, position.passed) == ("closure_position_error", "second", False)
    assert position.value == pytest.approx(5e-3)
    assert position.limit == pytest.approx(3e-3)
    assert position.message == (
        "closure position error of 'second' on the part: 0.005 mm at 0.200 s, allowed 0.003 mm; a shorter "
        "motion.step_s, a slower motion or a path farther from singularities reduces it"
    )
    assert (orientation.name, orientation.passed, orientation.limit) == (
        "closure_orientation_error",
        True,
        pytest.approx(1e-3),
    )
    wider = replace(cell, checks=cell.checks.changed(closure_mm=0.006))
    assert all(check.passed for check in check_closure(wider, TIMES, closures))


def test_a_cell_with_one_holder_has_no_closures():
    cell = two_slides()
    cell = replace(cell, part=replace(cell.part, held_by=cell.part.held_by[:1]))
    assert closures_of(cell, [0.0, 0.1, 0.2], [0.0, 0.4, 0.2]) == ()
