"""Joint positions and speeds against motions with known extremes."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, placed

from cellplan.checks.joints.limits import check_joints, check_shown
from cellplan.measures.joint_use import joint_uses
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.controller import ControllerZero
from cellplan.model.robot.robot import BASE, Joint, JointKind, RobotModel


def one_joint_robot(**changes):
    facts = {
        "name": "B2",
        "kind": JointKind.REVOLUTE,
        "parent": BASE,
        "axis_B": np.array([0.0, 0, 1]),
        "point_B": np.zeros(3),
        "lower": np.radians(-155.0),
        "upper": np.radians(35.0),
        "velocity": np.radians(156.0),
    }
    joint = Joint(**(facts | changes))
    model = RobotModel(name="m", source="s", joints=(joint,), flange_link=0, X_BF=np.eye(4), bodies=())
    return Robot(
        name="kuka", model=model, X_WB=np.eye(4), tool=Tool(X_FT=np.eye(4), bodies=()), start=None, weights=np.ones(1)
    )


TIMES = np.linspace(0.0, 2.0, 2001)


def report(robot, positions):
    q = positions[:, None]
    uses = joint_uses(robot, TIMES, q)
    return uses[0], {check.name: check for check in check_joints(uses, TIMES, q)}


def test_margin_speed_and_instants_of_a_sine():
    use, checks = report(one_joint_robot(), np.radians(-60 + 50 * np.sin(np.pi * TIMES)))
    assert np.degrees([use.min, use.max]) == pytest.approx([-110.0, -10.0], abs=1e-9)
    assert np.degrees(use.margin) == pytest.approx(45.0, abs=1e-9)  # nearest at -110, 45 above -155, and at -10
    assert use.margin_at_s == pytest.approx(0.5, abs=1e-9) or use.margin_at_s == pytest.approx(1.5, abs=1e-9)
    assert np.degrees(use.peak_velocity) == pytest.approx(50 * np.pi, rel=1e-5)  # chord of 1 ms against the tangent
    assert np.degrees(use.travel) == pytest.approx(200.0, rel=1e-6)
    assert checks["joint_position"].passed
    assert not checks["joint_velocity"].passed  # 157.08 deg/s against 156


def test_violation_is_named_with_instant_and_amount():
    _, checks = report(one_joint_robot(), np.radians(73.0 * np.sin(0.5 * np.pi * TIMES) ** 2))
    check = checks["joint_position"]
    assert not check.passed
    assert check.value == pytest.approx(73.0)
    assert check.limit == pytest.approx(35.0)
    assert check.message == (
        "joint kuka/B2 is 38 deg beyond its upper limit 35 deg (reaches 73.0000 deg; outside from 0.487 s), "
        "worst at 1.000 s"
    )


def test_lower_limit_is_named_as_lower():
    _, checks = report(one_joint_robot(), np.radians(-160.0 * np.sin(0.5 * np.pi * TIMES)))
    assert "5 deg below its lower limit -155 deg" in checks["joint_position"].message


def test_exactly_on_the_limit_passes():
    _, checks = report(one_joint_robot(), np.full(len(TIMES), np.radians(35.0)))
    assert checks["joint_position"].passed
    assert checks["joint_position"].value == pytest.approx(35.0)


def test_sliding_joints_speak_millimetres():
    robot = one_joint_robot(kind=JointKind.PRISMATIC, lower=0.0, upper=1.0, velocity=0.5)
    use, checks = report(robot, 0.6 * TIMES)
    assert use.margin == pytest.approx(-0.2)
    assert checks["joint_position"].unit == "mm"
    assert "is 200 mm beyond its upper limit 1000 mm" in checks["joint_position"].message
    assert checks["joint_velocity"].value == pytest.approx(600.0)


def test_endless_joint_has_no_position_limit():
    use, checks = report(one_joint_robot(lower=-np.inf, upper=np.inf), 10.0 * TIMES)
    assert checks["joint_position"].passed
    assert use.margin == np.inf


def coupled(robot: Robot, limits: tuple[float, float]) -> Robot:
    """The robot whose controller shows the third joint plus the second, within limits in [deg]."""
    n = len(robot.model.joints)
    coupling, stated = np.zeros((n, n)), np.full((n, 2), (-np.inf, np.inf))
    coupling[2, 1], stated[2] = 1.0, np.deg2rad(limits)
    counting = ControllerZero(zero=np.zeros(n), sign=np.ones(n), coupling=coupling, source="test", limits=stated)
    return replace(robot, model=replace(robot.model, controller=counting))


@pytest.mark.parametrize(("upper", "passed"), [(50.0, True), (49.0, False)])
def test_a_limit_of_a_coupled_angle_is_checked(upper: float, passed: bool) -> None:
    """Joints 2 and 3 pass 20 and 30 deg, each within its own limits: shown are 50 deg."""
    robot = coupled(placed("a", arm_model()), (-90.0, upper))
    times, q = np.array([0.0, 1.0, 2.0]), np.zeros((3, len(robot.model.joints)))
    q[1, 1:3] = np.deg2rad([20.0, 30.0])

    (check,) = check_shown(robot, times, q)

    name = robot.model.joints[2].name
    assert (check.name, check.subject, check.passed) == ("controller_position", f"a/{name}", passed)
    assert (check.at_s, check.unit) == (1.0, "deg")
    assert check.value == pytest.approx(50.0)
    if not passed:
        assert "as the controller shows it is 1 deg beyond its limit 49 deg" in check.message


def test_without_stated_limits_nothing_shown_is_checked() -> None:
    robot = placed("a", arm_model())

    assert check_shown(robot, np.array([0.0, 1.0]), np.zeros((2, len(robot.model.joints)))) == []
