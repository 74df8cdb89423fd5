"""Programs of seams that weave: on the seam where the controller weaves, else along the weave at the feed of travel."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from builders.commands import run_command

pytestmark = pytest.mark.slow
CELL = r"""
cellplan: 1
name: woven
robots:
  left:
    model: abb_irb1600
    base: {xyz_mm: [0, -1100, 0], rpy_deg: [0, 0, 90]}
    tool: {xyz_mm: [0, 0, 150], geometry: {capsule: {radius_mm: 12, length_mm: 150}}}
    home_deg: [0, 0, 0, 0, 45, 0]
    controller: {id: welder}
controllers:
  welder:
    kind: abb
    process:
      on: 'ArcLStart {point}, {speed}, seam1, weld1 \Weave:=weave1, {zone}, {tool} \WObj:={frame};'
      inner: 'ArcL {point}, {speed}, seam1, weld1 \Weave:=weave1, {zone}, {tool} \WObj:={frame};'
      off: 'ArcLEnd {point}, {speed}, seam1, weld1 \Weave:=weave1, {zone}, {tool} \WObj:={frame};'
      weave_mm: 2
part:
  geometry: {box: {size_mm: [600, 300, 200]}}
  at: {xyz_mm: [0, 0, 900]}
tasks:
  seam:
    robot: left
    path:
      polyline: {points_mm: [[-15, -150, 100], [15, -150, 100]]}
      walls: {top: +z, front: -y}
      from: top
      work_deg: 45
      push_deg: 10
      weave: {side_mm: 2, wavelength_mm: 4}
    process: {feed_mm_s: 8}
motion: {mode: part_at_rest, step_s: 0.004}
program: {}
checks: {clearance_mm: 5}
"""
POINTS = re.compile(r"robtarget (seam_\d+) := \[\[([^\]]*)\]")
MOVES = re.compile(r"Arc[LC]\w* (.*?), s_(\d+)(?:_(\d+))?, seam1")


def program_of(text: str, folder: Path) -> str:
    (folder / "cell.yaml").write_text(text, encoding="utf-8")
    for command in (
        "cellplan solve cell.yaml -o run",
        "cellplan export run --format rapid --moves linear --cell cell.yaml",
    ):
        status, out, error = run_command(command, folder)
        assert status == 0, out + error
    return (folder / "run" / "programs" / "rapid" / "left.mod").read_text(encoding="utf-8")


def points_of(program: str) -> dict[str, np.ndarray]:
    return {name: np.array([float(it) for it in xyz.split(",")]) for name, xyz in POINTS.findall(program)}


def test_program_stays_on_the_seam_where_the_controller_weaves(tmp_path: Path) -> None:
    program = program_of(CELL, tmp_path)
    ends = points_of(program)

    assert len(MOVES.findall(program)) == 2
    assert np.linalg.norm(ends["seam_2"] - ends["seam_1"]) == pytest.approx(30.0, abs=0.01)
    assert r"\Weave:=weave1" in program


def test_rows_weave_elsewhere_and_travel_at_the_feed(tmp_path: Path) -> None:
    program = program_of(CELL.replace("weave_mm: 2", "weave_mm: 0"), tmp_path)
    points, moves = points_of(program), MOVES.findall(program)

    here, seconds = points[moves[0][0]], 0.0
    for names, whole, tenth in moves[1:]:
        speed = float(f"{whole}.{tenth or 0}")
        via, last = (points[name] for name in (names.split(", ") * 2)[:2])
        a, b, c = (np.linalg.norm(it) for it in (via - here, last - via, last - here))
        half = 0.5 * (a + b + c)
        area = np.sqrt(max(half * (half - a) * (half - b) * (half - c), 0.0))
        is_arc = ", " in names and area > 1e-6
        radius = a * b * c / (4.0 * area) if is_arc else 0.0
        length = 2.0 * radius * sum(np.arcsin(min(it / (2.0 * radius), 1.0)) for it in (a, b)) if is_arc else c
        here, seconds = last, seconds + length / speed
    travel = float(np.linalg.norm(here - points[moves[0][0]]))

    assert len(moves) > 15
    assert travel == pytest.approx(30.0, abs=0.2)
    assert travel / seconds == pytest.approx(8.0, rel=0.03)  # the ramps at both ends, and speeds in tenths
    report = json.loads((tmp_path / "run" / "work-1" / "report.json").read_text(encoding="utf-8"))
    speed = report["tasks"]["seam"]["process_speed"]
    assert speed["peak_mm_s"] == pytest.approx(8.0, rel=1e-3)  # of travel: the tip itself is faster


@pytest.mark.slow
def test_tool_that_stands_keeps_its_mean_feed_in_a_retimed_program_too(tmp_path: Path) -> None:
    dwells = "frequency_hz: 1.75, dwell_left_s: 0.1, dwell_right_s: 0.05, dwell: standing"
    text = CELL.replace("weave_mm: 2", "weave_mm: 0").replace("side_mm: 2, wavelength_mm: 4", f"side_mm: 1.5, {dwells}")
    text = text.replace("feed_mm_s: 8", "feed_mm_s: 7").replace("step_s: 0.004", "step_s: 0.004, timing: fastest")
    (tmp_path / "cell.yaml").write_text(text, encoding="utf-8")
    status, out, error = run_command("cellplan solve cell.yaml -o run", tmp_path)
    assert status == 0, out + error

    checks = json.loads((tmp_path / "run" / "work-1" / "report.json").read_text(encoding="utf-8"))["checks"]
    (feed,) = (check for check in checks if check["name"] == "process_feed")
    assert feed["value"] <= 0.1  # [%] of the feed, in every step; rests rounded up to whole steps would take up to 4 %


@pytest.mark.slow
def test_lines_of_a_tool_that_stands_at_the_edges_of_its_weave_are_refused(tmp_path: Path) -> None:
    dwells = "wavelength_mm: 4, dwell_left_s: 0.1, dwell: standing"
    text = CELL.replace("weave_mm: 2", "weave_mm: 0").replace("wavelength_mm: 4", dwells)
    (tmp_path / "cell.yaml").write_text(text, encoding="utf-8")
    status, out, error = run_command("cellplan solve cell.yaml -o run", tmp_path)
    assert status == 0, out + error

    status, _, error = run_command("cellplan export run --format rapid --moves linear --cell cell.yaml", tmp_path)
    assert status != 0
    assert "task 'seam': it stands at the edges of its weave, which lines do not hold" in error
