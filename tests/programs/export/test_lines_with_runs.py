"""Runs as lines: the tool goes on where its process is switched, by outputs that the motion switches ahead."""

import re
from pathlib import Path

import pytest
from builders.commands import run_command

pytestmark = pytest.mark.slow
CELL = """\
cellplan: 1
name: bead
robots:
  left:
    model: abb_irb1600
    base: {xyz_mm: [0, -1100, 0], rpy_deg: [0, 0, 90]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    home_deg: [0, 0, 0, 0, 45, 0]
    controller: {id: gluer}
controllers:
  gluer:
    kind: abb
    process: {on: 'SetDO doValve,1', off: 'SetDO doValve,0', on_lead_s: 0.04, off_lead_s: 0.02}
part:
  geometry: {box: {size_mm: [600, 300, 200]}}
  at: {xyz_mm: [0, -100, 500]}
tasks:
  bead:
    robot: left
    path: {polyline: {points_mm: [[-60, -100], [60, -100]], plane: xy}, project: +z}
    process: {feed_mm_s: 100, run_in_mm: 30, run_out_mm: 20}
motion: {mode: part_at_rest, step_s: 0.004}
program: {}
checks: {clearance_mm: 5}
"""
MOVE = re.compile(r"(MoveL|TriggL) (\w+),s_(\d+),(?:trigg_(\d),)?(\w+),")


def exported(folder: Path, text: str) -> tuple[int, str, Path]:
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    status, out, error = run_command("cellplan solve cell.yaml -o run", folder)
    assert status == 0, out + error
    status, _, error = run_command("cellplan export run --format rapid --moves linear --cell cell.yaml", folder)
    return status, error, folder / "run" / "programs" / "rapid"


def test_the_valve_is_switched_by_motions_that_do_not_stop(tmp_path: Path) -> None:
    status, error, folder = exported(tmp_path, CELL)

    assert status == 0, error
    moves = MOVE.findall((folder / "left.mod").read_text(encoding="utf-8"))
    triggered = [move for move in moves if move[0] == "TriggL"]
    assert [(speed, data) for _, _, speed, data, _ in triggered] == [("100", "1"), ("100", "2")]
    assert all(zone.startswith("z_") for *_, zone in triggered)  # no fine point between the runs
    status, out, error = run_command("cellplan verify run", tmp_path)
    assert status == 0, out + error


def test_outputs_that_no_motion_switches_would_stop_it(tmp_path: Path) -> None:
    status, error, _ = exported(tmp_path, CELL.replace(", on_lead_s: 0.04, off_lead_s: 0.02", ""))

    assert status != 0
    assert "controllers.gluer.process.on_lead_s above 0, by which the motion itself switches the outputs" in error
    assert "\n" not in error.strip()
