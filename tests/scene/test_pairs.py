"""Which pairs are watched, and what is said about those that are not."""

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
    joint,
    make_cell,
    no_tool,
    placed,
    stick,
    thing,
    work,
)

from cellplan.errors import InputError
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Grasp, Part
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import FollowerJoint, JointKind, Link, RobotModel
from cellplan.model.settings.checks import ChecksEntry, ExclusionEntry
from cellplan.model.task.task import Frame
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene


def reasons(scene: Scene) -> dict[frozenset[str], str]:
    return {frozenset((first, second)): reason for first, second, reason in scene.exclusions}


def watched(scene: Scene) -> dict[frozenset[str], ScenePair]:
    return {frozenset(scene.names(pair)): pair for pair in scene.pairs}


def two_arms(**changes) -> Cell:
    arms = (placed("a", arm_model(), tool=stick()), placed("b", arm_model(), base=pose((3.0, 0.0, 0.0)), tool=stick()))
    return make_cell(*arms, **changes)


def test_every_pair_is_either_watched_or_left_out_with_a_reason() -> None:
    scene = Scene.from_cell(two_arms(things=(floor(), thing("post", Box((0.1, 0.1, 1.0)), pose((1.5, 1.5, 0.5))))))

    count = len(scene.bodies)
    among_things = 1  # post and floor are nobody's business
    assert len(scene.pairs) + len(scene.exclusions) == count * (count - 1) // 2 - among_things
    assert not set(watched(scene)) & set(reasons(scene))
    assert all(reasons(scene).values())


def test_links_joined_by_a_joint_are_left_out() -> None:
    said = reasons(Scene.from_cell(two_arms()))

    assert said[frozenset(("a/foot", "a/column"))] == "joined by joint a1"
    assert said[frozenset(("a/wrist", "a/hand"))] == "joined by joint a6"
    assert said[frozenset(("a/hand", "a/tool"))] == "fixed to the same link"


def test_links_two_joints_apart_are_checked_for_contact_only() -> None:
    pairs = watched(Scene.from_cell(two_arms()))

    assert pairs[frozenset(("a/foot", "a/upper_arm"))].rule is Rule.CONTACT
    assert pairs[frozenset(("a/foot", "a/forearm"))].rule is Rule.CLEARANCE


def test_links_around_one_without_a_body_count_as_neighbours() -> None:
    model = arm_model()
    bodies = tuple(body for body in model.bodies if body.name != "wrist")

    said = reasons(Scene.from_cell(make_cell(placed("a", replace(model, bodies=bodies)))))

    assert said[frozenset(("a/tube", "a/hand"))] == "joined by joint a6"


def test_a_tool_on_a_flange_without_a_body_is_mounted_on_the_link_before() -> None:
    model = arm_model()
    bodies = tuple(body for body in model.bodies if body.name != "hand")

    said = reasons(Scene.from_cell(make_cell(placed("a", replace(model, bodies=bodies), tool=stick()))))

    assert (
        "mounted on it, as the flange has no body: may touch, at most 2 mm deep"
        in said[frozenset(("a/wrist", "a/tool"))]
    )


def test_a_follower_is_a_neighbour_of_the_link_that_carries_it() -> None:
    model = arm_model()
    lever = FollowerJoint(
        name="lever",
        kind=JointKind.REVOLUTE,
        parent=0,
        axis_B=np.array([0.0, 1.0, 0.0]),
        point_B=np.array([0.0, 0.15, 0.4]),
        leader=2,
        ratio=1.0,
        offset=0.0,
    )
    rod = body("rod", 6, shape=Capsule(0.02, 0.3), at=(0.0, 0.15, 0.6))

    scene = Scene.from_cell(make_cell(placed("a", replace(model, followers=(lever,), bodies=(*model.bodies, rod)))))

    assert reasons(scene)[frozenset(("a/column", "a/rod"))] == "joined by joint lever"
    assert frozenset(("a/rod", "a/forearm")) in watched(scene)


