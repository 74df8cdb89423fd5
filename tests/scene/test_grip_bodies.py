"""A grasp may name the bodies that grip: nothing else of the holder may touch the part; grippers may work as tools."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import (
    arm_model,
    body,
    fixed_part,
    held_part,
    make_cell,
    placed,
    schedule,
    stick,
    thing,
    work,
)

from cellplan.checks.clearance.check import check_clearance
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.errors import InputError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.measures.tool_depth import tool_depths
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

FINGERS = ("a/left", "a/right")
GRIP_HEIGHT = 0.05  # [m] of the tip of the fingers above the hand, which ends at the flange


def gripper_model() -> RobotModel:
    """The elbow arm with two fingers, 40 mm apart, that reach 50 mm out of its hand along the x of the base."""
    fingers = [
        body(name, 5, shape=Box((GRIP_HEIGHT, 0.02, 0.02)), at=(0.7 + 0.5 * GRIP_HEIGHT, y, 1.0))
        for name, y in (("left", 0.03), ("right", -0.03))
    ]
    model = arm_model()
    return replace(model, bodies=(*model.bodies, *fingers))


def gripping(*, off: float = 0.03, deep: float = 0.0, bodies: tuple[str, ...] | None = FINGERS, **changes) -> Cell:
    """A bar between the fingers: ``off`` from the hand, each finger ``deep`` in it; the flange is its tool tip."""
    part = held_part(Box((0.04 + 2.0 * deep, 0.04 + 2.0 * deep, 0.1)), "a", pose((0.0, 0.0, -0.05 - off)))
    part = replace(part, held_by=tuple(replace(grasp, bodies=bodies) for grasp in part.held_by))
    return make_cell(placed("a", gripper_model()), part=part, **changes)


def pair_of(scene: Scene, first: str, second: str) -> ScenePair:
    (pair,) = (pair for pair in scene.pairs if set(scene.names(pair)) == {first, second})
    return pair


def refusal(cell: Cell) -> str:
    with pytest.raises(InputError) as caught:
        Scene.from_cell(cell)
    return str(caught.value)


def moving(scene: Scene) -> np.ndarray:
    """Two rows between which every joint turns a little."""
    return np.array([np.zeros(6), np.full(6, 0.02)])


def test_named_bodies_grip_and_all_others_keep_the_clearance() -> None:
    scene = Scene.from_cell(gripping())

    assert [scene.bodies[pair.first].name for pair in scene.mounted] == list(FINGERS)
    hand = pair_of(scene, "a/hand", "part")
    assert (hand.rule, hand.demand, hand.solids is None) == (Rule.CLEARANCE, 0.005, False)
    gripped = {pair.bodies for pair in scene.left_out if pair.kind is LeftOutKind.GRIP}
    assert gripped == {("a/left", "part"), ("a/right", "part")}


def test_all_that_is_rigid_with_the_flange_grips_where_nothing_is_named() -> None:
    scene = Scene.from_cell(gripping(off=0.0, bodies=None))

    assert [scene.bodies[pair.first].name for pair in scene.mounted] == ["a/hand", *FINGERS]


@pytest.mark.parametrize("off", [-0.001, -0.02, -0.06])
def test_a_body_that_is_not_named_and_stands_in_the_part_is_refused(off: float) -> None:
    said = refusal(gripping(off=off))

    assert said.startswith(
        "<cell>: part.held_by[0].grip_bodies: expected a part clear of all bodies of 'a' that are not"
    )
    assert "touches a/hand" in said


def test_a_body_that_is_buried_in_the_part_is_refused() -> None:
    cell = gripping(bodies=("a/left",))
    inside = replace(cell.part, shape=tessellate(Box((0.2, 0.2, 0.2))), held_by=cell.part.held_by)
    inside = replace(inside, held_by=(replace(inside.held_by[0], X_PT=pose((0.0, 0.0, -0.02))),))

    said = refusal(replace(cell, part=inside))

    assert "a/right" in said


@pytest.mark.parametrize(("off", "passed"), [(0.0051, True), (0.0049, False)])
def test_a_body_that_is_not_named_keeps_the_distance_though_it_never_changes(off: float, passed: bool) -> None:
    scene = Scene.from_cell(gripping(off=off))

    report, checks = check_clearance(scene, schedule(2), moving(scene))

    assert report.minima[ClearanceClass.PART].minimum == pytest.approx(off, abs=1e-4)
    assert report.minima[ClearanceClass.PART].certified
    (clearance,) = (check for check in checks if (check.name, check.subject) == ("clearance", "part"))
    assert clearance.passed is passed


@pytest.mark.parametrize(("deep", "passed"), [(0.0, True), (0.0019, True), (0.0021, False), (0.015, False)])
def test_fingers_are_no_deeper_in_the_part_than_the_grasp_says(deep: float, passed: bool) -> None:
    checks = check_mounting(Scene.from_cell(gripping(deep=deep)), np.zeros((1, 6)))

    assert {check.subject: check.passed for check in checks} == dict.fromkeys(
        ("a/left - part", "a/right - part"), passed
    )
    assert checks[0].value == pytest.approx(1e3 * deep, abs=0.011)


@pytest.mark.parametrize(("apart", "ending"), [(0.0009, "allowed 2 mm"), (0.0085, "is the gripper open too far?")])
def test_fingers_that_do_not_reach_the_part_say_how_far_it_is(apart: float, ending: str) -> None:
    checks = check_mounting(Scene.from_cell(gripping(deep=-apart)), np.zeros((1, 6)))

    assert [check.passed for check in checks] == [True, True]
    assert all(check.message.endswith(ending) for check in checks)
    assert all(("8.5 mm away from part" in check.message) is (apart == 0.0085) for check in checks)


def test_what_a_further_holder_does_not_grip_with_keeps_the_clearance_too() -> None:
    cell = gripping()
    cell = replace(cell, checks=cell.checks.changed(contact_zone_mm=40.0))
    at_tips = replace(stick(), X_FT=pose((0.0, 0.0, 0.04)), bodies=())
    other = placed("b", gripper_model(), base=pose((3.0, 0.0, 0.0)), tool=at_tips)
    second = Grasp(robot="b", X_PT=pose((0.0, 0.0, -0.04)), bodies=("b/left", "b/right"))
    part = replace(cell.part, held_by=(*cell.part.held_by, second))

    scene = Scene.from_cell(replace(cell, robots=(*cell.robots, other), part=part))

    assert pair_of(scene, "b/hand", "part").rule is Rule.CLEARANCE
    assert pair_of(scene, "b/left", "part").rule is Rule.GRIP


def test_a_tool_that_is_not_named_keeps_out_of_the_part() -> None:
    cell = gripping(off=0.04)
    armed = replace(cell, robots=(replace(cell.robots[0], tool=replace(stick(0.045), X_FT=np.eye(4))),))

    assert "touches a/tool" in refusal(armed)


def disabled(*pairs: tuple[str, str]) -> Cell:
    """Two arms by a wall, one with a part, whose files disable pairs of links."""
    reason = "disabled in arm.srdf as 'Never'"
    model = replace(gripper_model(), disabled=tuple((*pair, reason) for pair in pairs))
    cell = gripping(things=(thing("wall", Box((0.1, 3.0, 2.0)), pose((-1.0, 0.0, 1.0))),))
    arms = (replace(cell.robots[0], model=model), placed("b", arm_model(), base=pose((3.0, 0.0, 0.0)), tool=stick()))
    return replace(cell, robots=arms)


def test_a_disabled_pair_is_left_out_and_listed_with_its_reason() -> None:
    plain, scene = Scene.from_cell(disabled()), Scene.from_cell(disabled(("foot", "forearm"), ("foot", "tube")))

    listed = [(pair.bodies, pair.reason) for pair in scene.left_out if pair.kind is LeftOutKind.SRDF]
    reason = "disabled in arm.srdf as 'Never'"
    assert listed == [(("a/foot", "a/forearm"), reason), (("a/foot", "a/tube"), reason)]
    assert {scene.names(pair) for pair in scene.pairs} == {plain.names(pair) for pair in plain.pairs} - {
        bodies for bodies, _ in listed
    }


def test_a_pair_that_is_joined_anyway_is_no_exclusion_of_the_file() -> None:
    scene = Scene.from_cell(disabled(("foot", "column")))

    assert not [pair for pair in scene.left_out if pair.kind is LeftOutKind.SRDF]
    assert ("a/column", "a/foot", "joined by joint a1") in {
        (*sorted(exclusion[:2]), exclusion[2]) for exclusion in scene.exclusions
    }


def test_disabled_links_are_watched_against_all_else() -> None:
    """Every pair of two links of the arm is disabled: part, tools, attachments, the other arm and the wall remain."""
    names = [body.name for body in gripper_model().bodies]
    plain = Scene.from_cell(disabled())
    scene = Scene.from_cell(disabled(*((one, other) for one in names for other in names if one < other)))

    links = {f"a/{name}" for name in names}
    lost = {plain.names(pair) for pair in plain.pairs} - {scene.names(pair) for pair in scene.pairs}
    assert lost
    assert all(set(pair) <= links for pair in lost)
    assert scene.mounted == plain.mounted


def working(*, gripper: tuple[str, ...], deep: float = 0.0) -> Cell:
    """The fingers work on a plate with their ends; the tool tip is between them."""
    arm = placed("a", gripper_model())
    tool = replace(arm.tool, X_FT=pose((0.0, 0.0, GRIP_HEIGHT)))
    plate = fixed_part(Box((0.02, 0.3, 0.3)), pose((0.7 + GRIP_HEIGHT + 0.01 - deep, 0.0, 1.0)))
    arm = replace(arm, tool=tool, gripper=gripper)
    cell = make_cell(arm, part=plate, tasks=(work("a"),))
    return replace(cell, checks=cell.checks.changed(contact_zone_mm=45.0))


def test_a_gripper_may_touch_what_it_works_on_near_the_tip_as_a_tool_may() -> None:
    scene = Scene.from_cell(working(gripper=("hand", "left", "right")))

    assert {pair.bodies: pair.kind for pair in scene.left_out if "part" in pair.bodies} == {
        ("a/left", "part"): LeftOutKind.AT_WORK,
        ("a/right", "part"): LeftOutKind.AT_WORK,
    }
    assert pair_of(scene, "a/left", "part").rule is Rule.PROCESS
    assert pair_of(scene, "a/hand", "part").rule is Rule.CLEARANCE  # outside the zone
    assert pair_of(scene, "a/tube", "part").rule is Rule.CLEARANCE


def test_a_link_on_the_flange_may_not_work_unless_the_cell_says_that_it_is_a_gripper() -> None:
    scene = Scene.from_cell(working(gripper=("right",)))

    assert pair_of(scene, "a/left", "part").rule is Rule.CLEARANCE
    assert pair_of(scene, "a/right", "part").rule is Rule.PROCESS


def test_an_arm_link_is_no_gripper_whatever_the_cell_says() -> None:
    scene = Scene.from_cell(working(gripper=("tube", "wrist")))

    assert {pair_of(scene, f"a/{name}", "part").rule for name in ("tube", "wrist", "left")} == {Rule.CLEARANCE}


@pytest.mark.parametrize("deep", [0.0005, 0.003, 0.012])
def test_how_deep_a_gripper_works_is_judged_like_a_tool(deep: float) -> None:
    cell = working(gripper=("left", "right"), deep=deep)
    scene = Scene.from_cell(cell)

    (depth,) = tool_depths(cell, schedule(2, work("a")), scene.chains, {"a": np.zeros((2, 6))})

    assert depth.depth == pytest.approx(deep, abs=1e-5)
    assert depth.body == "axis" or depth.body in {"left", "right"}


def test_the_depth_of_fingers_beside_the_axis_is_that_of_the_finger() -> None:
    """A hole where the axis goes: only the fingers stand in the part."""
    cell = working(gripper=("left", "right"))
    rib = fixed_part(Box((0.02, 0.02, 0.3)), pose((0.7 + GRIP_HEIGHT + 0.01 - 0.004, 0.03, 1.0)))

    (depth,) = tool_depths(
        replace(cell, part=rib), schedule(2, work("a")), Scene.from_cell(cell).chains, {"a": np.zeros((2, 6))}
    )

    assert (depth.body, depth.depth) == ("left", pytest.approx(0.004, abs=1e-5))
