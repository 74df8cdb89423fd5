"""Robots after their makers' published figures: kinematics by second opinions, reach, bodies against real meshes."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import trimesh
from body_accuracy import compare, distance_to, mesh_points, skin_points

from cellplan.files.robots import joint_table
from cellplan.files.robots.joint_table import read_robot_table
from cellplan.files.robots.urdf.load import read_urdf
from cellplan.geometry.transforms import Array, inverse, pose, pose_from, rotation_about, transform_points
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import BASE, RobotModel
from cellplan.scene.kinematics.reach import arm_reach
from cellplan.scene.kinematics.screw_chain import ScrewChain

SAME = 1e-9  # [m], [-]: two chains of double products over ten frames
TOUCHING = 0.012  # [m] bearing gap between the bodies of neighbouring links
X, Z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
QUARTER = 0.5 * np.pi

URDFS = {
    "kuka_kr16_2": "kuka_kr16_2",
    "abb_irb1600_8_145": "abb_irb1600_8_145",
    "staubli_rx160": "staubli_rx160",
    "motopos_d500": "motoman_motopos_d500",
}
ARMS = (
    *("kuka_kr16_2", "abb_irb1600_8_145", "staubli_rx160", "kuka_lbr_iiwa_14_r820", "kuka_lbr_iiwa_7_r800"),
    *("franka_panda", "ur5e", "ur10e"),
)
NAMES = (*ARMS, "motopos_d500", "rail_kl100_2")
# Postures in which such arms usually stand and work, in [deg] or [mm]: upright or stretched, bent, folded to the side.
POSTURES = {
    "kuka_kr16_2": [[0, 0, 0, 0, 0, 0], [0, -90, 90, 0, 90, 0], [30, -40, 110, 40, 60, 20]],
    "abb_irb1600_8_145": [[0, 0, 0, 0, 0, 0], [0, 30, 10, 0, 50, 0], [30, -40, 30, 60, -80, 20]],
    "staubli_rx160": [[0, 0, 0, 0, 0, 0], [0, 20, 100, 0, 60, 0], [30, -40, 120, 60, -80, 20]],
    "kuka_lbr_iiwa_14_r820": [[0] * 7, [0, 30, 0, -90, 0, 60, 0], [40, 60, 30, 100, 30, -90, 20]],
    "kuka_lbr_iiwa_7_r800": [[0] * 7, [0, 30, 0, -90, 0, 60, 0], [40, 60, 30, 100, 30, -90, 20]],
    "franka_panda": [[0, -45, 0, -135, 0, 90, 45], [30, 40, 20, -70, 10, 120, 0], [0, 0, 0, -4, 0, 30, 0]],
    "ur5e": [[0] * 6, [0, -90, 0, -90, 0, 0], [0, -60, -110, -100, 90, 0], [40, -120, 110, -80, -90, 0]],
    "ur10e": [[0] * 6, [0, -90, 0, -90, 0, 0], [0, -60, -110, -100, 90, 0], [40, -120, 110, -80, -90, 0]],
    "motopos_d500": [[0, 0], [90, 30], [-90, 45], [120, 0]],
    "rail_kl100_2": [[-1000], [0], [1000]],
}


class Row(NamedTuple):
    """Denavit-Hartenberg parameters of one joint, lengths in [m]."""

    a: float
    d: float
    alpha: float


# As Universal Robots publishes them: turn by theta, move by d along z, by a along x, turn by alpha about x.
UR5E = (
    Row(0, 0.1625, QUARTER),
    Row(-0.425, 0, 0),
    Row(-0.3922, 0, 0),
    Row(0, 0.1333, QUARTER),
    Row(0, 0.0997, -QUARTER),
    Row(0, 0.0996, 0),
)
UR10E = (
    Row(0, 0.1807, QUARTER),
    Row(-0.6127, 0, 0),
    Row(-0.57155, 0, 0),
    Row(0, 0.17415, QUARTER),
    Row(0, 0.11985, -QUARTER),
    Row(0, 0.11655, 0),
)
# LBR iiwa 7 R800, in the same order, as published with 340, 400, 400 and 126 mm; the R820 has 360 and 420 mm.
IIWA_ALPHAS = (-QUARTER, QUARTER, QUARTER, -QUARTER, -QUARTER, QUARTER, 0.0)
IIWA_7 = tuple(Row(0, d, alpha) for d, alpha in zip((0.34, 0, 0.4, 0, 0.4, 0, 0.126), IIWA_ALPHAS, strict=True))
IIWA_14 = tuple(Row(0, d, alpha) for d, alpha in zip((0.36, 0, 0.42, 0, 0.4, 0, 0.126), IIWA_ALPHAS, strict=True))
# Panda as Franka publishes it, in Craig's order: move by a along x, turn by alpha about x, turn by theta, move by d.
PANDA = (
    Row(0, 0.333, 0),
    Row(0, 0, -QUARTER),
    Row(0, 0.316, QUARTER),
    Row(0.0825, 0, QUARTER),
    Row(-0.0825, 0.384, -QUARTER),
    Row(0, 0, QUARTER),
    Row(0.088, 0, QUARTER),
    Row(0, 0.107, 0),  # flange
)


def standard(rows: tuple[Row, ...], q: Array) -> Array:
    X_BF = np.eye(4)
    for row, angle in zip(rows, q, strict=True):
        X_BF = (
            X_BF @ pose_from(rotation_about(Z, angle), row.d * Z) @ pose_from(rotation_about(X, row.alpha), row.a * X)
        )
    return X_BF


def craig(rows: tuple[Row, ...], q: Array) -> Array:
    X_BF = np.eye(4)
    for row, angle in zip(rows, [*q, 0.0], strict=True):
        X_BF = (
            X_BF @ pose_from(rotation_about(X, row.alpha), row.a * X) @ pose_from(rotation_about(Z, angle), row.d * Z)
        )
    return X_BF


PUBLISHED = {
    "ur5e": (standard, UR5E),
    "ur10e": (standard, UR10E),
    "kuka_lbr_iiwa_7_r800": (standard, IIWA_7),
    "kuka_lbr_iiwa_14_r820": (standard, IIWA_14),
    "franka_panda": (craig, PANDA),
}


load_bundled = cache(joint_table.load_bundled)


def chain(model: RobotModel) -> ScrewChain:
    tool, weights = Tool(X_FT=np.eye(4), bodies=()), np.ones(len(model.joints))
    return ScrewChain(Robot(name=model.name, model=model, X_WB=np.eye(4), tool=tool, start=None, weights=weights))


def configurations(model: RobotModel, count: int = 20) -> Array:
    return np.random.default_rng(5).uniform(model.lower, model.upper, size=(count, len(model.joints)))


@pytest.mark.parametrize("name", URDFS)
def test_the_flange_is_where_the_description_has_it(name: str, shared_robots: Path) -> None:
    model = load_bundled(name)
    real = read_urdf(shared_robots / URDFS[name] / f"{URDFS[name]}.urdf")
    q = configurations(model)

    np.testing.assert_allclose(chain(model).flange_poses(q), chain(real).flange_poses(q), atol=SAME)


@pytest.mark.parametrize("name", URDFS)
def test_ranges_and_speeds_are_those_of_the_description(name: str, shared_robots: Path) -> None:
    model = load_bundled(name)
    real = read_urdf(shared_robots / URDFS[name] / f"{URDFS[name]}.urdf")
    for ours, theirs in zip(model.joints, real.joints, strict=True):
        figures = np.degrees([[joint.lower, joint.upper, joint.velocity] for joint in (ours, theirs)])
        np.testing.assert_allclose(*figures, atol=0.01)  # [deg] the descriptions round radians to four digits


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_flange_is_where_the_published_parameters_have_it(name: str) -> None:
    model = load_bundled(name)
    convention, rows = PUBLISHED[name]
    q = configurations(model)

    np.testing.assert_allclose(chain(model).flange_poses(q), [convention(rows, entry) for entry in q], atol=SAME)


def test_the_panda_has_the_limits_that_its_maker_gives_in_radians() -> None:
    joints = load_bundled("franka_panda").joints
    figures = np.array([[j.lower, j.upper, j.velocity, j.acceleration, j.jerk] for j in joints]).T
    lower, upper, velocity, acceleration, jerk = figures
    np.testing.assert_allclose(upper, [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973], atol=1e-6)
    np.testing.assert_allclose(lower, [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973], atol=1e-6)
    np.testing.assert_allclose(velocity, [2.175] * 4 + [2.61] * 3, rtol=1e-6)
    np.testing.assert_allclose(acceleration, [15, 7.5, 10, 12.5, 15, 20, 20], rtol=1e-5)
    np.testing.assert_allclose(jerk, [7500, 3750, 5000, 6250, 7500, 10000, 10000], rtol=1e-5)


@pytest.mark.parametrize("name", [name for name in ARMS if name != "ur5e"])
def test_the_arm_reaches_as_far_as_its_maker_publishes(name: str) -> None:
    model = load_bundled(name)
    assert model.reach is not None
    if model.reach.to is None:  # then the published point lies between the wrist and the flange
        wrist = replace(model, X_BF=pose(model.joints[3].point_B, np.zeros(3)), flange_link=3)
        assert arm_reach(wrist) <= model.reach.distance_mm.si <= arm_reach(model)
        return
    if model.reach.to != "flange":
        index = model.joint_names.index(model.reach.to)
        model = replace(model, X_BF=pose(model.joints[index].point_B, np.zeros(3)), flange_link=index)
    assert arm_reach(model) == pytest.approx(model.reach.distance_mm.si, abs=5e-4)  # rounded to millimetres


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_source(name: str) -> None:
    model = load_bundled(name)
    assert model.name == name
    assert "read 2026-11-22" in model.source
    assert model.body_accuracy is not None
    assert model.body_accuracy.source.startswith(("measured on", "assumed: "))
    assert model.payload is None or model.payload.source != "not stated"
    assert model.reach is None or model.reach.source != "not stated"


def test_a_reach_to_an_unknown_joint_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    joint = "{type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -1, upper_deg: 1, velocity_deg_s: 1}"
    path.write_text(
        f"robot: arm\njoints: {{A1: {joint}}}\nflange: {{xyz_mm: [0, 0, 1]}}\nreach: {{distance_mm: 5, to: A5}}\n"
    )
    with pytest.raises(Exception, match=r"arm\.yaml:4: reach\.to: expected flange or a joint"):
        read_robot_table(path)


# Bodies


def distance_to_link(model: RobotModel, link: int, points_B: Array) -> Array:
    bodies = [body for body in model.bodies if body.link == link]
    result = [distance_to(body.shape, transform_points(inverse(body.X_BS), points_B)) for body in bodies]
    nearest: Array = np.min(result, axis=0)
    return nearest


@cache
def skin(model: RobotModel, link: int) -> Array:
    return np.concatenate([skin_points(body, 500) for body in model.bodies if body.link == link])


@pytest.mark.parametrize("name", NAMES)
def test_every_link_has_bodies_that_meet_its_neighbours(name: str) -> None:
    model = load_bundled(name)
    assert {body.link for body in model.bodies} == {BASE, *range(len(model.joints))}
    for link, following in pairwise(range(BASE, len(model.joints))):
        gap = distance_to_link(model, following, skin(model, link)).min()
        assert gap <= TOUCHING, f"links {link} and {following} are {1000 * gap:.0f} mm apart"


@pytest.mark.parametrize("name", NAMES)
def test_the_last_body_ends_at_the_flange_plane(name: str) -> None:
    model = load_bundled(name)
    beyond = transform_points(inverse(model.X_BF), skin(model, len(model.joints) - 1))[:, 2].max()
    assert abs(beyond) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_no_links_but_neighbours_touch_in_usual_postures(name: str) -> None:
    model = load_bundled(name)
    links = range(BASE, len(model.joints))
    surfaces = {link: skin(model, link) for link in links}
    for q in np.array(POSTURES[name]) / np.array([joint.display_unit.scale for joint in model.joints]):
        D = chain(model).link_displacements(q[None])[0]
        for link in links:
            surface = transform_points(D[link + 1], surfaces[link])
            for other in links:
                if abs(other - link) > 1:
                    gap = distance_to_link(model, other, transform_points(inverse(D[other + 1]), surface)).min()
                    assert gap > 0.005, (link, other)  # [m] default clearance


@pytest.mark.parametrize("name", NAMES)
def test_the_reference_page_shows_the_figures_of_the_table(name: str, repository: Path) -> None:
    model = load_bundled(name)
    page = (repository / "docs" / "reference" / "robots.md").read_text(encoding="utf-8")
    section = page[page.index(f"\n`{name}`. ") :]
    section = section[: section.index("\nSources: ")]
    for joint in model.joints:
        figures = np.array([joint.lower, joint.upper, joint.velocity]) * joint.display_unit.scale
        assert f"| {joint.name} | {figures[0]:g} | {figures[1]:g} | {figures[2]:g} |" in section
    row = next(row for row in page.splitlines() if row.startswith(f"| `{name}` |"))
    assert model.body_accuracy is not None
    assert f"{model.body_accuracy.accuracy_mm:g} mm, {len(model.bodies)} solids" in row
    assert (repository / "docs" / "images" / f"robot_{name}.png").stat().st_size < 60_000


@pytest.mark.parametrize(
    "name",
    [
        *("kuka_kr16_2", "motopos_d500"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("abb_irb1600_8_145", "staubli_rx160")),
    ],
)
def test_bodies_hold_the_real_robot_as_well_as_they_say(name: str, shared_robots: Path) -> None:
    model = load_bundled(name)
    meshes = mesh_points(shared_robots / URDFS[name] / f"{URDFS[name]}.urdf", model, is_visual=True, count=3000)
    comparison = compare(model, meshes)
    assert model.body_accuracy is not None
    assert len(comparison) == len(model.joints) + 1
    for row in comparison:
        assert row.outside < model.body_accuracy.accuracy_mm.si <= 0.050, row.link
        assert row.usual < 0.025, row.link  # [m] half of it: a box round a casting with rounded edges
        assert row.fat < 0.040, row.link


def test_accuracy_is_measured_at_the_corner_that_sticks_out_most(tmp_path: Path) -> None:
    """A cube of 200 mm against a cube of 180 mm: the corners lie 10 mm outside in x, y and z."""
    trimesh.creation.box((0.2, 0.2, 0.2)).export(tmp_path / "cube.stl")
    shape = "<geometry><mesh filename='cube.stl'/></geometry>"
    (tmp_path / "cube.urdf").write_text(
        "<robot name='cube'><link name='foot'/><link name='arm'><collision><origin xyz='0.3 0 0'/>"
        f"{shape}</collision></link><joint name='turn' type='revolute'><parent link='foot'/><child link='arm'/>"
        "<axis xyz='0 0 1'/><limit lower='-1' upper='1' velocity='1' effort='1'/></joint></robot>"
    )
    (tmp_path / "cube.yaml").write_text(
        "robot: cube\nflange: {xyz_mm: [0, 0, 1]}\n"
        "joints: {turn: {type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -9, upper_deg: 9,"
        " velocity_deg_s: 1}}\nbodies: [{link: turn, box: {center_mm: [0, 300, 0], size_mm: [180, 180, 180]}}]\n"
    )
    model = read_robot_table(tmp_path / "cube.yaml")

    (row,) = compare(model, mesh_points(tmp_path / "cube.urdf", model, turn=QUARTER))

    assert row.outside == pytest.approx(0.010 * np.sqrt(3.0), abs=1e-6)  # STL: single precision
    assert np.abs(row.place_B - [0.0, 0.3, 0.0]) == pytest.approx([0.1] * 3, abs=1e-6)
    assert row.fat == 0.0
