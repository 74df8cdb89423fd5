"""Closure errors by known displacements of the holders' tools."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import make_cell, placed, slide_model

from cellplan.checks.tools.closure import check_closure, closure_accuracy
from cellplan.checks.tools.tracking import part_poses
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Grasp, Part
from cellplan.scene.kinematics.screw_chain import ScrewChain

TIMES = np.array([0.0, 0.1, 0.2])


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
