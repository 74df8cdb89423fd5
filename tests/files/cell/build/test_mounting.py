"""Pedestals and attachments in a cell file: what they become, and every finding about them."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import BASE

BASE_LINE = "    base: {xyz_mm: [2000, 0, 0], rpy_deg: [0, 0, 180]}"
RAISED = "    base: {xyz_mm: [2000, 0, 400], rpy_deg: [0, 0, 180]}"
LINKS = "base, A3, B3, C3, D3, E3, F3"


def test_a_pedestal_stands_on_the_highest_plane_below_the_base(load: Callable[..., Cell]) -> None:
    robot = load(
        (BASE_LINE, f"{RAISED}\n    pedestal: {{box: {{size_mm: [500, 400]}}}}"),
        ("  floor: {plane: {z_mm: 0}}", "  floor: {plane: {z_mm: -50}}\n  stage: {plane: {z_mm: 100}}"),
    ).robot("worker")

    assert robot.pedestal is not None
    assert robot.pedestal.floor == 0.1
    shape, X_BS = robot.pedestal.solid(robot.X_WB) or (None, np.eye(4))
    assert shape == Box((0.5, 0.4, pytest.approx(0.3)))
    np.testing.assert_allclose(robot.X_WB @ X_BS, pose((2.0, 0.0, 0.25), (0.0, 0.0, np.pi)), atol=1e-12)


def test_a_stated_floor_goes_before_the_planes_of_the_environment(load: Callable[..., Cell]) -> None:
    stated = f"{RAISED}\n    pedestal: {{cylinder: {{radius_mm: 230}}, floor_z_mm: -20}}"

    robot = load((BASE_LINE, stated)).robot("worker")

    assert robot.pedestal is not None
    assert (robot.pedestal.solid(robot.X_WB) or [None])[0] == Cylinder(0.23, pytest.approx(0.42))


def test_the_written_cell_states_the_floor_of_a_pedestal_and_reads_back(load: Callable[..., Cell]) -> None:
    written = render_cell(load((BASE_LINE, f"{RAISED}\n    pedestal: {{cylinder: {{radius_mm: 230}}}}")))

    assert "floor_z_mm: 0" in written
    Path("copy").write_text(written, encoding="utf-8")
    assert render_cell(load_cell("copy")) == written


@pytest.mark.parametrize(
    ("new", "message"),
    [
        (
            f"{RAISED}\n    pedestal: {{}}",
            "c:10: robots.worker.pedestal: expected exactly one of the keys cylinder, box, got none",
        ),
        (
            f"{BASE_LINE}\n    pedestal: {{cylinder: {{radius_mm: 230}}}}",
            "c:10: robots.worker.pedestal: expected a base above the floor at 0 mm, got one at 0 mm: leave the "
            "pedestal out",
        ),
        (
            "    base: {xyz_mm: [2000, 0, -9]}\n    pedestal: {cylinder: {radius_mm: 230}}",
            "c:10: robots.worker.pedestal.floor_z_mm: missing, expected the height of the floor: no plane of the "
            "environment lies below the base",
        ),
        (
            "    base: {xyz_mm: [2000, 0, 900], rpy_deg: [180, 0, 0]}\n    pedestal: {cylinder: {radius_mm: 230}}",
            "c:10: robots.worker.pedestal: expected a base that stands upright, got one that leans by 180 deg: use "
            "mount: {tilted: …}, {wall: …} or {hanging: …}",
        ),
        (
            f"{BASE_LINE}\n    attachments: [{{link: C4, sphere: {{radius_mm: 50}}}}]",
            f"c:10: robots.worker.attachments[0].link: expected a link of the robot ({LINKS}), got 'C4'",
        ),
        (
            f"{BASE_LINE}\n    attachments: [{{link: C3, name: elbow, sphere: {{radius_mm: 50}}}}]",
            "c:10: robots.worker.attachments[0].name: expected another name, 'elbow' means another body of the robot",
        ),
        (
            f"{BASE_LINE}\n    attachments: [{{link: C3}}]",
            "c:10: robots.worker.attachments[0]: expected exactly one of the keys box, cylinder, capsule, sphere, "
            "mesh, got none",
        ),
    ],
)
def test_what_cannot_be_mounted_is_refused(refuse: Callable[..., list[str]], new: str, message: str) -> None:
    assert refuse((BASE_LINE, new)) == [message]


def test_attachments_of_a_robot_table_are_placed_in_the_base_frame(load: Callable[..., Cell]) -> None:
    block = "{link: C3, box: {size_mm: [200, 100, 300]}, at: {xyz_mm: [150, 0, 1200]}}"
    hose = "{link: base, name: hose, sphere: {radius_mm: 50}}"

    robot = load((BASE_LINE, f"{BASE_LINE}\n    attachments:\n      - {block}\n      - {hose}")).robot("worker")

    first, second = robot.attachments
    assert (first.name, first.link, first.shape) == ("attachment", 2, Box((0.2, 0.1, 0.3)))
    np.testing.assert_allclose(first.X_BS, pose((0.15, 0.0, 1.2)))
    assert (second.name, second.link, second.shape) == ("hose", BASE, Sphere(0.05))


URDF = """\
<robot name="bent">
  <link name="foot"/><link name="arm"/><link name="hand"/>
  <joint name="a" type="revolute">
    <parent link="foot"/><child link="arm"/><origin xyz="0 0 0.5" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" velocity="1" effort="1"/>
  </joint>
  <joint name="b" type="fixed"><parent link="arm"/><child link="hand"/><origin xyz="1 0 0"/></joint>
</robot>
"""


def test_attachments_of_a_urdf_are_placed_in_the_frame_of_their_link(load: Callable[..., Cell]) -> None:
    Path("bent.urdf").write_text(URDF, encoding="utf-8")
    mounted = "    attachments: [{link: hand, sphere: {radius_mm: 50}, at: {xyz_mm: [0, 0, 100]}}]"

    robot = load(("model: abb_irb1600", "model: bent.urdf"), ("    weights: [1, 1, 1, 1, 1, 1]", mounted)).robot(
        "worker"
    )

    assert robot.attachments[0].link == 0
    np.testing.assert_allclose(robot.attachments[0].X_BS[:3, 3], (0.0, 1.0, 0.6), atol=1e-12)
