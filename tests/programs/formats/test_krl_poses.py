"""Poses of KRL: status and turn of an arm, as its controller counts them."""

from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import closed_form, tip, wide

from cellplan.model.cell.cell import Robot
from cellplan.model.robot.controller import ControllerZero
from cellplan.programs.formats.krl.poses import status_and_turn

SIGNS = [(shoulder, elbow, wrist) for shoulder in (1, -1) for elbow in (1, -1) for wrist in (1, -1)]


def kuka(*, sign: float = 1.0) -> Robot:
    """The elbow arm counted from the zero of KUKA, stretched forward; axis 3 of the model may turn the other way."""
    robot = wide("arm")
    signs = np.array([1.0, 1.0, sign, 1.0, 1.0, 1.0])
    zero = np.deg2rad([0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
    controller = ControllerZero(zero=zero, sign=signs, coupling=np.zeros((6, 6)), source="test")
    joints = tuple(replace(joint, axis_B=s * joint.axis_B) for joint, s in zip(robot.model.joints, signs, strict=True))
    return replace(robot, model=replace(robot.model, joints=joints, controller=controller))


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ((0, -90, 90, 0, 45, 0), (0b010, 0b000010)),  # the home of most arms: upright, forearm forward
        ((0, -90, 90, 0, -45, 0), (0b110, 0b010010)),
        ((-10, -90, 90, -100, 45, -350), (0b010, 0b101011)),
        ((0, -90, -90, 0, 45, 0), (0b001, 0b000110)),  # forearm to the back: behind axis 1, the elbow the other way
        ((0, -40, -20, 0, 45, 0), (0b000, 0b000110)),  # stretched forward, bent upwards
        ((0, -170, 120, 0, 45, 0), (0b011, 0b000010)),  # the whole arm over the head
        ((0, -80, 1e-5, 0, 45, 0), (0b010, 0b000010)),  # to both sides of the line through axes 2 and 3
        ((0, -80, -1e-5, 0, 45, 0), (0b000, 0b000110)),
    ],
)
def test_status_and_turn_of_an_arm(axes: tuple[float, ...], expected: tuple[int, int]) -> None:
    for robot in (kuka(), kuka(sign=-1.0)):
        zero = robot.model.controller
        assert zero is not None
        assert tuple(status_and_turn(robot, zero.to_model(np.deg2rad([axes])))[0]) == expected


def test_the_eight_ways_to_a_pose_have_eight_numbers() -> None:
    robot = kuka()
    target = tip(robot, np.array([0.4, 0.3, 0.5, 0.7, 0.9, -0.4]))

    status = status_and_turn(robot, np.array([closed_form(robot, target, *sign) for sign in SIGNS]))[:, 0]

    assert sorted(status.tolist()) == list(range(8))
    for number, (shoulder, _, wrist) in zip(status.tolist(), SIGNS, strict=True):
        assert bool(number & 0b001) is (shoulder < 0)
        assert bool(number & 0b100) is (wrist < 0)
