"""Visual elements of a URDF, for pictures only: a link that cannot be drawn by them is drawn by its bodies."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from cellplan import load_cell
from cellplan.files.robots.urdf.load import UrdfOptions
from cellplan.files.robots.urdf.visuals import read_visuals
from cellplan.geometry.shapes import Box, Mesh
from cellplan.jobs.view.geometries import robot_visuals
from cellplan.jobs.view.write import ViewRequest, view

LINK = '<link name="{name}">{visual}<collision><geometry><box size="0.3 0.3 0.1"/></geometry></collision></link>'
VISUALS = {
    "base": '<visual><origin xyz="0 0 0.2"/><geometry><box size="0.2 0.2 0.1"/></geometry></visual>',
    "arm": '<visual><origin xyz="0.1 0 0"/><geometry><mesh filename="arm.stl"/></geometry></visual>',
    "hand": '<visual><geometry><mesh filename="missing.stl"/></geometry></visual>',
}
JOINT = (
    '<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="0.5 0 0.3"/>'
    '<axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1" effort="0"/></joint>'
)
CELL = """\
cellplan: 1
name: drawn
robots:
  arm: {model: arm.urdf, start_deg: [10, 20]}
part: {geometry: {box: {size_mm: [50, 50, 50]}}, at: {xyz_mm: [3000, 0, 500]}}
tasks: {ring: {robot: arm, path: {circle: {radius_mm: 10, plane: xy}, project: +z}}}
motion: {mode: simultaneous, duration_s: 1, step_s: 0.1}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    links = "".join(LINK.format(name=name, visual=visual) for name, visual in VISUALS.items())
    joints = JOINT.format(name="a", parent="base", child="arm") + JOINT.format(name="b", parent="arm", child="hand")
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm">{links}{joints}</robot>')
    trimesh.creation.box((0.4, 0.1, 0.1)).export(tmp_path / "arm.stl")
    return tmp_path


def test_visual_elements_are_read_where_a_link_has_bodies_of_its_own(folder: Path) -> None:
    visuals = read_visuals(folder / "arm.urdf", UrdfOptions())

    assert [(entry.link, type(entry.shape)) for entry in visuals] == [("base", Box), ("arm", Mesh)]
    assert np.array_equal(visuals[0].X_LS[:3, 3], [0.0, 0.0, 0.2])


def test_a_page_draws_them_on_their_links_and_the_bodies_of_all_others(folder: Path) -> None:
    (folder / "cell.yaml").write_text(CELL)
    scene = view(ViewRequest(path=folder / "cell.yaml"))[0]["scenes"][0]

    assert [(visual["link"], visual["pose"][3::4]) for visual in scene["visuals"]] == [
        (-1, [0.0, 0.0, 0.2]),
        (0, [0.6, 0.0, 0.3]),
    ]
    replaced = {body["name"]: body["replaced"] for body in scene["bodies"]}
    assert replaced == {"arm/base": True, "arm/arm": True, "arm/hand": False, "part": False}


def test_a_robot_without_a_urdf_has_none(cells: Path) -> None:
    assert robot_visuals(load_cell(cells / "planar_pair.yaml"), "left") == ()
