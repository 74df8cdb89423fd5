"""Mounts by key: what they become, and every finding about them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from builders.stored_cells import ARM

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.files.robots.joint_table import read_robot_table
from cellplan.files.run.joint_tables import table_body
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mounting import Bracket, Hanger, Wedge
from cellplan.model.robot.robot import BASE
from cellplan.runs.solve import solve
from cellplan.scene.kinematics.screw_chain import ScrewChain

LINE = "    base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}"
RAIL = "axis: [0, 2, 0], lower_mm: -500, upper_mm: 700, velocity_mm_s: 900"
RIDING = f"{LINE}\n    mount: {{rail: {{{RAIL}}}}}"
SEVEN = ("    weights: [1, 1, 1, 1, 1, 1]", "    weights: [1, 1, 1, 1, 1, 1, 1]")


def test_a_rail_is_a_joint_before_all_others_that_carries_the_whole_robot(load: Callable[..., Cell]) -> None:
    plain, riding = load().robot("worker"), load((LINE, RIDING), SEVEN).robot("worker")
    rail, *joints = riding.model.joints
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (20, 6))

    assert (rail.name, rail.lower, rail.upper, rail.velocity) == ("rail", -0.5, 0.7, 0.9)
    assert [joint.name for joint in joints] == list(plain.model.joint_names)
    for place in (0.0, 0.4):
        on_rail = ScrewChain(riding).flange_poses(np.column_stack([np.full(20, place), q]))
        moved = pose((2.0, 0.0, 0.0), (0.0, 0.0, np.pi)) @ pose((0.0, place, 0.0))
        still = np.linalg.inv(plain.X_WB) @ ScrewChain(plain).flange_poses(q)
        np.testing.assert_allclose(on_rail, moved @ still, atol=1e-12)


def test_the_foot_and_what_is_mounted_on_it_ride_and_the_track_stays(load: Callable[..., Cell]) -> None:
    track = "track: [{box: {size_mm: [300, 1500, 100]}, at: {xyz_mm: [0, 0, -150]}}]"
    bodies = f"{track}, carriage: [{{sphere: {{radius_mm: 90}}}}, {{sphere: {{radius_mm: 80}}}}]"
    attached = "    attachments: [{link: base, sphere: {radius_mm: 50}}]"
    mount = f"{LINE}\n    mount: {{rail: {{{RAIL}, {bodies}}}}}\n{attached}"

    robot = load((LINE, mount), SEVEN).robot("worker")

    links = {body.name: body.link for body in robot.model.bodies}
    assert (links["track"], links["carriage"], links["carriage_2"], links["foot"], links["flange"]) == (
        BASE,
        0,
        0,
        0,
        6,
    )
    assert robot.attachments[0].link == 0
    assert [body.accuracy for body in robot.model.bodies[:3]] == [0.0, 0.0, 0.0]  # drawn in the cell: exact


TABLE = """\
cellplan: 1
name: sliding
robots:
  left:
    model: {left}
    start: {{rail_mm: 95.994626658, A_deg: 65.236942702323, B_deg: -74.002676988255, C_deg: -62.196343604551}}
    weights: [2, 1, 1, 1]
    tool: {{xyz_mm: [0, 0, 30], geometry: {{cylinder: {{radius_mm: 5, length_mm: 30}}}}}}
part:
  geometry: {{box: {{size_mm: [200, 200, 20]}}}}
  at: {{xyz_mm: [700, 300, -60]}}
tasks:
  bow:
    robot: left
    path: {{polyline: {{points_mm: [[-30, 0], [30, 0]], plane: xy}}, project: +z}}
    tool_axis: normal
    axes: [x, y, z]
