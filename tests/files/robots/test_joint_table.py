"""Joint-axis tables: axes, limits and bodies in metres, and every finding about an unsound table."""

import math
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.robots.joint_table import bundled_names, load_bundled, read_robot_table
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere, support
from cellplan.geometry.transforms import is_rigid, pose
from cellplan.model.robot.robot import BASE, Body, JointKind, RobotModel

TABLE = """\
robot: arm
source: a data sheet
joints:
  rail: {type: prismatic, axis: [0, 1, 0], lower_mm: -500, upper_mm: 1500, velocity_mm_s: 800}
  A1: {type: revolute, axis: [0, 0, 1.0005], point_mm: [0, 0, 400], lower_deg: -90, upper_deg: 180, velocity_deg_s: 90}
flange: {xyz_mm: [1000, 0, 400], rpy_deg: [0, 90, 0]}
bodies:
  - {link: base, box: {size_mm: [100, 200, 300], center_mm: [0, 0, 150]}}
  - {link: A1, capsule: {from_mm: [0, 0, 400], to_mm: [1000, 0, 400], radius_mm: 50}}
  - {link: A1, sphere: {center_mm: [0, 0, 400], radius_mm: 60}}
  - {link: rail, name: sledge, cylinder: {from_mm: [0, 0, 0], to_mm: [0, 0, 400], radius_mm: 80}}
"""


def read(folder: Path, *changes: tuple[str, str]) -> RobotModel:
    text = TABLE
    for old, new in changes:
        assert text.count(old) == 1, f"{old!r} must occur once"
        text = text.replace(old, new)
    (folder / "arm.yaml").write_text(text, encoding="utf-8")
    return read_robot_table(folder / "arm.yaml")


def ends(body: Body, direction_B: list[float]) -> float:
    """Farthest reach of a body along a direction of the base frame."""
    n = np.array(direction_B)
    return float(support(body.shape, body.X_BS[:3, :3].T @ n) + n @ body.X_BS[:3, 3])


def test_a_table_becomes_a_chain_in_metres_and_radians(tmp_path: Path) -> None:
    model = read(tmp_path)

    rail, turn = model.joints
    assert (model.name, model.source, model.flange_link) == ("arm", "a data sheet", 1)
    assert (rail.kind, rail.parent, rail.lower, rail.upper, rail.velocity) == (
        JointKind.PRISMATIC,
        BASE,
        -0.5,
        1.5,
        0.8,
    )
    assert (turn.kind, turn.parent) == (JointKind.REVOLUTE, 0)
    assert (turn.lower, turn.upper) == (-math.pi / 2, math.pi)
    np.testing.assert_array_equal(turn.axis_B, [0.0, 0.0, 1.0])
    np.testing.assert_array_equal(turn.point_B, [0.0, 0.0, 0.4])
    np.testing.assert_allclose(model.X_BF, pose((1.0, 0.0, 0.4), (0.0, math.pi / 2, 0.0)))


def test_bodies_take_the_names_of_their_links_and_lie_where_drawn(tmp_path: Path) -> None:
    base, arm, ball, sledge = read(tmp_path).bodies

    assert [body.name for body in (base, arm, ball, sledge)] == ["base", "A1", "A1_2", "sledge"]
    assert [body.link for body in (base, arm, ball, sledge)] == [BASE, 1, 1, 0]
    assert base.shape == Box((0.1, 0.2, 0.3))
    assert arm.shape == Capsule(0.05, 1.0)
    assert ball.shape == Sphere(0.06)
    assert sledge.shape == Cylinder(0.08, 0.4)
    assert all(is_rigid(body.X_BS) for body in (base, arm, ball, sledge))
    assert ends(arm, [1.0, 0.0, 0.0]) == pytest.approx(1.05)
    assert ends(arm, [-1.0, 0.0, 0.0]) == pytest.approx(0.05)
    assert ends(arm, [0.0, 0.0, 1.0]) == pytest.approx(0.45)
    assert ends(base, [0.0, 0.0, -1.0]) == pytest.approx(0.0)


def test_a_capsule_without_length_is_a_ball(tmp_path: Path) -> None:
    body = read(tmp_path, ("to_mm: [1000, 0, 400]", "to_mm: [0, 0, 400]")).bodies[1]

    assert body.shape == Sphere(0.05)


