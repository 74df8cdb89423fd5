"""What a robot's file says before a cell adds anything, and the lines that put the robot into a cell."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from builders.urdf_texts import LIMIT, joint

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.robot_file import describe_robot
from cellplan.files.robots.urdf.load import UrdfOptions, read_urdf
from cellplan.geometry.shapes import Mesh
from cellplan.geometry.transforms import inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot_description import RobotDescription

Load = Callable[..., Cell]


def element(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>\n'


def body(shape: str, origin: str) -> str:
    return f"<collision><origin {origin}/><geometry>{shape}</geometry></collision>"


def text(name: str, *elements: str) -> str:
    return f'<robot name="{name}">\n{"".join(elements)}</robot>\n'


POST = body('<cylinder radius="0.1" length="0.5"/>', 'xyz="1 2 3"')
CAP = body('<box size="0.2 0.1 0.1"/>', 'xyz="1 2 3.35" rpy="0 1.5707963267948966 0"')
ROD = body('<mesh filename="rod.stl"/>', 'xyz="0.3 0 0" rpy="0.3 0.2 0.1"')
ARM = text(
    "two-arm",
    *(element("base", POST + CAP), element("upper", ROD)),
    *(element(name) for name in ("lower", "tool0", "left", "right", "camera")),
    joint("j1", "base", "upper", '<axis xyz="0 0 1"/>' + LIMIT),
    joint("j2", "upper", "lower", '<origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>' + LIMIT, kind="RANGE"),
    joint("m", "lower", "tool0", '<origin xyz="0.3 0 0" rpy="0 1.2 0"/>', kind="fixed"),
    joint("g", "tool0", "left", '<limit lower="0.01" upper="0.02" velocity="1"/>', kind="prismatic"),
    joint("h", "tool0", "right", LIMIT + '<mimic joint="g" multiplier="-2" offset="0.1"/>', kind="prismatic"),
    joint("c", "base", "camera", "", kind="fixed"),
)


@pytest.fixture
def described(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., RobotDescription]:
    """Describes the arm after changes of its text; the second joint turns without end unless it is changed."""
    monkeypatch.chdir(tmp_path)
    trimesh.creation.box((0.4, 0.05, 0.06)).export("rod.stl")

    def describe(kind: str = "continuous", flange: str | None = None) -> RobotDescription:
        Path("arm.urdf").write_text(ARM.replace("RANGE", kind), encoding="utf-8")
        return describe_robot("arm.urdf", flange=flange)

    return describe


def test_the_usual_flange_is_described_and_all_possible_ones_are_named(
    described: Callable[..., RobotDescription],
) -> None:
    made = described()

    assert (made.name, made.source, made.base, made.flange, made.is_usual) == (
        *("two-arm", "arm.urdf", "base", "tool0", False),
    )
    assert [(flange.link, flange.joints) for flange in made.flanges] == [
        ("tool0", ("j1", "j2")),
        ("left", ("j1", "j2", "g")),
        ("right", ("j1", "j2", "g")),  # carried by a joint that follows g
    ]


def test_a_named_flange_takes_the_joints_that_lead_to_it(described: Callable[..., RobotDescription]) -> None:
    made = described("revolute", flange="left")

    assert ([joint.name for joint in made.joints], made.locked, made.is_usual) == (["j1", "j2", "g"], {}, False)
    with pytest.raises(InputError, match="flange: unknown link 'middle'"):
        described(flange="middle")


def test_joints_bring_their_limits_or_what_is_missing(described: Callable[..., RobotDescription]) -> None:
    one, two = described().joints

    assert (one.lower, one.upper, one.velocity, one.missing) == (-1.0, 2.0, 3.0, ())
    assert (two.kind, two.lower, two.upper, two.velocity) == ("continuous", None, None, 3.0)
    assert (two.missing, two.reason) == (("lower_deg", "upper_deg"), "is continuous")
    assert described().model is None
    assert described("revolute").model is not None


def test_mimics_and_joints_off_the_chain_are_listed(described: Callable[..., RobotDescription]) -> None:
    made = described()

    assert [(m.name, m.leader, m.ratio, m.offset) for m in made.mimics] == [("h", "g", -2.0, 0.1)]
    assert made.locked == {"g_mm": 10.0}


def test_links_have_the_box_round_all_their_bodies_along_their_own_axes(
    described: Callable[..., RobotDescription],
) -> None:
    """A cylinder with a box that stands on it, and a mesh that is turned: the extent of its corners."""
    made = described("revolute")
    model = read_urdf(Path("arm.urdf"), UrdfOptions(locks_others=True, flange="tool0"))
    rod = next(body for body in model.bodies if body.name == "upper")
    frame = next(link for link in model.links if link.name == "upper")
    assert isinstance(rod.shape, Mesh)
    X_LS = inverse(frame.X_BL) @ rod.X_BS
    corners = rod.shape.vertices @ X_LS[:3, :3].T + X_LS[:3, 3]

    assert [(link.link, link.shapes) for link in made.links] == [("base", ("cylinder", "box")), ("upper", ("mesh",))]
    assert made.links[0].size == pytest.approx([0.2, 0.2, 0.7], abs=1e-12)
    assert made.links[1].size == pytest.approx(np.ptp(corners, axis=0), abs=1e-12)


def test_the_lines_put_the_robot_into_a_cell_as_they_are(
    described: Callable[..., RobotDescription], base_cell: str
) -> None:
    made = described("revolute")
    assert made.cell_lines == ("robots:\n  two-arm:\n    model: arm.urdf\n    flange: tool0\n    locked: {g_mm: 10}\n")
    assert made.model is not None
    Path("c").write_text(base_cell.replace("robots:\n", made.cell_lines), encoding="utf-8")

    robot = load_cell("c").robot("two-arm")

    assert robot.model.joint_names == ("j1", "j2")
    assert np.array_equal(robot.model.X_BF, made.X_BF)
    bodies = zip(robot.model.bodies, made.model.bodies, strict=True)
    assert all(np.array_equal(one.X_BS, other.X_BS) for one, other in bodies)


def test_what_is_missing_is_left_blank_in_the_lines(described: Callable[..., RobotDescription], base_cell: str) -> None:
    made = described()
    assert made.cell_lines.endswith("    limits: {j2: {lower_deg: …, upper_deg: …}}\n")
    filled = made.cell_lines.replace("{lower_deg: …, upper_deg: …}", "{wrap: true}")
    Path("c").write_text(base_cell.replace("robots:\n", filled), encoding="utf-8")

    assert np.isinf(load_cell("c").robot("two-arm").model.upper).tolist() == [False, True]


def test_many_joints_off_the_chain_are_locked_together_in_the_lines(tmp_path: Path) -> None:
    path = tmp_path / "many.urdf"
    names = [f"s{i}" for i in range(13)]
    parts = [element("base"), *(element(n) + joint(f"j{n}", "base", n) for n in ("tool0", *names))]
    path.write_text(text("many", *parts), encoding="utf-8")

    made = describe_robot(str(path))

    assert made.locked == {f"j{name}_deg": 0.0 for name in names}
    assert made.cell_lines.endswith("    flange: tool0\n    locked: {others: zero}\n")


@pytest.mark.parametrize(
    ("names", "flange"),
    [(("a", "b", "c"), "c"), (("arm/ee_link", "b", "c"), "arm/ee_link"), (("a", "tcp", "c"), "tcp")],
)
def test_without_a_usual_flange_a_name_decides_and_then_the_number_of_joints(
    tmp_path: Path, names: tuple[str, str, str], flange: str
) -> None:
    path = tmp_path / "pair.urdf"
    a, b, c = names
    joints = [joint(f"j{index}", *ends) for index, ends in enumerate((("base", a), ("base", b), (b, c)))]
    path.write_text(text("pair", *map(element, ("base", *names)), *joints), encoding="utf-8")

    made = describe_robot(str(path))

    assert (made.flange, made.is_usual) == (flange, False)
    assert {flange.link for flange in made.flanges} == {a, c, flange}


def test_every_bundled_robot_is_described_with_its_bodies() -> None:
    made = describe_robot("kuka_kr6")

    assert made.model is not None
    assert sum(len(link.shapes) for link in made.links) == len(made.model.bodies) == 18
    assert made.cell_lines == "robots:\n  kuka_kr6:\n    model: kuka_kr6\n"
    assert [joint.upper for joint in made.joints] == made.model.upper.tolist()


def test_options_of_urdfs_are_refused_for_other_robots() -> None:
    with pytest.raises(InputError) as caught:
        describe_robot("kuka_kr6", flange="tool0")
    assert str(caught.value) == "kuka_kr6: expected --flange, --package-dir and --xacro-arg with a URDF only"


def test_files_that_lie_elsewhere_come_with_the_folder_to_be_allowed(
    described: Callable[..., RobotDescription], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not any("elsewhere" in remark for remark in described().remarks)

    (tmp_path / "urdf").mkdir()
    (tmp_path / "meshes").mkdir()
    (tmp_path / "cells").mkdir()
    (tmp_path / "rod.stl").rename(tmp_path / "meshes" / "rod.stl")
    moved = (tmp_path / "arm.urdf").read_text(encoding="utf-8").replace("rod.stl", "../meshes/rod.stl")
    (tmp_path / "urdf" / "arm.urdf").write_text(moved, encoding="utf-8")
    monkeypatch.chdir(tmp_path / "cells")

    made = describe_robot("../urdf/arm.urdf")

    assert made.remarks[-1] == f"lies elsewhere: a cell in this folder reads it with --allow-dir {tmp_path.resolve()}"