motion: {{mode: simultaneous, duration_s: 1, step_s: 0.02}}
checks: {{clearance_mm: 0}}
"""


def test_a_rail_by_key_gives_the_tables_of_a_robot_table_with_that_joint(tmp_path: Path) -> None:
    """Byte for byte: the same arithmetic, not only the same kinematics."""
    joint = "  rail: {type: prismatic, axis: [0, 1, 0], lower_mm: -200, upper_mm: 300, velocity_mm_s: 800}\n"
    riding = ARM.replace("joints:\n", f"joints:\n{joint}").replace("link: base", "link: rail")
    (tmp_path / "arm.yaml").write_text(ARM, encoding="utf-8")
    (tmp_path / "riding.yaml").write_text(riding, encoding="utf-8")
    key = "arm.yaml\n    mount: {rail: {axis: +y, lower_mm: -200, upper_mm: 300, velocity_mm_s: 800}}"
    bodies = []
    for number, model in enumerate(("riding.yaml", key)):
        path = tmp_path / f"{number}.yaml"
        path.write_text(TABLE.format(left=model), encoding="utf-8")
        solution = solve(load_cell(path))
        assert solution.passed
        bodies.append(table_body(solution.program.tables["left"]))

    assert bodies[0].startswith("time_s,rail_mm,A_deg,B_deg,C_deg\n")
    assert bodies[0] == bodies[1]


def test_the_written_cell_reads_back(load: Callable[..., Cell]) -> None:
    written = render_cell(load((LINE, RIDING), SEVEN))

    Path("copy").write_text(written, encoding="utf-8")
    assert render_cell(load_cell("copy")) == written
    changed = load((LINE, RIDING), SEVEN).with_values({"robots.worker.mount.rail.upper_mm": 600})
    assert changed.robot("worker").model.joints[0].upper == 0.6


def mounted(pose_text: str, mount: str) -> str:
    return f"    base: {{{pose_text}}}\n    mount: {mount}"


def test_hanging_tilted_and_wall_mounts_are_built(load: Callable[..., Cell]) -> None:
    hanging = mounted(
        "xyz_mm: [900, 0, 2500], rpy_deg: [180, 0, 0]", "{hanging: {ceiling_z_mm: 3000, box: {size_mm: [400, 300]}}}"
    )
    tilted = mounted("xyz_mm: [2000, 0, 900], rpy_deg: [0, -40, 180]", "{tilted: {cylinder: {radius_mm: 250}}}")
    wall = mounted(
        "xyz_mm: [2000, 0, 900], rpy_deg: [0, -90, 0]", "{wall: {cylinder: {radius_mm: 250}, length_mm: 80}}"
    )

    assert load((LINE, hanging)).robot("worker").pedestal == Hanger(size=(0.4, 0.3), ceiling=3.0)
    assert load((LINE, tilted)).robot("worker").pedestal == Wedge(radius=0.25, floor=0.0)
    assert load((LINE, wall)).robot("worker").pedestal == Bracket(radius=0.25, length=0.08)
    assert "floor_z_mm: 0" in render_cell(load((LINE, tilted)))


PEDESTAL = "{cylinder: {radius_mm: 230}}"


@pytest.mark.parametrize(
    ("new", "message"),
    [
        (
            f"{LINE}\n    mount: {{rail: {{{RAIL}}}, wall: {{}}}}",
            "c:10: robots.worker.mount.wall.length_mm: missing, expected length from the base to the wall",
        ),
        (
            mounted("xyz_mm: [2000, 0, 500]", f"{{pedestal: {PEDESTAL}, tilted: {PEDESTAL}}}"),
            "c:10: robots.worker.mount: expected exactly one of the keys pedestal, tilted, hanging, wall, rail, got "
            "pedestal and tilted",
        ),
        (
            f"{mounted('xyz_mm: [2000, 0, 500]', f'{{pedestal: {PEDESTAL}}}')}\n    pedestal: {PEDESTAL}",
            "c:10: robots.worker.mount: expected either pedestal or mount, got both",
        ),
        (
            RIDING.replace("[0, 2, 0]", "[0, 0, 0]"),
            "c:10: robots.worker.mount.rail.axis: expected a direction that is not zero, got a vector of no length",
        ),
        (
            RIDING.replace("upper_mm: 700", "upper_mm: -700"),
            "c:10: robots.worker.mount.rail.upper_mm: expected a number above lower_mm = -500, got -700",
        ),
        (
            RIDING.replace("axis:", "name: C3, axis:"),
            "c:10: robots.worker.mount.rail.name: expected another name, 'C3' means another joint or link of the robot",
        ),
        (
            f"{RIDING}\n    limits: {{rail: {{upper_mm: 100}}}}",
            "c:11: robots.worker.limits.rail: unexpected key, the limits of 'rail' are those of mount.rail: change "
            "them there",
        ),
        (
            f"{RIDING}\n    start_deg: [0, 0, 0, 0, 0, 0]",
            "c:11: robots.worker.start_deg: unexpected key, 'rail' is a prismatic joint: use start: {rail_mm: …, "
            "A3_deg: …, B3_deg: …, C3_deg: …, D3_deg: …, E3_deg: …, F3_deg: …}",
        ),
        (
            f"{RIDING}\n    start: {{A3_deg: 0, B3_deg: 0, C3_deg: 0, D3_deg: 0, E3_deg: 0, F3_deg: 0}}",
            "c:11: robots.worker.start: missing, expected one value per joint: add rail_mm",
        ),
        (
            mounted("xyz_mm: [2000, 0, 500]", "{hanging: {cylinder: {radius_mm: 90}, ceiling_z_mm: 900}}"),
            "c:10: robots.worker.mount.hanging: expected a base upside down, such as rpy_deg: [180, 0, 0], got one "
            "that leans by 0 deg",
        ),
        (
            mounted(
                "xyz_mm: [2000, 0, 900], rpy_deg: [180, 0, 0]",
                "{hanging: {cylinder: {radius_mm: 90}, ceiling_z_mm: 800}}",
            ),
            "c:10: robots.worker.mount.hanging.ceiling_z_mm: expected a ceiling above the base at 900 mm, got 800 mm",
        ),
        (
            mounted("xyz_mm: [2000, 0, 500], rpy_deg: [0, 80, 0]", f"{{tilted: {PEDESTAL}}}"),
            "c:10: robots.worker.mount.tilted: expected a base that leans by at most 75 deg, got 80 deg: use wall or "
            "hanging",
        ),
        (
            mounted("xyz_mm: [2000, 0, 100], rpy_deg: [0, 45, 0]", f"{{tilted: {PEDESTAL}}}"),
            "c:10: robots.worker.mount.tilted: expected a column that ends above the floor on all sides, got one that "
            "is too wide for its height",
        ),
        (
            mounted("xyz_mm: [2000, 0, 500], rpy_deg: [0, 45, 0]", f"{{pedestal: {PEDESTAL}}}"),
            "c:10: robots.worker.mount.pedestal: expected a base that stands upright, got one that leans by 45 deg: "
            "use mount: {tilted: …}, {wall: …} or {hanging: …}",
        ),
    ],
)
def test_a_mount_that_cannot_be_is_refused(refuse: Callable[..., list[str]], new: str, message: str) -> None:
    findings = refuse((LINE, new), *((SEVEN,) if "rail" in new else ()))

    assert message in findings


def test_a_robot_table_states_its_counting_in_degrees_and_millimetres(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    more = "controller: {zero_deg: {B: 90}, sign: {C: -1}, coupling: {C: {B: -1}}, source: sheet}\n"
    path.write_text(ARM + more, encoding="utf-8")

    controller = read_robot_table(path).controller

    assert controller is not None
    assert controller.source == "sheet"
    np.testing.assert_allclose(np.rad2deg(controller.from_model(np.deg2rad([10.0, 20.0, 30.0]))), [10, 110, -140])