def test_a_mesh_body_is_read_from_below_the_table(tmp_path: Path) -> None:
    (tmp_path / "link.obj").write_text(
        "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n", encoding="utf-8"
    )
    mesh = "mesh: {file: link.obj, unit: mm, at: {xyz_mm: [0, 0, 10]}}"

    body = read(tmp_path, ("box: {size_mm: [100, 200, 300], center_mm: [0, 0, 150]}", mesh)).bodies[0]

    assert isinstance(body.shape, Mesh)
    assert ends(body, [0.0, 0.0, 1.0]) == pytest.approx(0.11)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "robot: arm",
            "robot: my arm",
            ":1: robot: expected a name of 1 to 40 letters, digits, '_' or '-' that does "
            "not start with '-', got 'my arm'",
        ),
        ("[0, 1, 0]", "[0, 1.01, 0]", ":4: joints.rail.axis: expected a vector of length 1, got one of length 1.01"),
        (
            "[0, 1, 0]",
            "[0, 0, 0]",
            ":4: joints.rail.axis: expected a direction that is not zero, got a vector of no length",
        ),
        ("type: prismatic", "type: linear", ":4: joints.rail.type: expected revolute or prismatic, got 'linear'"),
        (
            "lower_mm: -500",
            "lower_mm: 1500",
            ":4: joints.rail.upper_mm: expected a number above lower_mm = 1500, got 1500",
        ),
        (
            "lower_mm: -500",
            "lower_deg: -500",
            ":4: joints.rail.lower_deg: unexpected key, a prismatic joint "
            "has lower_mm, "
            "upper_mm, velocity_mm_s, acceleration_mm_s2, jerk_mm_s3, force_n",
        ),
        (
            "velocity_deg_s: 90",
            "velocity_deg_s: 0",
            ":5: joints.A1.velocity_deg_s: expected a positive number of degrees per second, got 0",
        ),
        (
            ", velocity_deg_s: 90",
            "",
            ":5: joints.A1.velocity_deg_s: missing, a revolute joint needs lower_deg, upper_deg, velocity_deg_s",
        ),
        ("point_mm: [0, 0, 400], ", "", ":5: joints.A1.point_mm: missing, expected a point on the axis"),
        (
            "  rail: {",
            "  tool: {",
            ":4: joints.tool: expected another name, 'tool' means the tool of the robot\n"
            "arm.yaml:11: bodies[3].link: expected a link (base, tool, A1), got 'rail'",
        ),
        (
            "link: rail",
            "link: rial",
            ":11: bodies[3].link: expected a link (base, rail, A1), got 'rial', did you mean 'rail'?",
        ),
        (
            "name: sledge",
            "name: tool_2",
            ":11: bodies[3].name: expected another name, 'tool_2' means the tool of the robot",
        ),
        (
            "to_mm: [0, 0, 400], radius_mm: 80",
            "to_mm: [0, 0, 0], radius_mm: 80",
            ":11: bodies[3].cylinder.to_mm: expected another point than from_mm, got the same",
        ),
        (
            "box: {size_mm: [100, 200, 300], center_mm: [0, 0, 150]}",
            "mesh: {file: none.stl, unit: mm}",
            ":8: bodies[0].mesh.file: expected an existing file, got 'none.stl'",
        ),
        ("flange: {xyz_mm", "flagne: {xyz_mm", ": "),
    ],
)
def test_a_mistake_in_a_table_is_named_with_its_line_and_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, old: str, new: str, message: str
) -> None:
    monkeypatch.chdir(tmp_path)

    with pytest.raises(InputError) as caught:
        read(Path(), (old, new))

    if message == ": ":
        assert str(caught.value).splitlines()[1].startswith("arm.yaml:6: flagne: unknown key, did you mean 'flange'?")
    else:
        assert str(caught.value) == f"arm.yaml{message}"


@pytest.mark.parametrize("name", bundled_names())
def test_bundled_robots_are_whole(name: str) -> None:
    model = load_bundled(name)

    assert model.name == name
    assert {body.link for body in model.bodies} >= {BASE}
    assert np.all(model.lower < model.upper)
    assert np.all(model.velocity > 0.0)
    assert len({body.name for body in model.bodies}) == len(model.bodies)


def test_an_unknown_bundled_robot_is_named_with_the_nearest_one() -> None:
    with pytest.raises(InputError, match=r"got 'kuka_kr60', did you mean 'kuka_kr6'\?$"):
        load_bundled("kuka_kr60")