def test_bodies_that_overlap_in_every_posture_are_left_out_and_those_that_sometimes_do_are_not() -> None:
    model = arm_model()
    fat = tuple(replace(body, shape=Sphere(0.15)) if body.name in ("tube", "hand") else body for body in model.bodies)

    scene = Scene.from_cell(make_cell(placed("a", replace(model, bodies=fat))))

    assert (
        "touch at the reference configuration and at 48 random ones" in reasons(scene)[frozenset(("a/tube", "a/hand"))]
    )
    assert frozenset(("a/forearm", "a/hand")) in watched(scene)


def test_a_held_part_is_not_checked_against_what_holds_it() -> None:
    part = held_part(Cylinder(0.1, 0.3), "a", pose((0.0, 0.0, -0.15)))

    scene = Scene.from_cell(two_arms(part=part))
    said = reasons(scene)

    assert said[frozenset(("a/tool", "part"))] == "holds the part: may touch, at most 2 mm deep"
    assert said[frozenset(("a/hand", "part"))] == "holds the part: may touch, at most 2 mm deep"
    assert watched(scene)[frozenset(("a/forearm", "part"))].clearance_class is ClearanceClass.PART
    assert watched(scene)[frozenset(("b/tool", "part"))].rule is Rule.CLEARANCE


def test_a_part_on_a_bare_flange_without_a_body_is_mounted_on_the_link_before() -> None:
    model = arm_model()
    bodies = tuple(body for body in model.bodies if body.name != "hand")
    part = held_part(Cylinder(0.1, 0.3), "a", pose((0.0, 0.0, -0.15)))

    scene = Scene.from_cell(make_cell(placed("a", replace(model, bodies=bodies), tool=no_tool()), part=part))

    assert "mounted on it, as the flange has no body" in reasons(scene)[frozenset(("a/wrist", "part"))]


def test_feet_may_stand_in_the_floor_but_not_in_each_other() -> None:
    scene = Scene.from_cell(two_arms(things=(floor(),)))

    assert "both are fixed" in reasons(scene)[frozenset(("a/foot", "floor"))]
    assert watched(scene)[frozenset(("a/foot", "b/foot"))].clearance_class is ClearanceClass.ROBOT_ROBOT
    assert watched(scene)[frozenset(("a/column", "floor"))].clearance_class is ClearanceClass.ENVIRONMENT


def test_a_fixed_part_may_rest_on_a_fixture_but_not_in_a_foot() -> None:
    part = fixed_part(Box((0.2, 0.2, 0.2)), pose((1.5, 0.0, 0.1)))

    scene = Scene.from_cell(two_arms(part=part, things=(floor(),)))

    assert "both are fixed" in reasons(scene)[frozenset(("part", "floor"))]
    assert frozenset(("a/foot", "part")) in watched(scene)


def test_a_robot_without_a_foot_may_stand_in_the_floor_with_its_first_link() -> None:
    turntable = RobotModel(
        name="turntable",
        source="test",
        joints=(joint("turn", -1), joint("tilt", 0, axis=(0.0, 1.0, 0.0), point=(0.0, 0.0, 0.5))),
        flange_link=1,
        X_BF=pose((0.0, 0.0, 0.6)),
        bodies=(
            body("column", 0, shape=Capsule(0.1, 0.4), at=(0.0, 0.0, 0.2)),
            body("plate", 1, shape=Box((0.5, 0.1, 0.1)), at=(0.0, 0.0, 0.55)),
        ),
    )

    scene = Scene.from_cell(make_cell(placed("t", turntable), things=(floor(),)))

    assert "stands on it, as the foot has no body" in reasons(scene)[frozenset(("t/column", "floor"))]
    assert frozenset(("t/plate", "floor")) in watched(scene)


def test_pairs_the_user_leaves_out_carry_the_users_reason() -> None:
    settings = ChecksEntry(exclude=(ExclusionEntry(bodies=("b/tool", "a/tool"), reason="they meet"),))

    scene = Scene.from_cell(two_arms(checks=settings))

    assert reasons(scene)[frozenset(("a/tool", "b/tool"))] == "they meet"


