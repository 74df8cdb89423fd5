"""What robots carry against what they may carry: closed forms on one joint, and what is said of what is not stated."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import (
    QUARTER,
    arm_model,
    fixed_part,
    held_part,
    joint,
    make_cell,
    no_tool,
    placed,
    slide_model,
)

from cellplan.checks.joints.payload import check_payload, check_payload_at_rest, load_uses, point_accelerations
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Grasp, Robot, Tool
from cellplan.model.robot.payload import LoadUse
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.robot import AxisLimitEntry, PayloadEntry
from cellplan.report.record.sections.payload import unjudged_loads
from cellplan.scene.dynamics.loads import GRAVITY
from cellplan.scene.kinematics.screw_chain import ScrewChain

TIMES = np.linspace(0.0, 1.0, 1001)
STILL = np.zeros((1001, 1))
SIX_KG = PayloadEntry(mass_kg=6.0, source="test")


def arm(*, axis=(0.0, 1.0, 0.0), payload: PayloadEntry | None = SIX_KG) -> RobotModel:
    """One turning joint at the origin; the flange 0.5 m along x, its z along x."""
    return RobotModel(
        name="one",
        source="test",
        joints=(joint("a", -1, axis=axis),),
        flange_link=0,
        X_BF=pose((0.5, 0.0, 0.0), (0.0, QUARTER, 0.0)),
        bodies=(),
        payload=payload,
    )


def tool(mass: float | None, *, reach: float = 0.1, centre=None) -> Tool:
    return Tool(X_FT=pose((0.0, 0.0, reach)), bodies=(), mass=mass, centre=centre)


def use_of(cell: Cell, q=STILL, name: str = "a") -> LoadUse:
    still = {robot.name: np.zeros((len(q), len(robot.model.joints))) for robot in cell.robots}
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    return next(use for use in load_uses(cell, chains, TIMES, still | {name: q}) if use.robot == name)


def robot(model: RobotModel | None = None, *, with_tool: Tool | None = None, name: str = "a") -> Robot:
    return placed(name, model or arm(), tool=with_tool or no_tool())


def test_the_static_moment_is_weight_times_arm() -> None:
    use = use_of(make_cell(robot(with_tool=tool(2.0))))

    assert use.known_mass == 2.0
    assert use.axes[0].static_moment == pytest.approx(2.0 * GRAVITY * 0.6)
    assert use.axes[0].moment == pytest.approx(2.0 * GRAVITY * 0.6)
    assert use.axes[0].inertia == pytest.approx(2.0 * 0.6**2)
    assert use.felt == pytest.approx(2.0)


def test_a_stated_centre_of_the_tool_goes_before_its_tip() -> None:
    use = use_of(make_cell(robot(with_tool=tool(2.0, centre=np.array([0.0, 0.03, 0.04])))))

    assert (use.along, use.across) == pytest.approx((0.04, 0.03))
    assert use.axes[0].static_moment == pytest.approx(2.0 * GRAVITY * 0.54)


def test_an_upright_axis_feels_no_weight_but_the_acceleration_of_the_written_motion() -> None:
    q = 0.2 * np.sin(2.0 * np.pi * TIMES)[:, None] * np.sin(np.pi * TIMES)[:, None] ** 2

    use = use_of(make_cell(robot(arm(axis=(0.0, 0.0, 1.0)), with_tool=tool(2.0))), q)

    largest = np.abs(np.gradient(np.gradient(q[:, 0], TIMES), TIMES)).max()
    assert use.axes[0].static_moment == pytest.approx(0.0, abs=1e-12)
    assert use.axes[0].moment == pytest.approx(2.0 * 0.6**2 * largest, rel=1e-3)
    assert use.felt is not None
    assert use.felt > 2.0


def test_second_differences_take_the_motion_to_be_at_rest_before_and_after() -> None:
    points = 3.0 * TIMES[:, None] * np.array([1.0, 0.0, 0.0])  # starts and ends with a jump

    accelerations = point_accelerations(TIMES, points)

    assert accelerations[0, 0] == pytest.approx(3.0 / 0.001)
    assert accelerations[-1, 0] == pytest.approx(-3.0 / 0.001)
    np.testing.assert_allclose(accelerations[1:-1], 0.0, atol=1e-6)


def test_the_part_weighs_at_its_centre_with_the_inertia_of_its_shape() -> None:
    part = replace(held_part(Cylinder(0.2, 0.3), "a", np.eye(4)), mass=3.0)

    use = use_of(make_cell(robot(), part=part))

    assert use.known_mass == 3.0
    assert use.axes[0].static_moment == pytest.approx(3.0 * GRAVITY * 0.5)
    assert use.axes[0].inertia == pytest.approx(3.0 * (0.5**2 + 0.2**2 / 4.0 + 0.3**2 / 12.0))


def test_the_load_at_rest_is_judged_without_a_motion() -> None:
    limits = SIX_KG.changed(axes={"a": AxisLimitEntry(moment_nm=11.0)})
    cell = make_cell(robot(arm(payload=limits), with_tool=tool(2.0)))
    chains = {"a": ScrewChain(cell.robot("a"))}

    level, hanging = (check_payload_at_rest(cell, chains, np.array([angle])) for angle in (0.0, QUARTER))

    assert [check.passed for check in level] == [True, False]
    assert [check.passed for check in hanging] == [True, True]


def test_holders_share_the_part_equally() -> None:
    grasps = (Grasp(robot="a", X_PT=np.eye(4)), Grasp(robot="b", X_PT=np.eye(4)))
    part = replace(held_part(Box((0.1, 0.1, 0.1)), "a", np.eye(4)), held_by=grasps, mass=10.0)

    cell = make_cell(robot(), robot(name="b"), part=part)

    assert [use_of(cell, name=name).part_mass for name in ("a", "b")] == [5.0, 5.0]


@pytest.mark.parametrize(("mass", "passed"), [(6.0, True), (6.001, False)])
def test_the_mass_is_held_against_the_payload(mass: float, passed: bool) -> None:
    checks = check_payload((use_of(make_cell(robot(with_tool=tool(mass)))),))

    assert [(check.name, check.passed) for check in checks] == [("payload", passed)]
    assert checks[0].message == f"payload a: carries {mass:.4g} kg (tool {mass:.4g} kg), allowed 6 kg"


@pytest.mark.parametrize(("moment", "inertia"), [(11.0, 0.7), (13.0, 0.75)])
def test_moments_and_inertias_are_held_against_what_is_published(moment: float, inertia: float) -> None:
    limits = SIX_KG.changed(
        axes={"a": AxisLimitEntry(moment_nm=moment, inertia_kg_m2=inertia)}, along_mm=50.0, across_mm=10.0
    )

    checks = check_payload((use_of(make_cell(robot(arm(payload=limits), with_tool=tool(2.0)))),))

    passed = {check.name: check.passed for check in checks}
    wide = moment > 2.0 * GRAVITY * 0.6
    assert passed == {"payload": True, "payload_centre": True, "payload_moment": wide, "payload_inertia": wide}
    centres = [(check.subject, check.passed) for check in checks if check.name == "payload_centre"]
    assert centres == [("a along", False), ("a across", True)]


def test_a_tool_that_is_too_heavy_alone_fails_whatever_the_part_weighs() -> None:
    part = held_part(Sphere(0.1), "a", np.eye(4))

    heavy, light = (check_payload((use_of(make_cell(robot(with_tool=tool(mass)), part=part)),)) for mass in (7.0, 5.0))

    assert [check.passed for check in heavy] == [False]
    assert light == []


def test_what_is_not_stated_is_one_line() -> None:
    part = held_part(Sphere(0.1), "a", np.eye(4))
    cell = make_cell(robot(arm(payload=None)), robot(with_tool=tool(None), name="b"), part=part)

    lines = unjudged_loads([use_of(cell), use_of(cell, name="b")])

    assert lines == [
        "payload not judged: mass of the part not stated (a); rated load of the robot not stated (a); "
        "mass of the tool not stated (b)"
    ]


def test_a_robot_that_carries_nothing_is_not_spoken_of() -> None:
    cell = make_cell(robot(arm(payload=None)), part=fixed_part(Sphere(0.1), pose((5.0, 0.0, 0.0))))

    assert unjudged_loads([use_of(cell)]) == []


def test_a_payload_of_mass_alone_is_said_to_be_one() -> None:
    assert unjudged_loads([use_of(make_cell(robot(with_tool=tool(2.0))))]) == [
        "payload judged by mass alone (a): distances and wrist moments not stated"
    ]


def test_the_last_three_turning_axes_are_looked_at_and_no_sliding_one() -> None:
    six, rail = robot(arm_model(), with_tool=tool(1.0)), robot(slide_model(Sphere(0.1)), with_tool=tool(1.0), name="b")
    cell = make_cell(six, rail)

    assert [axis.joint for axis in use_of(cell, np.zeros((1001, 6))).axes] == ["a4", "a5", "a6"]
    assert use_of(cell, name="b").axes == ()
