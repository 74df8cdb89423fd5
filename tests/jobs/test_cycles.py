"""Whole cells that repeat closed paths, follow trajectories or start beside their path."""

import json

import numpy as np
import pytest

from cellplan import load_cell, solve, verify, write_run

ARM = """\
robot: arm
source: planar arm with links of equal length, for tests
joints:
{joints}
flange: {{xyz_mm: [{reach}, 0, 0], rpy_deg: [0, 0, 0]}}
bodies:
  - {{link: base, capsule: {{from_mm: [0, 0, -100], to_mm: [0, 0, 0], radius_mm: 20}}}}
"""
JOINT = (
    "  J{n}: {{type: revolute, axis: [0, 0, 1], point_mm: [{x}, 0, 0], lower_deg: -720, upper_deg: 720, "
    "velocity_deg_s: 1000}}"
)
CELL = """\
cellplan: 1
name: arm
robots: {{arm: {{model: arm.yaml, start_deg: {start}}}}}
part: {{geometry: {{box: {{size_mm: [100, 100, 10]}}}}, at: {{xyz_mm: [0, 0, -1000]}}}}
tasks:
  loop:
    robot: arm
    path: {path}
    tool_axis: +z
    axes: [x, y]
    {words}
motion: {{duration_s: {duration}, step_s: {step}}}
acceleration: {{unlimited: constant laws and starts beside the path are looked at for other reasons}}
solver: {{integrator: euler, gain_per_s: {gain}}}
"""
RECTANGLE = "{rectangle: {sides_mm: [400, 300], plane: xy, center_mm: [1300, 0]}}"
CIRCLE = "{circle: {radius_mm: 300, plane: xy, center_mm: [1300, 0]}}"


@pytest.fixture
def planar(tmp_path):
    """Loads a cell with one planar arm of so many links of 1 m; its tasks ask for positions only."""

    def load(links, *, path=CIRCLE, words="repeat: 4", start="auto", duration=8, gain=100, step=0.005, rows=None):
        joints = "\n".join(JOINT.format(n=n + 1, x=1000 * n) for n in range(links))
        (tmp_path / "arm.yaml").write_text(ARM.format(joints=joints, reach=1000 * links), encoding="utf-8")
        if rows is not None:
            text = "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows)
            (tmp_path / "path.csv").write_text(f"t_s,x_mm,y_mm,z_mm\n{text}\n", encoding="utf-8")
        cell = CELL.format(path=path, words=words, start=start, duration=duration, gain=gain, step=step)
        (tmp_path / "cell.yaml").write_text(cell, encoding="utf-8")
        return load_cell(tmp_path / "cell.yaml")

    return load


@pytest.mark.slow
def test_an_arm_with_spare_joints_drifts_from_cycle_to_cycle(planar):
    """The pseudo-inverse is not repetitive (Nicolato 2007, chapter 4)."""
    report = solve(planar(4, words="repeat: 2\n    time_law: constant", duration=4, step=0.004)).runs[0].report

    drift = report.repeatability
    assert report.passed
    assert (drift.cycles, drift.period) == (2, pytest.approx(2.0, abs=1e-12))
    assert not drift.closes
    assert np.rad2deg(max(drift.worst for drift in drift.drifts)) > 0.05


@pytest.mark.slow
def test_an_arm_without_spare_joints_comes_back_in_every_cycle(planar):
    drift = solve(planar(2, path=RECTANGLE, step=0.002, gain=250)).runs[0].report.repeatability

    assert drift.cycles == 4
    assert drift.period == pytest.approx(2.0, abs=1e-12)
    assert drift.closes
    assert max(drift.worst for drift in drift.drifts) <= 2e-5  # half of acceleration times step over gain


@pytest.mark.slow
def test_cycles_under_one_law_differ_in_length(planar):
    drift = solve(planar(2)).runs[0].report.repeatability

    assert np.diff(drift.cycle_times)[[0, 3]] == pytest.approx(
        [2.8755, 2.8755], abs=1e-4
    )  # 10 s^3 - 15 s^4 + 6 s^5 = 1/4
    assert drift.period is None


@pytest.mark.slow
def test_a_closed_trajectory_is_repeated_period_by_period(planar):
    t = np.linspace(0.0, 2.0, 41)
    w = np.pi * t
    rows = np.stack([t, 1300 + 300 * np.cos(w), 200 * np.sin(w), 0 * t], axis=1)
    cell = planar(4, path="{csv: {file: path.csv, closed: true}}", words="repeat: 3", rows=rows, duration=6)
    run = solve(cell).runs[0]

    assert run.report.passed
    assert run.report.repeatability.cycle_times == pytest.approx([0.0, 2.0, 4.0, 6.0], abs=1e-12)
    again = verify(cell, run.program.tables)
    assert [drift.worst for drift in again.repeatability.drifts] == [
        drift.worst for drift in run.report.repeatability.drifts
    ]


def test_a_tool_that_starts_beside_its_path_is_judged_once_it_has_settled(planar, tmp_path):
    """Vargas 2012: the arm starts off the trajectory and comes to it as exp(-5 t)."""
    t = np.arange(0.0, 4.01, 0.1)
    rows = np.stack([t, 1300 + 200 * np.sin(0.8 * t), 200 * np.cos(0.4 * t), 0 * t], axis=1)
    cell = planar(
        3,
        path="{csv: path.csv}",
        words="settle_s: 3\n    tolerance: {position_mm: 0.5}",
        start="[10, 60, 60]",
        rows=rows,
        duration=4,
        gain=5,
    )

    solution = solve(cell)
    write_run(solution, tmp_path / "run")

    report = solution.runs[0].report
    error = np.linalg.norm(report.accuracy[0].position_error, axis=1)
    assert solution.passed
    assert error[0] > 0.2
    assert error[200] == pytest.approx(
        error[0] * (1.0 - 5.0 * 0.005) ** 200, rel=0.02
    )  # Euler's steps; arms are curved
    record = json.loads((tmp_path / "run" / "report.json").read_text(encoding="utf-8"))["tasks"]["loop"]
    assert (record["settle_s"], record["judged_from_s"], record["cycles"], record["end_s"]) == (3.0, 3.0, 1, 4.0)
    assert record["max_position_error_with_settling_mm"] == pytest.approx(1e3 * error.max(), rel=1e-9)
    assert record["max_position_error_mm"] == pytest.approx(1e3 * error[600:].max(), rel=1e-9)
    assert "evaluated from 3.00 s" in (tmp_path / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_planar_pair_drifts_in_every_cycle(cells, tmp_path):
    text = (cells / "planar_pair.yaml").read_text(encoding="utf-8")
    text = text.replace("    tool_turn_deg: 60\n", "    repeat: 3\n").replace("step_s: 0.001", "step_s: 0.004")
    (tmp_path / "cell.yaml").write_text(text.replace("position_mm: 0.003", "position_mm: 0.1"), encoding="utf-8")

    report = solve(load_cell(tmp_path / "cell.yaml")).runs[0].report

    assert report.passed
    assert report.repeatability.cycles == 3
    assert not report.repeatability.closes