def in_pieces() -> Cell:
    """Two arms, whose forearms are of two pieces each."""
    arms = []
    for name, x in (("a", 0.0), ("b", 3.0)):
        model = arm_model()
        (forearm,) = (body for body in model.bodies if body.name == "forearm")
        links = (Link(name="forearm", index=forearm.link, X_BL=np.eye(4)),)
        second = replace(forearm, name="forearm_2")
        arms.append(
            placed(
                name,
                replace(model, bodies=(*model.bodies, second), links=links),
                base=pose((x, 0.0, 0.0)),
                tool=stick(),
            )
        )
    return make_cell(*arms, things=(thing("post", Box((0.1, 0.1, 1.0)), pose((1.5, 1.5, 0.5))),))


def left_out(cell: Cell, *bodies: str) -> set[frozenset[str]]:
    """The pairs that an exclusion leaves out of a cell."""
    exclusion = ExclusionEntry(bodies=(bodies[0], bodies[1]), reason="as it is")
    settings = ChecksEntry(exclude=(exclusion,))
    return {pair for pair, why in reasons(Scene.from_cell(replace(cell, checks=settings))).items() if why == "as it is"}


def test_all_pieces_of_a_link_are_left_out_by_its_name() -> None:
    cell = in_pieces()

    assert left_out(cell, "a/forearm", "post") == {
        frozenset((f"a/{name}", "post")) for name in ("forearm", "forearm_2")
    }
    assert left_out(cell, "a/forearm_2", "post") == {frozenset(("a/forearm_2", "post"))}
    assert len(left_out(cell, "a/forearm", "b/forearm")) == 4


def test_a_whole_robot_is_left_out_by_its_own_name() -> None:
    cell = in_pieces()
    scene = Scene.from_cell(cell)
    bodies = {body.name for body in scene.bodies if body.robot == "a"}

    assert left_out(cell, "a", "post") == {frozenset((name, "post")) for name in bodies}
    assert len(left_out(cell, "a", "b")) == len(bodies) ** 2
    assert "a/tool" in bodies


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        (("a/tol", "part"), "expected names of two bodies, got 'a/tol'; did you mean 'a/tool'?"),
        (("part", "part"), "expected two different bodies, got 'part' twice"),
    ],
)
def test_exclusions_that_name_no_pair_are_refused(bodies: tuple[str, str], message: str) -> None:
    exclusion = ExclusionEntry.model_construct(bodies=bodies, reason="why not")

    with pytest.raises(InputError) as caught:
        Scene.from_cell(two_arms(checks=ChecksEntry().model_copy(update={"exclude": (exclusion,)})))

    assert str(caught.value) == f"<cell>: checks.exclude[0].bodies: {message}"


def test_two_bodies_of_one_name_are_refused() -> None:
    with pytest.raises(InputError, match="two bodies are named 'part'"):
        Scene.from_cell(two_arms(things=(thing("part", Sphere(0.1)),)))


def test_only_tools_of_robots_with_a_task_may_touch_the_part() -> None:
    part = fixed_part(Box((0.2, 0.2, 0.2)), pose((1.5, 0.0, 0.5)))

    pairs = watched(Scene.from_cell(two_arms(part=part, tasks=(work("a"),))))

    assert pairs[frozenset(("a/tool", "part"))].rule is Rule.PROCESS
    assert "within 20 mm of the tool tip" in pairs[frozenset(("a/tool", "part"))].reason
    assert pairs[frozenset(("b/tool", "part"))].rule is Rule.CLEARANCE


def test_tool_bodies_far_from_the_tip_must_keep_their_distance() -> None:
    tool = stick()
    spindle = body("spindle", 0, shape=Cylinder(0.05, 0.03), at=(0.0, 0.0, 0.02))
    arm = placed("a", arm_model(), tool=replace(tool, bodies=(*tool.bodies, spindle)))

    pairs = watched(Scene.from_cell(make_cell(arm, tasks=(work("a"),))))

    assert pairs[frozenset(("a/tool", "part"))].rule is Rule.PROCESS
    assert pairs[frozenset(("a/tool_2", "part"))].rule is Rule.CLEARANCE


