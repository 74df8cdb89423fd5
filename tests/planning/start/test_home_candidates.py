"""Candidates for a home: within limits, the start first, then ever farther from it."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, placed, slide_model, stick

from cellplan.geometry.shapes import Box
from cellplan.model.robot.robot import RobotModel
from cellplan.model.seeds import generator
from cellplan.planning.start.home_candidates import displacements, home_candidates
from cellplan.scene.kinematics.screw_chain import ScrewChain

START = np.array([0.3, -0.4, 0.6, 0.2, 0.7, 2.95])


def candidates(model: RobotModel, start: np.ndarray) -> np.ndarray:
    return home_candidates(model, ScrewChain(placed("arm", model, tool=stick())), start, generator("arm"))


def test_the_start_comes_first_and_the_others_by_the_time_to_go_there() -> None:
    model = arm_model()
    q = candidates(model, START)

    assert np.array_equal(q[0], START)
    assert np.all(np.diff(displacements(model, START, q)) >= -1e-9)
    assert np.all((q >= model.lower) & (q <= model.upper))
    assert np.array_equal(candidates(model, START), q)


def test_a_displacement_is_the_time_of_the_slowest_joint() -> None:
    model = arm_model()
    quick = replace(model, joints=(replace(model.joints[0], velocity=10.0), *model.joints[1:]))
    q = START + np.array([[1.0, 0.4, 0.0, 0.0, 0.0, 0.0], [1.0, 0.6, 0.0, 0.0, 0.0, 0.0]])

    assert displacements(quick, START, q) == pytest.approx([0.1, 0.12])


def test_the_tool_is_drawn_back_against_its_axis() -> None:
    model = arm_model()
    chain = ScrewChain(placed("arm", model, tool=stick()))
    tip, axis = chain.tool_poses(START[None])[0, :3, 3], chain.tool_poses(START[None])[0, :3, 2]

    shifts = chain.tool_poses(candidates(model, START))[:, :3, 3] - tip

    assert min(np.linalg.norm(shifts + 0.1 * axis, axis=1)) < 1e-3  # one of the retreats is by 100 mm


def test_an_endless_joint_starts_on_whatever_turn_it_is() -> None:
    model = arm_model()
    endless = replace(model.joints[5], lower=-np.inf, upper=np.inf)
    model = replace(model, joints=(*model.joints[:5], endless))
    start = np.array([*START[:5], 30.0])

    q = candidates(model, start)

    assert np.array_equal(q[0], start)
    assert np.all(np.abs(q[:, 5] - 30.0) <= np.pi + 1e-12)


def test_a_single_sliding_joint_has_candidates_on_either_side() -> None:
    q = candidates(slide_model(Box((0.1, 0.1, 0.1))), np.zeros(1))

    assert q.min() < -1.0
    assert q.max() > 1.0
