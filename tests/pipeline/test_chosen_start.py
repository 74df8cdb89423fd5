"""Where no start is found, what is wrong with the cell wherever its robots are is named first, with its line."""

from pathlib import Path

import pytest

from cellplan.errors import StartNotFoundError
from cellplan.io.cell_file import load_cell
from cellplan.pipeline.check import check

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
        (100.0, 10.0, "cell.yaml:8: tasks.seam: tool depth of task 'seam': 15 mm of the tool inside the part"),
    ],
)
def test_a_fault_of_the_cell_is_named_before_the_search(
    tmp_path: Path, base_mm: float, offset_mm: float, first: str
) -> None:
    told = why_no_start(tmp_path, base_mm=base_mm, offset_mm=offset_mm)

    assert told.startswith(first)
    assert "; with that no start was found: cell.yaml:5: robots.pen.start_deg: no configuration" in told


def test_a_sound_cell_out_of_reach_has_no_other_reason(tmp_path: Path) -> None:
    assert why_no_start(tmp_path, base_mm=100.0, offset_mm=25.0).startswith(
        "cell.yaml:5: robots.pen.start_deg: no conf"
    )
