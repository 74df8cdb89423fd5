"""What the user mounts on a robot or puts below it: it moves along, and nothing but its own link excuses a contact."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, body, floor, make_cell, placed, stick, thing
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.errors import InputError
from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.cell.mounting import Hanger, Pedestal
from cellplan.model.robot.robot import BASE
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

COLUMN = Pedestal(radius=0.2, floor=0.0)
RAISED = pose((0.0, 0.0, 0.5))


def arm(*, base=RAISED, **changes) -> Robot:
    return replace(placed("a", arm_model(), base=base, tool=stick()), **changes)


def reason_of(scene: Scene, *names: str) -> str | None:
    return next((reason for a, b, reason in scene.exclusions if {a, b} == set(names)), None)


def rule_of(scene: Scene, *names: str) -> Rule | None:
    return next((pair.rule for pair in scene.pairs if set(scene.names(pair)) == set(names)), None)


def pose_of(cell: Cell, name: str, q: np.ndarray) -> np.ndarray:
    scene = Scene.from_cell(cell)
    index = [body.name for body in scene.bodies].index(name)
    poses = scene.body_poses(q[None])
    return np.append(poses.p[index, 0], poses.R[index, 0].ravel())


def test_a_pedestal_reaches_from_the_floor_to_the_base_wherever_the_base_stands() -> None:
    for height in (0.1, 0.9):
        bodies = Scene.from_cell(make_cell(arm(base=pose((1.0, 2.0, height)), pedestal=COLUMN))).bodies
        column = next(body for body in bodies if body.name == "a/pedestal")

        X_WS = pose((1.0, 2.0, height)) @ column.X_BS
        assert column.shape.length == pytest.approx(height)
        np.testing.assert_allclose(X_WS[:3, 3], (1.0, 2.0, 0.5 * height))


@settings(max_examples=25, deadline=None)
@given(
    x=st.floats(-5.0, 5.0),
    floor_z=st.floats(-1.0, 1.0),
    height=st.floats(0.01, 2.0),
    heading=st.floats(-3.1, 3.1),
    lean=st.floats(-0.017, 0.017),
)
def test_a_pedestal_stands_upright_between_floor_and_base(x, floor_z, height, heading, lean) -> None:
    X_WB = pose((x, -x, floor_z + height), (lean, 0.0, heading))

    shape, X_BS = Pedestal(size=(0.5, 0.4), floor=floor_z).solid(X_WB) or (None, np.eye(4))

    X_WS = X_WB @ X_BS
    assert isinstance(shape, Box)
    np.testing.assert_allclose(X_WS[2], (0.0, 0.0, 1.0, floor_z + 0.5 * height), atol=1e-9)
    np.testing.assert_allclose(X_WS[:2, 3], (x, -x), atol=1e-9)
    assert shape.size == pytest.approx((0.5, 0.4, height))
    assert X_WS[:2, 0] @ X_WB[:2, 0] == pytest.approx(1.0, abs=1e-3)  # a box turns with its base


def test_a_base_on_the_floor_has_no_pedestal() -> None:
    assert COLUMN.solid(np.eye(4)) is None


def test_a_pedestal_carries_its_own_base_and_is_judged_against_everything_else() -> None:
    other = replace(placed("b", arm_model(), base=pose((2.0, 0.0, 0.5))), pedestal=COLUMN)
    scene = Scene.from_cell(make_cell(arm(pedestal=COLUMN), other))

    assert reason_of(scene, "a/pedestal", "a/foot") == "mounted on it"
    for name in ("a/column", "a/upper_arm", "a/hand", "a/tool", "b/upper_arm"):
        assert rule_of(scene, "a/pedestal", name) is Rule.CLEARANCE, name
    standing = {frozenset((scene.bodies[pair.first].name, scene.bodies[pair.second].name)) for pair in scene.mounted}
    for name in ("b/foot", "b/pedestal", "part"):  # neither ever moves: how deep they are in each other is judged once
        assert frozenset(("a/pedestal", name)) in standing, name


def test_a_pedestal_carries_the_first_link_of_a_robot_whose_foot_has_no_body() -> None:
    model = arm_model()
    model = replace(model, bodies=tuple(body for body in model.bodies if body.link != BASE))
    scene = Scene.from_cell(make_cell(arm(model=model, pedestal=COLUMN)))

    assert reason_of(scene, "a/pedestal", "a/column") == "stands on it, as the foot has no body"
    assert rule_of(scene, "a/pedestal", "a/upper_arm") is Rule.CLEARANCE


def test_an_attachment_moves_with_its_link() -> None:
    valve = body("valve", 2, shape=Sphere(0.03), at=(0.2, 0.1, 1.1))
    q = np.array([0.3, -0.4, 0.8, 1.0, -0.2, 0.5])
    cell = make_cell(arm(attachments=(valve,)))
    model = replace(arm_model(), bodies=(*arm_model().bodies, valve))

    of_file = pose_of(make_cell(arm(model=model)), "a/valve", q)
    np.testing.assert_allclose(pose_of(cell, "a/valve", q), of_file, atol=1e-14)


def test_an_attachment_that_touches_another_link_in_every_configuration_is_refused_with_its_key() -> None:
    through_the_tube = body("valve", 2, shape=Box((0.5, 0.2, 0.2)), at=(0.3, 0.0, 1.0))

    with pytest.raises(InputError) as caught:
        Scene.from_cell(make_cell(arm(attachments=(through_the_tube,)), things=(floor(),)))

    assert str(caught.value).startswith("<cell>: robots.a.attachments[0]: expected an attachment clear of the links")
    assert "touches a/tube in every configuration" in str(caught.value)


def test_an_attachment_that_touches_other_bodies_now_and_then_is_judged_by_the_motion() -> None:
    neighbour = body("valve", 2, shape=Sphere(0.05), at=(0.2, 0.16, 1.0))
    scene = Scene.from_cell(make_cell(arm(attachments=(neighbour,)), things=(floor(),)))

    for name in ("a/tube", "a/upper_arm", "a/wrist", "a/tool", "part", "floor"):
        assert rule_of(scene, "a/valve", name) is Rule.CLEARANCE, name


def test_a_free_attachment_leaves_the_scene_as_it_was() -> None:
    free = body("valve", 2, shape=Sphere(0.02), at=(0.2, 0.0, 1.08))
    post = thing("post", Box((0.1, 0.1, 2.0)), pose((2.0, 0.0, 1.0)))
    scene = Scene.from_cell(make_cell(arm(attachments=(free,)), things=(post,)))

    assert scene.touching(np.array([0.0, 0.0, 0.0, 0.0, 0.5, 0.0])) is None


def test_a_mount_that_touches_a_moving_link_in_every_configuration_is_refused_with_its_key() -> None:
    """The first link of this arm turns in the plane of the base, where the column ends."""
    hung = pose((0.0, 0.0, 1.9), (np.pi, 0.0, 0.0))
    for base, mount, key in (
        (hung, Hanger(radius=0.09, ceiling=2.5), "robots.a.mount"),
        (RAISED, COLUMN, "robots.a.pedestal"),
    ):
        robot = placed("a", load_bundled("planar_3r"), base=base, tool=stick())

        with pytest.raises(InputError) as caught:
            Scene.from_cell(make_cell(replace(robot, pedestal=mount)))

        assert str(caught.value).startswith(f"<cell>: {key}: expected what it is mounted on clear of the links of 'a'")
        assert "touches a/A in every configuration" in str(caught.value)
