"""A grasp that leaves components free starts just as it is stated: with another lean the tool may dig in."""

from pathlib import Path

import numpy as np

from cellplan.files.cell.load import load_cell
from cellplan.geometry.transforms import inverse
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths
from cellplan.scene.scene import Scene

CELL = """
cellplan: 1
name: ball-joint
robots:
  left:
    model: kuka_kr6
    base: {xyz_mm: [0, -1100, 0]}
    tool: {xyz_mm: [0, 0, 120], geometry: {cylinder: {radius_mm: 30, length_mm: 120}}}
  right:
    model: kuka_kr6
    base: {xyz_mm: [0, 1100, 0]}
    tool: {xyz_mm: [0, 0, 120], geometry: {cylinder: {radius_mm: 30, length_mm: 120}}}
part:
  geometry: {box: {size_mm: [100, 1600, 160]}}
  held_by:
    - {robot: left, at: {xyz_mm: [-50, -700, 0], rpy_deg: [0, 90, 0]}}
    - {robot: right, at: {xyz_mm: [-50, 700, 0], rpy_deg: [0, 90, 0]}, axes: [x, y, z]}
tasks:
  lift:
    robot: left
    relative_to: world
    path: {polyline: {points_mm: [[1000, -700, 900], [1000, -700, 940]]}}
    tool_axis: +x
    tool_x: -z
motion: {duration_s: 1, step_s: 0.05}
"""


def test_the_tool_stands_on_the_part_as_the_grasp_says(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(CELL, encoding="utf-8")
    cell = load_cell(file)
    scene = Scene.from_cell(cell)

    choice = choose_start(scene, clock_paths(cell, [build_toolpath(task, cell.part) for task in cell.tasks]))

    X_WT = {name: chain.tool_poses(choice.start[None, cell.columns(name)])[0] for name, chain in scene.chains.items()}
    first, further = cell.part.held_by
    X_WP = X_WT["left"] @ inverse(first.X_PT)
    np.testing.assert_allclose(X_WT["right"], X_WP @ further.X_PT, atol=1e-6)
    assert choice.trial is not None
    assert choice.trial.is_sound
