"""Configuration of FANUC arms: letters and turns, as their controllers count them."""

from dataclasses import replace

import numpy as np
import pytest
from builders.elbow_arm import closed_form, tip, wide

from cellplan.model.cell.cell import Robot
from cellplan.model.robot.controller import ControllerZero
from cellplan.programs.formats.fanuc_ls.poses import configuration, configuration_text, read_configuration

SIGNS = [(shoulder, elbow, wrist) for shoulder in (1, -1) for elbow in (1, -1) for wrist in (1, -1)]


def fanuc() -> Robot:
    """The elbow arm counted as by FANUC: axes 3 and 5 grow upwards, axis 3 against the ground."""
    robot, coupling = wide("arm"), np.zeros((6, 6))
    coupling[2, 1] = -1.0
    sign = np.array([1.0, 1.0, -1.0, -1.0, -1.0, -1.0])
    controller = ControllerZero(zero=np.zeros(6), sign=sign, coupling=coupling, source="test")
    return replace(robot, model=replace(robot.model, controller=controller))


@pytest.mark.parametrize(
    ("axes", "expected"),
    [
        ((0, 0, 0, 0, -90, 0), "N U T, 0, 0, 0"),  # upright, forearm forward, tool down: the usual home
        ((0, 30, -30, 0, -60, 0), "N U T, 0, 0, 0"),
        ((0, 0, 0, 180, 90, -180), "F U T, 1, 0, 0"),  # the same pose of the tool
        ((0, 0, 0, -179.9, 90, -190), "F U T, 0, 0, -1"),
        ((0, 0, 180, 0, -90, 0), "N D B, 0, 0, 0"),  # forearm to the back: the elbow the other way
        ((0, 60, 60, 0, -45, 0), "N D T, 0, 0, 0"),  # leant forward, the forearm above the upper arm
        ((0, 60, -89, 0, -45, 0), "N U T, 0, 0, 0"),
        ((0, -60, 80, 0, -45, 0), "N U B, 0, 0, 0"),  # leant back, the wrist behind axis 1
        ((0, 20, 0, 0, 0, 400), "N U T, 0, 0, 1"),
    ],
)
def test_the_configuration_of_an_arm(axes: tuple[float, ...], expected: str) -> None:
    robot = fanuc()
    zero = robot.model.controller
    assert zero is not None

    (row,) = configuration(robot, zero.to_model(np.deg2rad([axes])))

    assert configuration_text(row) == expected
    assert read_configuration(expected) == row.tolist()


def test_the_eight_ways_to_a_pose_have_eight_configurations() -> None:
    robot = fanuc()
    target = tip(robot, np.array([0.4, 0.3, 0.5, 0.7, 0.9, -0.4]))

    rows = configuration(robot, np.array([closed_form(robot, target, *sign) for sign in SIGNS]))

    assert len({tuple(row[:3]) for row in rows.tolist()}) == 8
    for row, (shoulder, _, wrist) in zip(rows.tolist(), SIGNS, strict=True):
        assert row[2] == (shoulder < 0)
        assert row[0] == (wrist < 0)  # the model bends the tool down where its axis 5 is positive
