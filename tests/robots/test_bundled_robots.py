"""The bundled robots say what the tables of Ribeiro 2010 say, and their bodies look like the real arms."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cellplan.files.robots.joint_table import load_bundled
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import Array, inverse, rotation_from_rpy, transform_points
from cellplan.model.cell.cell import Robot, Tool
from cellplan.model.robot.robot import BASE, RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)

# Joint, axis s, point s0 in [mm], lower and upper limit in [deg], speed in [deg/s]: tables 4 to 7, read off the print.
Row = tuple[str, tuple[float, float, float], tuple[float, float, float], float, float, float]
TABLE_4: tuple[Row, ...] = (
    ("A1", Z, (0, 0, 400), -180, 180, 200),
    ("B1", Y, (280, 0, 400), -135, 70, 165),
    ("C1", Y, (920, 0, 400), -120, 150, 150),
    ("D1", X, (1011, 0, 400), -210, 210, 450),
    ("E1", Y, (1500, 0, 400), -123, 123, 450),
    ("F1", X, (1600, 0, 400), -360, 360, 500),
)
TABLE_5: tuple[Row, ...] = (
    ("A2", Z, (0, 0, 422), -185, 185, 156),
    ("B2", Y, (260, 0, 675), -155, 35, 156),
    ("C2", Y, (260, 0, 1355), -130, 154, 156),
    ("D2", X, (662, 0, 1320), -350, 350, 343),
    ("E2", Y, (930, 0, 1320), -130, 130, 362),
    ("F2", X, (1045, 0, 1320), -350, 350, 659),
)
TABLE_6: tuple[Row, ...] = (
    ("A3", Z, (0, 0, 124.5), -180, 180, 180),
    ("B3", Y, (150, -252.5, 486.5), -63, 136, 180),
    ("C3", Y, (150, -214.5, 961.5), -235, 55, 180),
    ("D3", X, (464, 0, 961.5), -200, 200, 320),
    ("E3", Y, (750, 0, 961.5), -115, 115, 400),
    ("F3", X, (815, 0, 961.5), -400, 400, 460),
)
TABLE_7_PRINTED: tuple[Row, ...] = (
    ("A4", Z, (0, 0, 249), -160, 160, 180),
    ("B4", Y, (0, 0, 420), -137.5, 137.5, 180),
    ("C4", Y, (0, 0, 870), -150, 150, 180),
    ("D4", X, (0, 0, 1068), -270, 270, 320),
    ("E4", Y, (0, 0, 1520), -105, 115, 400),
    ("F4", X, (0, 0, 1605), -270, 270, 460),
)
TABLE_7_CORRECTED = tuple((row[0], Z, *row[2:]) if row[0] in {"D4", "F4"} else row for row in TABLE_7_PRINTED)
TABLES = {
    "reis_rv20_16": TABLE_4,
    "kuka_kr6": TABLE_5,
    "abb_irb1600": TABLE_6,
    "staubli_rx90l": TABLE_7_CORRECTED,
    "staubli_rx90l_as_printed": TABLE_7_PRINTED,
}
SIX_AXES = ("reis_rv20_16", "kuka_kr6", "abb_irb1600", "staubli_rx90l")
NAMES = (*TABLES, "planar_3r")

ROUNDING = 1e-12  # [m] and [rad] conversion from mm and degrees
TOUCHING = 0.012  # [m] bearing gap between the bodies of neighbouring links


def placed(model: RobotModel) -> Robot:
    tool = Tool(X_FT=np.eye(4), bodies=())
    weights = np.ones(len(model.joints))
    return Robot(name=model.name, model=model, X_WB=np.eye(4), tool=tool, start=None, weights=weights)


def flange_at(model: RobotModel, *configuration_deg: float) -> Array:
    flange: Array = ScrewChain(placed(model)).flange_poses(np.radians([configuration_deg]))[0]
    return flange


def distance_to(shape: Solid, points: Array) -> Array:
    """Signed distance of points in the shape's own frame, negative inside (closed form)."""
    match shape:
        case Box(size):
            beyond = np.abs(points) - 0.5 * np.asarray(size)
        case Cylinder(radius, length):
            beyond = np.stack(
                [np.hypot(points[:, 0], points[:, 1]) - radius, np.abs(points[:, 2]) - 0.5 * length], axis=1
            )
        case Capsule(radius, length):
            along = np.maximum(np.abs(points[:, 2]) - 0.5 * length, 0.0)
            return np.linalg.norm(np.column_stack([points[:, :2], along]), axis=1) - radius
        case Sphere(radius):
            return np.linalg.norm(points, axis=1) - radius
        case _:
            raise AssertionError(shape)
    outside: Array = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    return outside


