"""Where no start is found, what is wrong with the cell wherever its robots are is named first, with its line."""

from pathlib import Path

import pytest

from cellplan.errors import StartNotFoundError
from cellplan.files.cell.load import load_cell
from cellplan.jobs.check import check

CELL = """
cellplan: 1
name: far-away
robots:
  pen: {{model: planar_3r, base: {{xyz_mm: [0, 0, {base_mm}]}}, start_deg: auto}}
part: {{geometry: {{box: {{size_mm: [100, 100, 50]}}}}, at: {{xyz_mm: [3000, 0, 0]}}}}
tasks:
  seam:
    robot: pen
    path: {{polyline: {{points_mm: [[0, 0], [10, 0]], plane: xy}}, offset_mm: {offset_mm}}}
    tool_axis: -z
environment:
  block: {{box: {{size_mm: [400, 400, 100]}}, at: {{xyz_mm: [0, 0, -50]}}}}
motion: {{duration_s: 1, step_s: 0.1}}
"""


def why_no_start(folder: Path, *, base_mm: float, offset_mm: float) -> str:
    file = folder / "cell.yaml"
    file.write_text(CELL.format(base_mm=base_mm, offset_mm=offset_mm), encoding="utf-8")
    with pytest.raises(StartNotFoundError) as caught:
        check(load_cell(file))
    return str(caught.value).replace(str(file), "cell.yaml")


@pytest.mark.parametrize(
    ("base_mm", "offset_mm", "first"),
    [
        (70.0, 25.0, "cell.yaml:5: robots.pen.base: pen/"),
        (100.0, 10.0, "cell.yaml:8: tasks.seam: tool depth of task 'seam': 15 mm of the tool is inside the part"),
    ],
)
def test_a_fault_of_the_cell_is_named_before_the_search(
    tmp_path: Path, base_mm: float, offset_mm: float, first: str
) -> None:
    reported = why_no_start(tmp_path, base_mm=base_mm, offset_mm=offset_mm)

    assert reported.startswith(first)
    assert "; no start posture was found: cell.yaml:5: robots.pen.start_deg: no configuration" in reported


def test_a_fixed_part_in_a_foot_is_named(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    text = CELL.format(base_mm=100, offset_mm=25).replace("xyz_mm: [3000, 0, 0]", "xyz_mm: [0, 60, 40]")
    file.write_text(text, encoding="utf-8")

    with pytest.raises(
        StartNotFoundError, match=r"^\S+cell\.yaml:5: robots\.pen\.base: 'pen/base' touches 'part', and"
    ):
        check(load_cell(file))


def test_a_sound_cell_out_of_reach_has_no_other_reason(tmp_path: Path) -> None:
    assert why_no_start(tmp_path, base_mm=100.0, offset_mm=25.0).startswith(
        "cell.yaml:5: robots.pen.start_deg: no conf"
    )


SHARED = """
cellplan: 1
name: far-apart
robots:
  left: {{model: planar_3r, start_deg: [20, 20, 20]}}
  right: {{model: planar_3r, base: {{xyz_mm: [9000, 0, 0]}}, tool: {{xyz_mm: [0, 0, 40], geometry: {rod}}}}}
part:
  geometry: {{box: {{size_mm: [100, 100, 50]}}}}
  held_by:
    - {{robot: left, at: {{xyz_mm: [0, 0, 25], rpy_deg: [180, 0, 0]}}}}
    - {{robot: right, at: {{xyz_mm: [30, 0, {tip_mm}], rpy_deg: [180, 0, 0]}}, axes: [x, y, z]}}
tasks:
  seam:
    robot: left
    relative_to: world
    path: {{polyline: {{points_mm: [[733.1, 532.6, -20], [733.1, 522.6, -20]]}}}}
    axes: [x, y]
    settle_s: 0.5
motion: {{duration_s: 1, step_s: 0.02}}
"""
ROD = "{cylinder: {radius_mm: 5, length_mm: 40}}"


@pytest.mark.parametrize(("tip_mm", "is_deep"), [(25.0, False), (10.0, True)])
def test_a_free_grasp_that_is_stated_too_deep_is_named(tmp_path: Path, tip_mm: float, is_deep: bool) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(SHARED.format(rod=ROD, tip_mm=tip_mm), encoding="utf-8")

    with pytest.raises(StartNotFoundError) as caught:
        check(load_cell(file))

    reported = str(caught.value).replace(str(file), "cell.yaml")
    deep = "cell.yaml:11: part.held_by[1].at: right/tool is 15 mm deep in part at this pose, allowed 2 mm: is the grasp"
    assert reported.startswith(deep if is_deep else "cell.yaml:6: robots.right.start_deg: no configuration")