def test_a_tool_always_near_the_link_behind_it_is_checked_for_contact_only() -> None:
    model = arm_model()
    bodies = tuple(
        body("hand", 5, shape=Cylinder(0.03, 0.003), at=(0.6465, 0.0, 1.0), rpy=(0.0, QUARTER, 0.0))
        if b.name == "hand"
        else b
        for b in model.bodies
    )
    thin = replace(model, bodies=bodies, X_BF=pose((0.648, 0.0, 1.0), (0.0, QUARTER, 0.0)))

    pair = watched(Scene.from_cell(make_cell(placed("a", thin, tool=stick()))))[frozenset(("a/wrist", "a/tool"))]

    assert pair.rule is Rule.CONTACT
    assert "closer than the required clearance in every configuration" in pair.reason


def test_a_tool_at_a_distance_that_no_joint_changes_is_checked_for_contact_only() -> None:
    """The round tool turns about the axis of the round wrist: their distance is the same at every configuration."""
    pair = watched(Scene.from_cell(make_cell(placed("a", arm_model(), tool=stick()))))[frozenset(("a/wrist", "a/tool"))]

    assert pair.rule is Rule.CONTACT
    assert "their distance is fixed by the mounting" in pair.reason


def test_a_bent_tool_whose_distance_changes_keeps_its_clearance() -> None:
    bent = replace(stick(), bodies=(body("tool", 0, shape=Capsule(0.01, 0.2), at=(0.1, 0.0, 0.02), rpy=(0, 1.4, 0)),))
    pair = watched(Scene.from_cell(make_cell(placed("a", arm_model(), tool=bent))))[frozenset(("a/tube", "a/tool"))]

    assert pair.rule is Rule.CLEARANCE


def shared_part(shape: Sphere | Box) -> Part:
    """A part that two arms hold from opposite sides, each with its tool axis into the part."""
    grasps = (
        Grasp(robot="a", X_PT=pose((0.0, 0.0, -0.1))),
        Grasp(robot="b", X_PT=pose((0.0, 0.0, 0.1), (2 * QUARTER, 0.0, 0.0))),
    )
    return Part(shape=shape, X_PS=np.eye(4), held_by=grasps, X_WP=None)


def test_every_holder_may_touch_the_part_with_its_tool_and_hand() -> None:
    scene = Scene.from_cell(two_arms(part=shared_part(Sphere(0.05)), tasks=()))
    for name in ("hand", "tool"):
        assert "holds the part" in reasons(scene)[frozenset((f"a/{name}", "part"))]
    assert watched(scene)[frozenset(("b/tool", "part"))].rule is Rule.GRIP
    assert watched(scene)[frozenset(("b/hand", "part"))].rule is Rule.CONTACT
    for robot in "ab":
        assert watched(scene)[frozenset((f"{robot}/foot", "part"))].rule is Rule.CLEARANCE
    assert watched(scene)[frozenset(("a/tool", "b/tool"))].rule is Rule.CLEARANCE


def test_links_near_a_part_by_their_mounting_are_the_same_for_every_holder() -> None:
    """A broad plate at 0.1 m from either tool tip reaches back over the wrists of both arms."""
    scene = Scene.from_cell(two_arms(part=shared_part(Box((0.3, 0.3, 0.42))), tasks=()))
    said, watched_pairs = reasons(scene), watched(scene)
    rules = [
        watched_pairs[frozenset((f"{robot}/wrist", "part"))].rule
        if frozenset((f"{robot}/wrist", "part")) in watched_pairs
        else said[frozenset((f"{robot}/wrist", "part"))]
        for robot in "ab"
    ]
    assert rules[0] == rules[1]
    assert rules[0] is not Rule.CLEARANCE


def test_a_task_in_the_world_is_no_leave_to_touch_the_part() -> None:
    in_world = replace(work("b"), relative_to=Frame.WORLD)
    scene = Scene.from_cell(two_arms(part=held_part(Sphere(0.05), "a", np.eye(4)), tasks=(in_world,)))
    assert watched(scene)[frozenset(("b/tool", "part"))].rule is Rule.CLEARANCE