def distance_to_link(model: RobotModel, link: int, points_B: Array) -> Array:
    """Signed distance of points in B to the union of a link's bodies at the reference configuration."""
    distances = [
        distance_to(body.shape, transform_points(inverse(body.X_BS), points_B))
        for body in model.bodies
        if body.link == link
    ]
    nearest: Array = np.min(distances, axis=0)
    return nearest


def surface_of_link(model: RobotModel, link: int) -> Array:
    """Points in B spread over the outer surface of a link's bodies at the reference configuration."""
    rng = np.random.default_rng(7)
    results = []
    for body in model.bodies:
        if body.link == link:
            mesh = tessellate(body.shape, 24)
            triangles = mesh.vertices[mesh.faces]
            areas = np.linalg.norm(
                np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
            )
            chosen = triangles[rng.choice(len(triangles), size=800, p=areas / areas.sum())]
            shares = rng.dirichlet(np.ones(3), size=800)
            results.append(transform_points(body.X_BS, np.einsum("nij,ni->nj", chosen, shares)))
    points = np.concatenate(results)
    outer: Array = points[distance_to_link(model, link, points) > -1e-6]
    return outer


@pytest.mark.parametrize(("name", "table"), TABLES.items())
def test_joints_are_those_of_the_printed_table(name: str, table: tuple[Row, ...]) -> None:
    joints = load_bundled(name).joints
    assert [joint.name for joint in joints] == [row[0] for row in table]
    for joint, (_, axis, point, lower, upper, speed) in zip(joints, table, strict=True):
        np.testing.assert_allclose(joint.axis_B, axis, atol=ROUNDING)
        np.testing.assert_allclose(joint.point_B, np.array(point) / 1000.0, atol=ROUNDING)
        figures = np.degrees([joint.lower, joint.upper, joint.velocity])
        np.testing.assert_allclose(figures, [lower, upper, speed], rtol=ROUNDING)
        assert joint.is_revolute


@pytest.mark.parametrize("name", NAMES)
def test_every_joint_is_carried_by_the_one_before_it(name: str) -> None:
    model = load_bundled(name)
    assert [joint.parent for joint in model.joints] == [BASE, *range(len(model.joints) - 1)]
    assert model.flange_link == len(model.joints) - 1


@pytest.mark.parametrize("name", NAMES)
def test_model_bears_the_name_of_its_file_and_a_source(name: str) -> None:
    model = load_bundled(name)
    assert model.name == name
    assert "Ribeiro 2010" in model.source


@pytest.mark.parametrize("name", TABLES)
def test_flange_stands_on_the_last_axis_and_looks_along_it(name: str) -> None:
    model = load_bundled(name)
    last = model.joints[-1]
    np.testing.assert_allclose(model.X_BF[:3, 3], last.point_B, atol=ROUNDING)
    np.testing.assert_allclose(model.X_BF[:3, 2], last.axis_B, atol=ROUNDING)


@pytest.mark.parametrize("name", SIX_AXES)
def test_wrist_axes_meet_in_one_point(name: str) -> None:
    model = load_bundled(name)
    fourth, wrist, sixth = model.joints[3:]
    for joint in (fourth, sixth):
        away = np.cross(joint.axis_B, wrist.point_B - joint.point_B)
        np.testing.assert_allclose(away, 0.0, atol=ROUNDING)


def test_printed_staubli_differs_from_the_corrected_one_in_two_axes_only() -> None:
    corrected, printed = load_bundled("staubli_rx90l"), load_bundled("staubli_rx90l_as_printed")
    different = [
        a.name for a, b in zip(corrected.joints, printed.joints, strict=True) if not np.array_equal(a.axis_B, b.axis_B)
    ]
    assert different == ["D4", "F4"]


@pytest.mark.parametrize(
    ("name", "configuration_deg", "expected_mm"),
    [
        ("reis_rv20_16", (0, 0, 0, 0, 0, 0), (1600, 0, 400)),
        # upper arm upright, forearm level again: 280 + 680 forward, 640 up
        ("reis_rv20_16", (0, -90, 90, 0, 0, 0), (960, 0, 1040)),
        ("reis_rv20_16", (90, -90, 90, 0, 90, 0), (0, 280 + 580, 1040 - 100)),
        ("kuka_kr6", (0, 0, 0, 0, 0, 0), (1045, 0, 1320)),
        # upper arm level backwards, forearm straight up, its offset of 35 to the front
        ("kuka_kr6", (0, -90, 0, 0, 0, 0), (260 - 645, 0, 675 + 785)),
        ("kuka_kr6", (-90, 0, 0, 0, 90, 0), (0, -930, 1320 - 115)),
        ("abb_irb1600", (0, 0, 0, 0, 0, 0), (815, 0, 961.5)),
        ("abb_irb1600", (0, 90, -90, 0, 0, 0), (150 + 475 + 665, 0, 486.5)),
        ("abb_irb1600", (0, 0, 0, 90, 90, 0), (750, 65, 961.5)),
        ("staubli_rx90l", (0, 0, 0, 0, 0, 0), (0, 0, 1605)),
        ("staubli_rx90l", (0, 90, 0, 0, 0, 0), (1185, 0, 420)),
        ("staubli_rx90l", (0, 0, 90, 90, 90, 0), (650, 85, 870)),
        ("planar_3r", (0, 0, 0), (1100, 0, -20)),
        ("planar_3r", (90, 90, 90), (-400, 500 - 200, -20)),
    ],
)
def test_flange_position_in_closed_form(
    name: str, configuration_deg: tuple[float, ...], expected_mm: tuple[float, ...]
) -> None:
    flange = flange_at(load_bundled(name), *configuration_deg)
    np.testing.assert_allclose(1000.0 * flange[:3, 3], expected_mm, atol=1e-9)  # rounding of metres


