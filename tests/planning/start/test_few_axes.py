"""Arms with fewer axes than their task needs: the positioner brings the part to where their tools can be."""

from pathlib import Path

import numpy as np
import pytest
from builders.urdf_texts import joint, write_urdf

from cellplan.files.cell.load import load_cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.search import choose_start
from cellplan.planning.timing.schedule import clock_paths
from cellplan.planning.tracking.cooperation_jacobian import pose_errors
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene

LIMIT = '<limit lower="-1.8" upper="1.8" velocity="2"/>'
ABOUT_Y, ABOUT_X, ABOUT_Z = (f'<axis xyz="{axis}"/>{LIMIT}' for axis in ("0 1 0", "1 0 0", "0 0 1"))
CELL = """\
cellplan: 1
name: few
robots:
  holder:
    model: kuka_kr6
    tool: {xyz_mm: [0, 0, 80]}
  op:
    model: arm.urdf
    base: {xyz_mm: [1500, 0, 300], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 120]}
part:
  geometry: {box: {size_mm: [260, 260, 30]}}
  held_by: [{robot: holder, at: {xyz_mm: [0, 0, -15]}}]
tasks:
  ring: {robot: op, path: {circle: {radius_mm: 70, plane: xy}, project: +z}, tool_axis: normal}
motion: {duration_s: 4, step_s: 0.02}
"""


def turns(name: str, parent: str, child: str, xyz: str, inside: str) -> str:
    return f'<link name="{child}"/>' + joint(name, parent, child, f'<origin xyz="{xyz}"/>{inside}')


FOUR_AXES = (
    '<link name="base"/>',
    turns("j1", "base", "l1", "0 0 0.2", ABOUT_Z),
    turns("j2", "l1", "l2", "0 0 0.25", ABOUT_Y),
    turns("j3", "l2", "l3", "0 0 0.55", ABOUT_Y),
    turns("j4", "l3", "tool0", "0.6 0 0", ABOUT_Z),
)
FOLLOWING = '<axis xyz="0 1 0"/><mimic joint="j3" multiplier="-1"/>' + LIMIT
WITH_MIMIC = (
    *FOUR_AXES[:4],
    turns("level", "l3", "l4", "0.6 0 0", FOLLOWING),
    turns("j6", "l4", "l5", "0.1 0 0", ABOUT_X),
    '<link name="tool0"/>',
    joint("face", "l5", "tool0", '<origin rpy="0 1.5707963267948966 0"/>', kind="fixed"),
)  # a joint that a linkage moves, and one that it carries


@pytest.mark.slow
@pytest.mark.parametrize("lines", [pytest.param(FOUR_AXES, id="four axes"), pytest.param(WITH_MIMIC, id="mimic")])
def test_the_part_is_held_where_the_tool_of_a_short_arm_can_be(tmp_path: Path, lines: tuple[str, ...]) -> None:
    write_urdf(tmp_path, *lines)
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    cell = load_cell(tmp_path / "cell.yaml")
    toolpath = build_toolpath(cell.tasks[0], cell.part)
    paths = clock_paths(cell, [toolpath])

    choice = choose_start(Scene.from_cell(cell), paths)

    tools = [ScrewChain(robot).tool_poses(choice.start[None, cell.columns(robot.name)])[0] for robot in cell.robots]
    X_PT = np.linalg.inv(tools[0] @ cell.part.X_CP) @ tools[1]
    goal = paths["ring"].toolpath.X_PT_start
    errors = pose_errors(goal[None], X_PT[None], [cell.tasks[0].is_spin_free])[0][list(cell.tasks[0].axes)]
    assert np.abs(errors).max() < 1e-9  # [m] and [rad]: a start is found to rounding
    assert np.all((choice.start >= cell.joint_limits.lower) & (choice.start <= cell.joint_limits.upper))
