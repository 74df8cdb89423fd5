"""Masses of links as files state them: in the base frame, merged, and only where the cell asks for those of a URDF."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import joint, placed

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.robots.joint_table import read_robot_table
from cellplan.files.robots.urdf.load import UrdfOptions, load_urdf
from cellplan.geometry.transforms import pose
from cellplan.model.robot.inertia import CarriedMass, LinkInertia, merged
from cellplan.model.robot.robot import BASE, RobotModel, on_rail

BALL = '<inertial><mass value="{m}"/><origin xyz="{x} 0 0"{rpy}/><inertia {i}/></inertial>'
ROUND = 'ixx="0.1" iyy="0.2" izz="0.25"'
TABLE = """\
robot: arm
joints:
  A1: {type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 400], lower_deg: -90, upper_deg: 90, velocity_deg_s: 90,
    torque_nm: 50}
  rail: {type: prismatic, axis: [0, 1, 0], lower_mm: -500, upper_mm: 1500, velocity_mm_s: 800, force_n: 900}
flange: {xyz_mm: [1000, 0, 400]}
inertias:
  source: a scale
  links:
    base: {mass_kg: 9, centre_mm: [0, 0, 50], inertia_kg_m2: [0.1, 0, 0, 0.1, 0, 0.1]}
    A1: {mass_kg: 4, centre_mm: [100, 0, 0], inertia_kg_m2: [1, 0.1, 0.2, 2, 0.3, 2.5],
      at: {xyz_mm: [0, 0, 400], rpy_deg: [0, 0, 90]}}
"""
CELL = """\
cellplan: 1
name: c
robots:
  a: {model: arm.yaml, start_deg: [0]%s}