@pytest.mark.parametrize("name", NAMES)
def test_every_robot_says_how_good_its_bodies_are_and_who_says_so(name: str) -> None:
    stated = load_bundled(name).body_accuracy
    assert stated is not None
    assert stated.source != "not stated"


@pytest.mark.parametrize("name", NAMES)
def test_every_link_has_a_body(name: str) -> None:
    model = load_bundled(name)
    assert {body.link for body in model.bodies} == {BASE, *range(len(model.joints))}


@pytest.mark.parametrize("name", [*SIX_AXES, "planar_3r"])
def test_bodies_of_neighbouring_links_meet_at_the_joint(name: str) -> None:
    model = load_bundled(name)
    for link, following in pairwise(range(BASE, len(model.joints))):
        gap = distance_to_link(model, following, surface_of_link(model, link)).min()
        assert gap <= TOUCHING, f"links {link} and {following} are {1000 * gap:.0f} mm apart"


@pytest.mark.parametrize("name", NAMES)
def test_last_body_ends_at_the_flange_plane(name: str) -> None:
    model = load_bundled(name)
    last = surface_of_link(model, len(model.joints) - 1)
    beyond = transform_points(inverse(model.X_BF), last)[:, 2].max()
    assert -0.006 <= beyond <= 1e-9  # [m] up to the thickness of a seal behind the plane, never through it


@pytest.mark.parametrize("name", SIX_AXES)
def test_no_body_but_the_last_comes_near_a_tool_at_any_wrist_angle(name: str) -> None:
    model = load_bundled(name)
    plate = np.array([[x, y, 0.0] for x in np.linspace(-0.03, 0.03, 7) for y in np.linspace(-0.03, 0.03, 7)])
    forearm = 3
    for angle in np.linspace(model.lower[4], model.upper[4], 13):
        q = np.zeros((1, 6))
        q[0, 4] = angle
        X_WF = ScrewChain(placed(model)).flange_poses(q)[0]
        assert distance_to_link(model, forearm, transform_points(X_WF, plate)).min() > 0.005  # [m] default clearance


@pytest.mark.parametrize("name", NAMES)
def test_no_links_but_neighbours_touch_at_the_reference_configuration(name: str) -> None:
    model = load_bundled(name)
    links = range(BASE, len(model.joints))
    for link in links:
        surface = surface_of_link(model, link)
        for other in links:
            if abs(other - link) > 1:
                assert distance_to_link(model, other, surface).min() > 0.005  # [m] default clearance


# The real meshes, moved to the reference configuration of the tables. Lengths in [mm] until they are compared.


def vertices_of(
    folder: Path, link: str, *, at: tuple[float, float, float] = (0, 0, 0), R: Array | None = None
) -> Array:
    """Vertices of a collision mesh, turned by R and moved."""
    mesh = trimesh.load(folder / "meshes" / "collision" / f"{link}.stl", force="mesh")
    vertices = 1000.0 * np.asarray(mesh.vertices, dtype=float)
    return (vertices if R is None else vertices @ R.T) + np.array(at)


def kuka_vertices(shared_robots: Path) -> dict[str, Array]:
    """KR 16-2 up to the elbow, turned to the upright configuration, and the wrist of the KR 5 arc in its place."""
    arm, wrist = shared_robots / "kuka_kr16_2", shared_robots / "kuka_kr5_arc"
    upright = rotation_from_rpy([0.0, -0.5 * np.pi, 0.0])  # the description's zero has the upper arm level
    lying = np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]])
    fork = vertices_of(wrist, "link_4", R=lying, at=(0, 0, 1320))
    fork[:, 0] = np.interp(fork[:, 0], [351, 500, 700], [662, 810, 1010])  # the tube is as long as on the KR 6
    return {
        "base": vertices_of(arm, "base_link"),
        "A2": vertices_of(arm, "link_1", at=(0, 0, 675)),
        "B2": vertices_of(arm, "link_2", R=upright, at=(260, 0, 675)),
        "C2": vertices_of(arm, "link_3", at=(260, 0, 1355)),
        "D2": fork,
        "E2": vertices_of(wrist, "link_5", R=np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]), at=(930, 0, 1320)),
    }


