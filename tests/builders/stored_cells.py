"""A small cell with files of every kind, quick to solve and to verify, for tests of run folders."""

from pathlib import Path

import numpy as np
import trimesh

from cellplan import load_cell, solve, write_run

CELL = """\
cellplan: 1
name: small-pair
robots:
  left:
    model: robots/left.yaml
    base: {xyz_mm: [0, 0, 500]}
    tool: {xyz_mm: [0, 0, 40], geometry: {cylinder: {radius_mm: 10, length_mm: 40}}}
    start_deg: [50, -85, 35]
  right:
    model: robots/right.urdf
    base: {xyz_mm: [1900, 300, 480], rpy_deg: [0, 0, 180]}
    tool: {xyz_mm: [0, 0, 40], geometry: {cylinder: {radius_mm: 5, length_mm: 40}}}
    start_deg: auto
  idle:
    model: planar_3r
    base: {xyz_mm: [0, 4000, 500]}
    start_deg: [0, 0, 0]
part:
  geometry: {box: {size_mm: [340, 300, 10]}}
  held_by:
    - {robot: left, at: {xyz_mm: [-120, 0, 5], rpy_deg: [180, 0, 0]}}
tasks:
  path:
    robot: right
    path: {csv: {file: paths/bow.csv}}
    tool_axis: normal
    tool_x: -x
    axes: [x, y, rz]
    tolerance: {position_mm: 1, orientation_deg: 0.1}
environment:
  floor: {plane: {z_mm: 0}}
  block: {mesh: meshes/block.stl, unit: mm, at: {xyz_mm: [900, -900, 100]}}
motion: {mode: simultaneous, duration_s: 1, step_s: 0.025, time_law: quintic}
"""
ARM = """\
robot: left
source: made for tests
joints:
  A: {type: revolute, axis: [0, 0, 1], point_mm: [0, 0, 0], lower_deg: -170, upper_deg: 170, velocity_deg_s: 180}
  B: {type: revolute, axis: [0, 0, 1], point_mm: [500, 0, 0], lower_deg: -150, upper_deg: 150, velocity_deg_s: 180}
  C: {type: revolute, axis: [0, 0, 1], point_mm: [900, 0, 0], lower_deg: -150, upper_deg: 150, velocity_deg_s: 180}
flange: {xyz_mm: [1100, 0, -20], rpy_deg: [180, 0, 0]}
bodies:
  - {link: A, capsule: {from_mm: [0, 0, 0], to_mm: [500, 0, 0], radius_mm: 25}}
  - {link: B, capsule: {from_mm: [500, 0, 0], to_mm: [900, 0, 0], radius_mm: 20}}
  - {link: C, capsule: {from_mm: [900, 0, 0], to_mm: [1100, 0, 0], radius_mm: 15}}
"""
LIMIT = '<axis xyz="0 0 1"/><limit lower="-2.6" upper="2.6" velocity="3" effort="0"/>'


def write_cell(folder: Path) -> Path:
    """Write the cell and the files it names; gives the cell file."""
    for name in ("robots", "meshes", "paths"):
        (folder / name).mkdir(parents=True)
    (folder / "robots" / "left.yaml").write_text(ARM, encoding="utf-8")
    (folder / "robots" / "right.urdf").write_text(_urdf(), encoding="utf-8")
    trimesh.creation.box((200, 200, 200)).export(folder / "robots" / "elbow.stl")
    trimesh.creation.box((200, 200, 200)).export(folder / "meshes" / "block.stl")
    t = np.linspace(0.0, 1.0, 12)
    rows = [f"{40 + 60 * x:.3f},{30 * np.sin(2 * x):.3f},5,0,0,-1" for x in t]
    (folder / "paths" / "bow.csv").write_text("\n".join(["x_mm,y_mm,z_mm,i,j,k", *rows]) + "\n", encoding="utf-8")
    cell = folder / "small.yaml"
    cell.write_text(CELL, encoding="utf-8")
    return cell


def solve_into(cell: Path, run: Path, *, task: str | None = None) -> None:
    """Solve a cell and write its run folder."""
    write_run(solve(load_cell(cell), task=task), run)


def _urdf() -> str:
    """The right arm: as the left one, with a box at its elbow."""
    elbow = '<mesh filename="elbow.stl" scale="0.0002 0.0002 0.0002"/>'
    links = {"base": "", "a": "", "b": f"<collision><geometry>{elbow}</geometry></collision>", "c": "", "tool0": ""}
    joints = [("A", "base", "a", "0 0 0"), ("B", "a", "b", "0.5 0 0"), ("C", "b", "c", "0.4 0 0")]
    text = "".join(f'<link name="{name}">{inside}</link>\n' for name, inside in links.items())
    for name, parent, child, xyz in joints:
        ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        text += f'<joint name="{name}" type="revolute">{ends}{LIMIT}</joint>\n'
    ends = '<parent link="c"/><child link="tool0"/><origin xyz="0.2 0 0" rpy="3.141592653589793 0 0"/>'
    text += f'<joint name="flange" type="fixed">{ends}</joint>\n'
    return f'<?xml version="1.0"?>\n<robot name="right">\n{text}</robot>\n'
