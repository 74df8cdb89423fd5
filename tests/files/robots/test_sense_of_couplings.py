"""Couplings of neighbouring axes: the sign follows from the axes, and the shown angle is that of the forearm."""

from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import placed

from cellplan.errors import InputError
from cellplan.files.robots.build_controller import with_zero_of_file
from cellplan.files.robots.joint_table import read_robot_table
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

ARM = """\
robot: arm
source: test
joints:
  J1: {{type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 200], lower_deg: -170, upper_deg: 170, velocity_deg_s: 90}}
  J2: {{type: revolute, axis: [0, 1, 0], point_mm: [0, 0, 450], lower_deg: -90, upper_deg: 120, velocity_deg_s: 90}}
  J3: {{type: revolute, axis: [0, {sense}, 0], point_mm: [0, 0, 1000], lower_deg: -9, upper_deg: 9, velocity_deg_s: 90}}
  J4: {{type: revolute, axis: [1, 0, 0], point_mm: [0, 0, 1050], lower_deg: -180, upper_deg: 180, velocity_deg_s: 90}}
flange: {{xyz_mm: [500, 0, 1050], rpy_deg: [0, 90, 0]}}
"""


def arm(folder: Path, sense: int, more: str = "") -> RobotModel:
    path = folder / "arm.yaml"
    path.write_text(ARM.format(sense=sense) + more)
    return read_robot_table(path)


def zero(folder: Path, text: str) -> Path:
    path = folder / "zero.yaml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("sense", "signs", "factor"),
    [
        (1, "", 1),
        (-1, "", -1),
        (1, "sign: {J3: -1}", -1),
        (-1, "sign: {J2: -1}", 1),
        (-1, "sign: {J2: -1, J3: -1}", -1),
    ],
)
def test_the_shown_angle_is_that_of_the_forearm_to_the_level(
    tmp_path: Path, sense: int, signs: str, factor: int
) -> None:
    """By forward kinematics: while axis 2 and 3 turn so that the forearm keeps its pitch, the shown angle stays."""
    text = f"coupling: {{J3: {{J2: {factor}}}}}\n{signs}\n"

    model, _ = with_zero_of_file(arm(tmp_path, sense), zero(tmp_path, text), file="zero.yaml")

    assert model.controller is not None
    q = np.random.default_rng(5).uniform(-1.0, 1.0, (20, 4))
    forearm = ScrewChain(placed("arm", model)).link_displacements(q)[:, 3, :3, 0]
    pitch = np.arctan2(-forearm[:, 2], np.hypot(forearm[:, 0], forearm[:, 1]))
    shown = model.controller.from_model(q)[:, 2]
    near = np.abs(q[:, 1] + sense * q[:, 2]) < 1.5  # where the forearm points forward
    assert near.sum() > 5
    assert np.allclose(np.abs(shown[near]), np.abs(pitch[near]), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("sense", "signs", "factor", "turn"),
    [
        (1, "", -1, "the same way"),
        (-1, "", 1, "against each other"),
        (-1, "sign: {J3: -1}", -1, "the same way"),
    ],
)
def test_the_other_sign_is_refused(tmp_path: Path, sense: int, signs: str, factor: int, turn: str) -> None:
    path = zero(tmp_path, f"coupling: {{J3: {{J2: {factor}}}}}\n{signs}\n")

    with pytest.raises(InputError) as refusal:
        with_zero_of_file(arm(tmp_path, sense), path, file="zero.yaml")

    assert str(refusal.value) == (
        f"zero.yaml:1: coupling.J3.J2: expected {-factor}, with which the angle of 'J3' is shown against the level, as "
        f"'J2' and 'J3' turn {turn} on the controller, got {factor}"
    )


def test_a_joint_axis_table_is_judged_too(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"arm\.yaml:9: controller\.coupling\.J3\.J2: expected -1, "):
        arm(tmp_path, -1, "controller: {coupling: {J3: {J2: 1}}}\n")


@pytest.mark.parametrize("text", ["coupling: {J3: {J2: 0.5}}", "coupling: {J4: {J3: 1}}", "coupling: {J4: {J2: -1}}"])
def test_other_couplings_are_taken_as_they_are_stated(tmp_path: Path, text: str) -> None:
    model, _ = with_zero_of_file(arm(tmp_path, 1), zero(tmp_path, text), file="zero.yaml")

    assert model.controller is not None
    assert np.any(model.controller.coupling)


def test_limits_of_the_shown_angle_are_read(tmp_path: Path) -> None:
    text = "coupling: {J3: {J2: 1}}\nlimits_deg: {J3: [-80, 60]}\n"

    model, _ = with_zero_of_file(arm(tmp_path, 1), zero(tmp_path, text), file="zero.yaml")

    assert model.controller is not None
    assert model.controller.limits is not None
    assert np.allclose(np.degrees(model.controller.limits[2]), [-80.0, 60.0])
    assert np.all(np.isinf(model.controller.limits[[0, 1, 3]]))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("limits_deg: {J3: [60, -80]}", "zero.yaml:1: limits_deg.J3: expected a lower limit below the upper one"),
        ("limits_deg: {J9: [-80, 60]}", "zero.yaml:1: limits_deg.J9: expected a revolute joint of the robot"),
    ],
)
def test_limits_that_cannot_be_are_refused(tmp_path: Path, text: str, reason: str) -> None:
    with pytest.raises(InputError) as refusal:
        with_zero_of_file(arm(tmp_path, 1), zero(tmp_path, f"{text}\n"), file="zero.yaml")

    assert str(refusal.value).startswith(reason)
