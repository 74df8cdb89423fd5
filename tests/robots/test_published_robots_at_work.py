"""Each robot after its maker's figures does a small job: a ring on a box, held by a table or a rail in two of them."""

from pathlib import Path
from typing import NamedTuple

import pytest

from cellplan import load_cell, solve

CELL = """
cellplan: 1
name: small-job
robots:
  arm:
    model: {model}
    tool: {{xyz_mm: [0, 0, 120], geometry: {{cylinder: {{radius_mm: 10, length_mm: 120}}}}}}
    start_deg: {start_deg}
{holder}
part:
  geometry: {{box: {{size_mm: [100, 100, 100]}}}}
  {place}
tasks:
  ring:
    robot: arm
    path: {{circle: {{radius_mm: 10, plane: xy}}, project: +z}}
    tool_axis: normal
    free: [spin]
environment:
  floor: {{plane: {{z_mm: 0}}}}
motion: {{mode: simultaneous, duration_s: 2, step_s: 0.04, time_law: quintic}}
"""
TABLE = "  holder: {model: motopos_d500, base: {xyz_mm: [1150, 0, 0], rpy_deg: [0, 0, 90]}, start_deg: [0, 0]}"
RAIL = "  holder: {model: rail_kl100_2, base: {xyz_mm: [-700, -170, 0], rpy_deg: [0, 0, 90]}, start: {rail_mm: 0}}"
HELD = "held_by: [{robot: holder, at: {xyz_mm: [0, 0, -50]}}]"


class Job(NamedTuple):
    """An arm in its start posture, and what holds the part."""

    model: str
    start_deg: list[float]
    place: str
    holder: str = ""


JOBS = [
    Job("kuka_kr16_2", [-0.4982, -61.3315, 91.1614, 0, 60.1701, -19.3398], HELD, TABLE),
    Job("ur10e", [-1.161, -66.2251, 71.1286, 85.0966, 90.0, -53.9359], HELD, RAIL),
    Job(
        "franka_panda",
        [-36.9291, 9.9629, 36.5169, -134.9844, -9.7628, 142.6175, -12.9866],
        "at: {xyz_mm: [500, 0, 100]}",
    ),
    Job(
        "kuka_lbr_iiwa_14_r820",
        [-42.3973, 54.1584, 70.7437, -90.734, -52.7435, 74.0485, 34.0988],
        "at: {xyz_mm: [550, 0, 200]}",
    ),
]
SISTERS = [
    Job(
        "kuka_lbr_iiwa_7_r800",
        [-43.1565, 54.1168, 73.5564, -86.7869, -52.4167, 78.689, -7.462],
        "at: {xyz_mm: [550, 0, 200]}",
    ),
    Job("ur5e", [-0.3862, -57.672, 80.4786, 67.1934, 90.0, 67.5097], "at: {xyz_mm: [-500, -130, 100]}"),
    Job("abb_irb1600_8_145", [0, 25.308, 14.5231, 0, 50.1689, -1.8965], "at: {xyz_mm: [900, 0, 500]}"),
    Job("staubli_rx160", [0, 32.5003, 105.6823, 0, 41.8174, 8.6907], "at: {xyz_mm: [1000, 0, 500]}"),
]


@pytest.mark.parametrize(
    "job", [*JOBS, *(pytest.param(job, marks=pytest.mark.slow) for job in SISTERS)], ids=lambda job: job.model
)
def test_the_arm_draws_a_ring_without_touching_anything(job: Job, tmp_path: Path) -> None:
    path = tmp_path / "cell.yaml"
    path.write_text(CELL.format(**job._asdict()))
    solution = solve(load_cell(path))
    report = solution.runs[0].report
    assert solution.passed, [check.message for check in report.checks if not check.passed]
    if job.holder:
        assert 0.0 < report.motion_share["holder"][0] < 1.0
    for first, second, reason in report.clearance.exclusions:
        assert "shapes" not in reason, (first, second)  # no bodies that overlap wherever the joints are
