"""Whole cells on both sides of the line: a path on the surface passes, one below it fails in `check` and in `solve`."""

from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell
from cellplan.jobs.check import check
from cellplan.model.cell.cell import Cell
from cellplan.report.record.sections.tasks import direction_record, direction_text, tasks_record
from cellplan.runs.solve import solve

CELL = """
cellplan: 1
name: pen
robots:
  kuka: {{model: kuka_kr6, tool: {{xyz_mm: [0, 0, 150]}}, start_deg: auto}}
part: {{geometry: {{box: {{size_mm: [300, 300, 100]}}}}, at: {{xyz_mm: [1000, 0, 700]}}}}
tasks:
  seam: {{robot: kuka, path: {path}, tool_axis: -z{more}}}
motion: {{duration_s: 2, step_s: 0.01}}
"""
CIRCLE = "circle: {radius_mm: 60, plane: xy}"


def cell_with(folder: Path, path: str, more: str = "") -> Cell:
    file = folder / "cell.yaml"
    file.write_text(CELL.format(path=path, more=more), encoding="utf-8")
    return load_cell(file)


@pytest.mark.parametrize(
    ("path", "more", "depth_mm", "passes"),
    [
        (f"{{{CIRCLE}, project: +z}}", "", 0.0, True),
        (f"{{{CIRCLE}, offset_mm: 35}}", "", 15.0, False),
        (f"{{{CIRCLE}, offset_mm: 47}}", ", tool_depth_mm: 3", 3.0, True),
    ],
)
def test_what_is_deeper_than_allowed_fails(tmp_path: Path, path: str, more: str, depth_mm: float, passes: bool) -> None:
    cell = cell_with(tmp_path, path, more)

    (run,) = solve(cell).runs

    assert run.report.passed == passes
    task = tasks_record(run.report, cell)["seam"]
    assert task["max_tool_depth_mm"] == pytest.approx(depth_mm, abs=1e-3)
    assert task["direction"] == "counterclockwise"
    assert [check.name for check in run.report.checks if not check.passed] == [] if passes else ["tool_depth"]
    assert check(cell).passed == passes


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (f"{{{CIRCLE}, project: -z}}", "counterclockwise seen from -z"),
        ("{circle: {radius_mm: 60, plane: xy, direction: clockwise}, project: +z}", "clockwise seen from +z"),
        ("{polyline: {points_mm: [[0, 0], [0, 9], [9, 9]], plane: xy, closed: true}, project: +z}", "clockwise"),
        ("{polyline: {points_mm: [[0, 0], [0, 9], [9, 9]], plane: xy, closed: true}, project: -z}", "counterclockwise"),
        ("{polyline: {points_mm: [[0, 0], [0, 9], [9, 9]], plane: xy}, project: +z}", "as listed"),
    ],
)
def test_the_report_says_which_way_round_a_path_runs(tmp_path: Path, path: str, words: str) -> None:
    (task,) = cell_with(tmp_path, path).tasks

    assert direction_text(direction_record(task)).startswith(words)
