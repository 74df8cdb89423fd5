"""What the user mounts is judged: only a robot's own file excuses a contact."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import (
    QUARTER,
    arm_model,
    body,
    fixed_part,
    floor,
    held_part,
    make_cell,
    placed,
    stick,
    thing,
)

from cellplan.errors import InputError
from cellplan.geometry.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Grasp, Part
from cellplan.model.report.left_out import LeftOutKind
from cellplan.model.settings.checks import ChecksEntry, ExclusionEntry
from cellplan.scene.mounting import Mount
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

PLATE = Box((0.3, 0.3, 0.24))
RIGHT, WRONG = pose((0.0, 0.0, -0.12)), pose((0.0, 0.0, 0.12))


def holder(X_PT: Array, **changes) -> Cell:
    """The elbow arm with a plate on its bare hand."""
    return make_cell(placed("a", arm_model()), part=held_part(PLATE, "a", X_PT), **changes)


def refusal(cell: Cell) -> str:
    with pytest.raises(InputError) as caught:
        Scene.from_cell(cell)
    return str(caught.value)


def leave(*pairs: tuple[str, str]) -> ChecksEntry:
    exclusions = tuple(ExclusionEntry(bodies=pair, reason="a pocket") for pair in pairs)
    return ChecksEntry(exclude=exclusions)


def test_a_part_on_the_right_side_of_the_flange_is_no_error() -> None:
    assert [pair.mount for pair in Scene.from_cell(holder(RIGHT)).mounted] == [Mount.GRIP]


def test_a_part_the_wrong_way_round_is_refused_with_all_that_it_touches() -> None:
    said = refusal(holder(WRONG))

    assert said.startswith("<cell>: part.held_by[0].at: expected a part clear of the links of 'a' beyond its flange")
    assert "a/wrist" in said
    assert "is the grasp the right way round?" in said


def test_a_part_the_wrong_way_round_is_refused_where_the_flange_has_no_body() -> None:
    model = arm_model()
    bare = replace(model, bodies=tuple(body for body in model.bodies if body.name != "hand"))

    said = refusal(make_cell(placed("a", bare), part=held_part(PLATE, "a", WRONG)))

    assert "a/tube" in said


def test_pairs_named_by_the_user_are_no_error() -> None:
    scene = Scene.from_cell(holder(WRONG, checks=leave(("a/wrist", "part"), ("a/tube", "part"))))

    kinds = {pair.bodies: pair.kind for pair in scene.left_out}
    assert kinds["a/wrist", "part"] is LeftOutKind.EXCLUDED
    assert kinds["a/hand", "part"] is LeftOutKind.GRIP


@pytest.mark.parametrize("back", [0.1, 0.25, 0.4])
def test_a_tool_through_its_own_wrist_is_refused(back: float) -> None:
    rod = body("tool", 0, shape=Cylinder(0.02, 0.1 + back), at=(0.0, 0.0, 0.5 * (0.1 - back)))

    said = refusal(make_cell(placed("a", arm_model(), tool=replace(stick(), bodies=(rod,)))))

    assert said.startswith("<cell>: robots.a.tool.bodies[0]: expected a body of the tool clear of the links of 'a'")
    assert "a/wrist" in said


def test_a_second_body_of_a_tool_is_named_by_its_place() -> None:
    rod = body("tool_2", 0, shape=Cylinder(0.02, 0.3), at=(0.0, 0.0, -0.1))
    arm = placed("a", arm_model(), tool=replace(stick(), bodies=(*stick().bodies, rod)))

    assert refusal(make_cell(arm)).startswith("<cell>: robots.a.tool.bodies[1]: ")


def test_a_tool_on_the_flange_is_mounted_however_broad() -> None:
    plate = body("tool", 0, shape=Box((0.08, 0.08, 0.02)), at=(0.0, 0.0, 0.01))

    scene = Scene.from_cell(make_cell(placed("a", arm_model(), tool=replace(stick(), bodies=(plate,)))))

    assert ("a/hand", "a/tool", "fixed to the same link") in scene.exclusions


def test_fingers_of_the_robots_own_file_grip_the_part() -> None:
    """A gripper that cannot move is on the flange link: it may touch, and its depth is judged body by body."""
    model = arm_model()
    fingers = [
        body(f"finger_{side}", 5, shape=Box((0.1, 0.02, 0.02)), at=(0.75, y, 1.0))
        for side, y in (("left", 0.03), ("right", -0.03))
    ]
    arm = placed("a", replace(model, bodies=(*model.bodies, *fingers)))

    scene = Scene.from_cell(make_cell(arm, part=held_part(Box((0.04, 0.04, 0.1)), "a", pose((0.0, 0.0, -0.055)))))

    assert [scene.bodies[pair.first].name for pair in scene.mounted] == ["a/hand", "a/finger_left", "a/finger_right"]


def further(X_PT: Array, *, axes: tuple[int, ...] = tuple(range(6)), radius: float = 0.01, length: float = 0.1) -> Cell:
    """Two arms and a block of 0.2 m; the second grips it with a rod."""
    arms = (
        placed("a", arm_model(), tool=stick()),
        placed("b", arm_model(), base=pose((3.0, 0.0, 0.0)), tool=stick(length, radius)),
    )
    grasps = (
        Grasp(robot="a", X_PT=pose((0.0, 0.0, -0.1))),
        Grasp(robot="b", X_PT=X_PT @ pose((0.0, 0.0, 0.0), (2 * QUARTER, 0.0, 0.0)), axes=axes),
    )
    return make_cell(*arms, part=Part(shape=Box((0.2, 0.2, 0.2)), X_PS=np.eye(4), held_by=grasps, X_WP=None))


@pytest.mark.parametrize("axes", [tuple(range(6)), (0, 1, 2)])
@pytest.mark.parametrize("radius", [0.01, 0.05])
def test_a_further_holder_may_touch_with_its_tip_and_the_face_round_it(axes: tuple[int, ...], radius: float) -> None:
    scene = Scene.from_cell(further(pose((0.0, 0.0, 0.1)), axes=axes, radius=radius))

    pair = next(pair for pair in scene.pairs if scene.names(pair) == ("b/tool", "part"))
    assert pair.rule is Rule.GRIP
    assert "within 20 mm of the tool tip and with the face at the tip, at most 2 mm deep" in pair.reason
    assert {scene.bodies[pair.first].name: pair.moves for pair in scene.mounted} == {
        "a/hand": False,
        "a/tool": False,
        "b/hand": len(axes) < 6,
        "b/tool": len(axes) < 6,
    }


def test_a_further_holder_that_touches_beside_its_tip_is_refused() -> None:
    """The rod lies along the side of the block, its tip beyond the far edge."""
    along = pose((0.11, 0.0, -0.13))

    said = refusal(further(along, radius=0.0105, length=0.3))

    assert said.startswith("<cell>: part.held_by[1].at: expected 'b' to touch the part near its tool tip")


def test_a_further_holder_whose_grasp_leaves_axes_free_is_watched_behind_its_tip_all_the_same() -> None:
    scene = Scene.from_cell(further(pose((0.0, 0.0, 0.1)), axes=(0, 1, 2)))

    row = next(row for row, pair in enumerate(scene.pairs) if scene.names(pair) == ("b/tool", "part"))
    engine_body = scene.solid_pairs[scene.solid_rows.tolist().index(row)].min()
    watched = scene.solid_pairs[scene.solid_rows.tolist().index(row)].max()
    assert engine_body < len(scene.bodies) <= watched  # what the engine watches is cut from the tool


def test_what_stands_is_judged_by_its_depth_and_feet_keep_their_distance() -> None:
    part = fixed_part(Box((0.2, 0.2, 0.2)), pose((1.5, 0.0, 0.7)))
    table = thing("table", Box((0.6, 0.6, 0.6)), pose((1.5, 0.0, 0.3)))
    arms = placed("a", arm_model()), placed("b", arm_model(), base=pose((3.0, 0.0, 0.0)))

    scene = Scene.from_cell(make_cell(*arms, part=part, things=(floor(), table)))

    standing = {(scene.bodies[pair.first].name, scene.bodies[pair.second].name) for pair in scene.mounted}
    assert {("a/foot", "floor"), ("b/foot", "floor"), ("part", "table"), ("a/foot", "table")} <= standing
    rules = {scene.names(pair): pair.rule for pair in scene.pairs}
    assert rules["a/foot", "b/foot"] is Rule.CLEARANCE
    assert rules["a/foot", "part"] is Rule.CLEARANCE


def test_a_first_link_that_only_just_touches_the_floor_stands_there() -> None:
    model = arm_model()
    bodies = tuple(
        replace(body, X_BS=pose((0.0, 0.0, 0.075))) if body.name == "column" else body for body in model.bodies[1:]
    )
    legless = placed("a", replace(model, bodies=bodies), base=pose((0.0, 0.0, 1e-8)))

    scene = Scene.from_cell(make_cell(legless, things=(floor(),)))

    result = {scene.bodies[pair.first].name: (pair.mount, pair.moves) for pair in scene.mounted}
    assert result["a/column"] == (Mount.STANDING, True)


def test_nothing_is_left_out_of_a_cell_without_anything_mounted() -> None:
    assert Scene.from_cell(make_cell(placed("a", arm_model()))).left_out == ()


def test_a_robot_whose_links_have_no_bodies_is_reported() -> None:
    bare = replace(arm_model(), bodies=())
    scene = Scene.from_cell(make_cell(placed("a", arm_model()), placed("b", bare)))

    (reported,) = scene.left_out
    assert (reported.kind, reported.bodies) == (LeftOutKind.NO_BODY, ("b",))


def test_the_order_of_the_robots_changes_no_verdict_on_pairs() -> None:
    model = arm_model()
    fat = replace(model, bodies=(*model.bodies, body("hose", 3, shape=Capsule(0.09, 0.25), at=(0.4, 0.1, 1.05))))
    arms = (placed("a", fat, tool=stick()), placed("b", model, base=pose((3.0, 0.0, 0.0)), tool=stick(0.05, 0.02)))

    one, other = Scene.from_cell(make_cell(*arms)), Scene.from_cell(make_cell(*arms[::-1]))

    def verdicts(scene: Scene) -> dict[frozenset[str], str]:
        rules = {frozenset(scene.names(pair)): str(pair.rule) for pair in scene.pairs}
        return rules | {frozenset((first, second)): reason for first, second, reason in scene.exclusions}

    assert verdicts(one) == verdicts(other)


def test_things_of_the_surroundings_are_reported_as_unjudged_among_themselves() -> None:
    things = (thing("floor", HalfSpace()), thing("ball", Sphere(0.1), pose((2.0, 0.0, 0.0))))

    scene = Scene.from_cell(make_cell(placed("a", arm_model()), things=things))

    assert scene.left_out[-1].kind is LeftOutKind.ENVIRONMENT
    assert set(scene.left_out[-1].bodies) == {"floor", "ball"}