def abb_vertices(shared_robots: Path) -> dict[str, Array]:
    """IRB 1600-8/1.45 with its upper arm shortened from 700 to 475 mm, the length of the 1.2 m version."""
    folder = shared_robots / "abb_irb1600_8_145"
    upper_arm = vertices_of(folder, "link_2", at=(150, 0, 0))
    upper_arm[:, 2] = np.interp(upper_arm[:, 2], [-100, 0, 700, 800], [386.5, 486.5, 961.5, 1061.5])
    return {
        "base": vertices_of(folder, "base_link"),
        "A3": vertices_of(folder, "link_1"),
        "B3": upper_arm,
        "C3": vertices_of(folder, "link_3", at=(150, 0, 961.5)),
        "D3": vertices_of(folder, "link_4", at=(450, 0, 961.5)),
        "E3": vertices_of(folder, "link_5", at=(750, 0, 961.5)),
    }


REAL_ARMS = {"kuka_kr6": kuka_vertices, "abb_irb1600": abb_vertices}


@pytest.mark.parametrize("name", REAL_ARMS)
def test_bodies_hold_the_real_arm(name: str, shared_robots: Path) -> None:
    model = load_bundled(name)
    for link, vertices in zip(range(BASE, 6), REAL_ARMS[name](shared_robots).values(), strict=False):
        missed = np.maximum(distance_to_link(model, link, vertices / 1000.0), 0.0)
        assert np.percentile(missed, 95) < 0.030, f"link {link}"  # [m] half the width of a forearm
        assert model.body_accuracy is not None
        assert missed.max() < model.body_accuracy.accuracy_mm.si <= 0.050, f"link {link}"


@pytest.mark.parametrize("name", REAL_ARMS)
def test_bodies_are_not_fatter_than_the_real_arm(name: str, shared_robots: Path) -> None:
    model = load_bundled(name)
    rng = np.random.default_rng(3)
    normals = rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for link, vertices in zip(range(BASE, 6), REAL_ARMS[name](shared_robots).values(), strict=False):
        hull = (vertices / 1000.0 @ normals.T).max(axis=0)
        beyond = np.maximum((surface_of_link(model, link) @ normals.T - hull).max(axis=1), 0.0)
        assert np.percentile(beyond, 95) < 0.050, f"link {link}"  # [m] corners of boxes round rounded castings
        assert beyond.mean() < 0.012, f"link {link}"


def test_the_flange_of_the_abb_is_as_good_as_it_says(shared_robots: Path) -> None:
    model = load_bundled("abb_irb1600")
    disc = next(body for body in model.bodies if body.name == "flange")
    vertices = vertices_of(shared_robots / "abb_irb1600_8_145", "link_6", at=(815, 0, 961.5)) / 1000.0
    before_the_wrist = vertices[vertices[:, 0] > 0.786]  # behind it the shaft runs inside the wrist
    missed = distance_to(disc.shape, transform_points(inverse(disc.X_BS), before_the_wrist)).max()
    assert model.accuracy_of(disc) == 0.002
    assert missed < 0.002


def test_real_meshes_stand_where_the_joints_of_the_table_are(shared_robots: Path) -> None:
    """The castings reach from joint to joint, so the comparison above compares like with like."""
    arm = kuka_vertices(shared_robots)
    assert arm["C2"][:, 0].max() == pytest.approx(662.0, abs=2.0)  # D2 begins where the elbow casting ends
    assert abb_vertices(shared_robots)["C3"][:, 0].max() == pytest.approx(464.0, abs=2.0)  # D3 likewise


@pytest.mark.parametrize("name", NAMES)
def test_reference_page_shows_the_figures_of_the_table(name: str, repository: Path) -> None:
    model = load_bundled(name)
    page = (repository / "docs" / "reference" / "robots.md").read_text(encoding="utf-8")
    section = page[page.index(f"\n`{name}`. ") :]
    for joint in model.joints:
        lower, upper, speed = np.degrees([joint.lower, joint.upper, joint.velocity])
        row = f"| {joint.name} | {lower:g} | {upper:g} | {speed:g} |"
        assert row in section[: section.index("\nBodies: ")]
    assert f"{len(model.bodies)} solids" in next(row for row in page.splitlines() if row.startswith(f"| `{name}` |"))
    assert (repository / "docs" / "images" / f"robot_{name}.png").is_file()