part: {geometry: {sphere: {radius_mm: 10}}, at: {xyz_mm: [900, 0, 400]}}
tasks: {t: {robot: a, path: {circle: {radius_mm: 20, plane: xy}}, tool_axis: -z, axes: [x, y]}}
motion: {duration_s: 1}
"""

LINK = "{mass_kg: 1, centre_mm: [0, 0, 0], inertia_kg_m2: [1, 0, 0, 1, 0, 1]}"


def ball(*, mass: float = 2.0, x: float = 0.1, turn: str = "", inertia: str = ROUND) -> str:
    return BALL.format(m=mass, x=x, rpy=turn, i=inertia)


def urdf(folder: Path, tip: str, end: str = "", effort: str = "12", **options: bool) -> RobotModel:
    text = (
        '<robot name="rig"><link name="base"/>\n'
        f'<link name="tip">{tip}</link>\n<link name="end">{end}</link>\n'
        '<joint name="a1" type="revolute"><parent link="base"/><child link="tip"/><origin xyz="0 0 1"/>'
        f'<axis xyz="0 0 1"/><limit lower="-1" upper="2" velocity="3" effort="{effort}"/></joint>\n'
        '<joint name="to" type="fixed"><parent link="tip"/><child link="end"/><origin xyz="1 0 0"/></joint></robot>\n'
    )
    (folder / "r.urdf").write_text(text, encoding="utf-8")
    robot = load_urdf(folder / "r.urdf", UrdfOptions(inertias=options.get("inertias", True)))
    assert any("<inertial>" in remark for remark in robot.remarks) is not options.get("inertias", True)
    return robot.model


def test_a_urdf_has_masses_and_torques_where_the_cell_asks_for_them(tmp_path: Path) -> None:
    model = urdf(tmp_path, ball(turn=' rpy="0 0 1.5707963267948966"'))
    (mass,) = model.inertias or ()
    assert (mass.link, mass.mass, model.joints[0].torque) == (0, 2.0, 12.0)
    np.testing.assert_allclose(mass.centre_B, [0.1, 0.0, 1.0])
    np.testing.assert_allclose(mass.inertia_B, np.diag([0.2, 0.1, 0.25]), atol=1e-15)  # a quarter turn swaps x and y
    silent = urdf(tmp_path, ball(), inertias=False)
    assert (silent.inertias, silent.joints[0].torque) == (None, None)


def test_links_that_move_together_are_one_mass(tmp_path: Path) -> None:
    (mass,) = urdf(tmp_path, ball(mass=2.0, x=0.0), ball(mass=2.0, x=0.0)).inertias or ()
    assert mass.mass == 4.0
    np.testing.assert_allclose(mass.centre_B, [0.5, 0.0, 1.0])
    np.testing.assert_allclose(mass.inertia_B, np.diag([0.2, 0.4 + 1.0, 0.5 + 1.0]))  # 2 x 2 kg, 0.5 m off


def test_an_effort_of_zero_is_unknown(tmp_path: Path) -> None:
    assert urdf(tmp_path, ball(), effort="0").joints[0].torque is None


@pytest.mark.parametrize(
    ("tip", "message"),
    [
        (
            '<inertial><mass value="1"/></inertial>',
            "r.urdf:2: link 'tip': expected <inertial> with <mass> and <inertia>",
        ),
        (ball(inertia='ixx="a" iyy="1" izz="1"'), "r.urdf:2: link 'tip': expected a finite number in 'ixx', got 'a'"),
        (ball() + ball(), "r.urdf:2: link 'tip': expected one <inertial>, got 2"),
    ],
)
def test_masses_that_cannot_be_read_have_their_line(tmp_path: Path, tip: str, message: str) -> None:
    with pytest.raises(InputError, match=r"^r\.urdf:2: ") as caught:
        urdf(tmp_path, tip)
    assert str(caught.value) == message
    assert urdf(tmp_path, tip, inertias=False).inertias is None


def test_a_table_states_masses_in_any_frame_and_torques(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(TABLE, encoding="utf-8")
    model = read_robot_table(tmp_path / "arm.yaml")
    foot, arm = model.inertias or ()
    assert (foot.link, foot.mass, arm.link, arm.mass, model.inertia_source) == (BASE, 9.0, 0, 4.0, "a scale")
    np.testing.assert_allclose(arm.centre_B, [0.0, 0.1, 0.4], atol=1e-15)
    turned = [[2.0, -0.1, -0.3], [-0.1, 1.0, 0.2], [-0.3, 0.2, 2.5]]  # x to y, y to -x
    np.testing.assert_allclose(arm.inertia_B, turned, atol=1e-15)
    assert [it.torque for it in model.joints] == [50.0, 900.0]


def load(folder: Path, more: str, table: str = TABLE) -> RobotModel:
    (folder / "arm.yaml").write_text(table, encoding="utf-8")
    text = CELL % more
    (folder / "c.yaml").write_text(text.replace("start_deg: [0]", "start: {A1_deg: 0, rail_mm: 0}"), encoding="utf-8")
    return load_cell(folder / "c.yaml").robots[0].model


def test_a_cell_states_masses_in_place_of_the_file_and_tightens_torques(tmp_path: Path) -> None:
    stated = "{source: mine, links: {A1: {mass_kg: 1, centre_mm: [0, 0, 0], inertia_kg_m2: [1, 0, 0, 1, 0, 1]}}}"
    model = load(tmp_path, f", inertias: {stated}, limits: {{A1: {{torque_nm: 20}}, rail: {{force_n: 100}}}}")
    (mass,) = model.inertias or ()
    assert (mass.mass, model.inertia_source) == (1.0, "mine")
    assert [it.torque for it in model.joints] == [20.0, 100.0]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (", inertias: urdf", "c.yaml:4: robots.a.inertias: expected masses of its links, got urdf, which applies"),
        (
            ", limits: {A1: {torque_nm: 60}}",
            "c.yaml:4: robots.a.limits.A1.torque_nm: expected at most 50, the limit",
        ),
        (", limits: {rail: {force_n: 1e3}}", "c.yaml:4: robots.a.limits.rail.force_n: expected at most 900, the limit"),
        (
            ", limits: {rail: {torque_nm: 5}}",
            "c.yaml:4: robots.a.limits.rail: expected limits in mm, the joint is",
        ),
        (
            ", inertias: {links: {A2: {mass_kg: 1, centre_mm: [0, 0, 0], inertia_kg_m2: [1, 0, 0, 1, 0, 1]}}}",
            "c.yaml:4: rob",
        ),
        (
            ", inertias: {links: {A1: {mass_kg: 0, centre_mm: [0, 0, 0], inertia_kg_m2: [1, 0, 0, 1, 0, 1]}}}",
            "c.yaml:4: rob",
        ),
    ],
)
def test_what_a_cell_may_not_say_is_refused_at_its_key(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, more)
    assert message in str(caught.value)


def test_a_link_that_does_not_exist_is_refused_in_a_table(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"inertias\.links\.A7: expected a link of the robot"):
        load(tmp_path, "", TABLE.replace("    A1: {mass", "    A7: {mass"))


def test_on_a_rail_the_foot_rides_along() -> None:
    foot = LinkInertia(link=BASE, mass=5.0, centre_B=np.zeros(3), inertia_B=np.eye(3))
    arm = placed(
        "a",
        RobotModel(
            name="m",
            source="t",
            joints=(joint("a", -1),),
            flange_link=0,
            X_BF=np.eye(4),
            bodies=(),
            inertias=(foot, replace(foot, link=0, mass=2.0)),
        ),
    )
    assert [it.link for it in on_rail(arm.model, joint("rail", -1, slides=True)).inertias or ()] == [0, 1]


def test_a_load_keeps_its_place_when_it_counts_as_part_of_a_link() -> None:
    load = CarriedMass(mass=2.0, centre_F=np.array([0.0, 0.0, 0.1]), inertia_F=np.diag([1.0, 2.0, 3.0]))
    mass = load.on_link(3, pose((1.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0)))
    np.testing.assert_allclose(mass.centre_B, [1.1, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(mass.inertia_B, np.diag([3.0, 2.0, 1.0]), atol=1e-15)
    assert merged((mass,)) == (mass,)
