"""Repair of the thesis' cell that breaks two joint limits and stands in itself."""

from dataclasses import replace
from pathlib import Path

import pytest

from cellplan import LayoutRequest, load_cell, repair, solve, write_repair
from cellplan.search.programs.objective import Objective

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("duration", [6.0, 4.0])
def test_one_robot_changes_and_the_margin_is_kept(cells: Path, tmp_path: Path, duration: float) -> None:
    request = LayoutRequest(
        cell=cells / "four_robots_initial.yaml", objective=Objective.CHANGE, duration=duration, margin=2.0
    )
    repaired = repair(request)
    write_repair(repaired, request, tmp_path / "out")

    first = repaired.record["remedies"][0]
    assert len(first["robots"]) == 1
    assert first["cost"] is not None
    assert first["cost"] <= 1.5
    solution = solve(load_cell(tmp_path / "out" / "best.yaml"))
    assert solution.passed
    assert min(use.margin for run in solution.runs for use in run.report.joints) >= 2.0 * 3.14159 / 180.0


def test_the_base_of_one_robot_where_the_holder_stays(cells: Path) -> None:
    request = LayoutRequest(cell=cells / "four_robots_initial.yaml", objective=Objective.CHANGE, duration=4.0)
    repaired = repair(replace(request, fixed=("reis.start_deg",)))

    first = repaired.record["remedies"][0]
    assert first["robots"] == ["staubli"]
    assert first["cost"] is not None
    assert first["cost"] <= 1.5
    assert {check["subject"] for check in repaired.record["failed"] if check["name"] == "joint_position"} == {
        "kuka/B2",
        "staubli/C4",
    }
