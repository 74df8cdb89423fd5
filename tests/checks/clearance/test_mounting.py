"""How deep is too deep: grips, bases and fixed parts on both sides of the line."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, fixed_part, floor, held_part, make_cell, placed, stick, thing

from cellplan.checks.clearance.mounting import check_mounting
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Cylinder, HalfSpace, Shape
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_exp
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check
from cellplan.model.settings.checks import ChecksEntry, ExclusionEntry
from cellplan.scene.scene import Scene

AT_REST = np.zeros((1, 6))


def judged(cell: Cell, q: Array = AT_REST) -> tuple[Check, ...]:
    return check_mounting(Scene.from_cell(cell), q)


def gripping(deep: float, **changes) -> Cell:
    """The hand reaches by so much into a plate."""
    part = held_part(Box((0.3, 0.3, 0.04)), "a", pose((0.0, 0.0, -0.02 + deep)))
    part = replace(part, held_by=tuple(replace(grasp, **changes) for grasp in part.held_by))
    return make_cell(placed("a", arm_model()), part=part)


@pytest.mark.parametrize(("depth", "passed"), [(0.0, True), (0.001, True), (0.002, True), (0.003, False)])
def test_a_grip_is_as_deep_as_it_is_said_to_be_and_no_more_than_allowed(depth: float, passed: bool) -> None:
    (check,) = judged(gripping(depth))

    assert (check.name, check.subject, check.passed) == ("grip_depth", "a/hand - part", passed)
    assert check.value == pytest.approx(1e3 * depth, abs=0.011)
    held = f"is {1e3 * depth:.4g} mm deep in part" if depth else "does not reach into part"
    assert check.message.startswith(f"a/hand {held}, allowed 2 mm")
    assert ("is the grasp the right way round?" in check.message) is not passed


def test_a_deeper_grip_passes_when_the_grasp_says_so() -> None:
    (check,) = judged(gripping(0.003, depth=0.004))

    assert check.passed
    assert check.limit == 4.0


def standing(shape: Shape, X_WS: Array, **changes) -> tuple[Check, ...]:
    return judged(make_cell(placed("a", arm_model()), things=(thing("it", shape, X_WS),), **changes))


@pytest.mark.parametrize(
    ("shape", "X_WS", "deep"),
    [
        (HalfSpace(), pose((0.0, 0.0, 0.0)), 0.0),
        (HalfSpace(), pose((0.0, 0.0, 0.004)), 4.0),
        (HalfSpace(), pose((0.0, 0.0, 0.11)), 110.0),
        (Box((1.0, 1.0, 0.5)), pose((0.0, 0.0, -0.25)), 0.0),
        (Box((1.0, 1.0, 0.5)), pose((0.0, 0.0, -0.24)), 10.0),
        (Box((1.0, 1.0, 0.5)), pose((0.0, 0.0, 0.45)), 0.0),  # hung from a ceiling that is above its foot
        (Box((3.0, 0.02, 1.5)), pose((0.0, 0.1, 0.75)), 60.0),  # a fence through the foot
        (Cylinder(0.1, 2.0), pose((0.135, 0.0, 0.0)), 115.0),  # a column that reaches into it
        (tessellate(Box((4.0, 4.0, 4.0))), pose((0.0, 0.0, 0.1)), 2100.0),  # a mesh all round it, and no contact
    ],
)
def test_a_base_may_stand_on_things_but_not_in_them(shape: Shape, X_WS: Array, deep: float) -> None:
    (check,) = standing(shape, X_WS)

    assert (check.name, check.limit) == ("standing_depth", 5.0)
    assert check.subject == ("a/foot - it" if deep else "cell")
    assert check.value == pytest.approx(deep, rel=2e-3, abs=0.011)
    assert check.passed == (check.value <= 5.0)


def test_the_message_says_how_deep_and_asks_for_the_pit() -> None:
    (check,) = standing(HalfSpace(), pose((0.0, 0.0, 0.11)))

    assert check.message.startswith("a/foot is 110 mm deep in it, allowed 5 mm: is there a pit?")


def test_the_limit_of_what_stands_is_the_cells() -> None:
    settings = ChecksEntry(standing_depth_mm=200.0)

    assert standing(HalfSpace(), pose((0.0, 0.0, 0.11)), checks=settings)[0].passed


def test_what_the_user_leaves_out_is_not_judged() -> None:
    pit = ExclusionEntry(bodies=("a/foot", "it"), reason="a pit")
    settings = ChecksEntry(exclude=(pit,))

    (check,) = standing(HalfSpace(), pose((0.0, 0.0, 0.11)), checks=settings)

    assert (check.passed, check.subject) == (True, "cell")


@pytest.mark.parametrize(("height", "passed"), [(0.1, True), (0.096, True), (0.08, False)])
def test_a_fixed_part_may_lie_on_a_table_but_not_in_it(height: float, passed: bool) -> None:
    part = fixed_part(Box((0.2, 0.2, 0.2)), pose((1.5, 0.0, 0.6 + height)))
    table = thing("table", Box((0.6, 0.6, 0.6)), pose((1.5, 0.0, 0.3)))

    (check,) = judged(make_cell(placed("a", arm_model()), part=part, things=(table,)))

    assert check.passed is passed
    if not passed:
        assert check.message.startswith("part is 20 mm deep in table, allowed 5 mm")


def test_all_that_stands_passes_in_one_check() -> None:
    arms = placed("a", arm_model()), placed("b", arm_model(), base=pose((3.0, 0.0, -0.003)))

    (check,) = judged(make_cell(*arms, things=(floor(),)), np.zeros((1, 12)))

    assert check.message == "b/foot is 3 mm deep in floor, allowed 5 mm"


def test_a_first_link_without_a_foot_is_judged_over_the_whole_motion() -> None:
    model = arm_model()
    bodies = tuple(
        replace(body, X_BS=pose((0.0, 0.0, 0.07), (0.0, 0.1, 0.0))) if body.name == "column" else body
        for body in model.bodies[1:]
    )
    cell = make_cell(placed("a", replace(model, bodies=bodies)), things=(thing("ramp", HalfSpace(), ramp(0.05)),))
    q = np.zeros((5, 6))
    q[:, 0] = np.linspace(0.0, 3.0, 5)

    (check,) = check_mounting(Scene.from_cell(cell), q, np.linspace(0.0, 1.0, 5))
    (start,) = check_mounting(Scene.from_cell(cell), q[:1], np.zeros(1))

    assert check.value > start.value + 1.0
    assert check.at_s is not None


def ramp(angle: float) -> Array:
    return pose_from(rotation_exp(np.array([0.0, angle, 0.0])), np.zeros(3))


@pytest.mark.parametrize(("ahead", "passed"), [(0.0, True), (0.001, True), (0.004, False)])
def test_a_tool_on_a_flange_without_a_body_may_touch_the_link_behind(ahead: float, passed: bool) -> None:
    model = arm_model()
    bodies = tuple(
        replace(body, shape=Box((0.2, 0.08, 0.08)), X_BS=pose((0.6 + ahead, 0.0, 1.0)))
        if body.name == "wrist"
        else body
        for body in model.bodies
        if body.name != "hand"
    )

    (check,) = judged(make_cell(placed("a", replace(model, bodies=bodies), tool=stick())))

    assert (check.name, check.subject, check.passed) == ("mount_depth", "a/tool - a/wrist", passed)
    assert check.value == pytest.approx(1e3 * ahead, abs=0.011)
