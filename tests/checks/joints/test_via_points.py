"""Via points: passed in their order at rest, kept in the resolved cell, and missed by tables that are changed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.checks.joints.joins import with_via_points
from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve

CELL = Path(__file__).resolve().parents[3] / "cells" / "in_turn.yaml"
BACK, OUT, ABB = [-30, -20, 50, 0, -45, -180], [20, -20, 50, 0, -45, -180], [30, -45, 20, 0, 60, 0]
VIA = {
    "tasks.circle.via": {"before": [BACK, "home"], "after": ["home", OUT]},
    "tasks.rhombus.via": {"before": [ABB]},
}


def with_via(**more: object) -> Cell:
    """Two of the three tasks, with the robots that they need and without controllers."""
    cell = load_cell(CELL)
    written = cell.origin.document
    robots = {name: dict(entry) for name, entry in written["robots"].items() if name != "staubli"}
    for entry in robots.values():
        del entry["controller"]
    tasks = {name: entry for name, entry in written["tasks"].items() if name != "rectangle"}
    fewer = {"robots": robots, "controllers": {}, "tasks": tasks}
    return cell.with_values({"motion.step_s": 0.05, **fewer, **VIA, **more})


@pytest.fixture(scope="module")
def solution() -> Solution:
    return solve(with_via(), is_reported=False)


def rows_at(q: Array, degrees: list[float]) -> list[int]:
    """Rows in which a robot is at a configuration."""
    return np.flatnonzero(np.abs(q - np.radians(degrees)).max(axis=1) < 1e-9).tolist()


@pytest.mark.slow
def test_robots_pass_their_via_points_in_their_order_and_the_others_go_in_the_leg_between(solution: Solution) -> None:
    first, second = (next(run for run in solution.runs if run.name == f"transfer-{number}") for number in (1, 2))
    home = [0, -20, 50, 0, -45, -180]

    kuka = first.report.q["kuka"]
    assert rows_at(kuka, home)[0] < rows_at(kuka, BACK)[0] < rows_at(kuka, home)[-1] < len(kuka) - 1
    kuka, abb, reis = (second.report.q[name] for name in ("kuka", "abb", "reis"))
    at_home, out, before = rows_at(kuka, home)[0], rows_at(kuka, OUT)[0], rows_at(abb, ABB)[0]
    assert 0 < at_home < out < before < len(kuka) - 1
    moving = np.flatnonzero(np.any(np.diff(reis, axis=0) != 0.0, axis=1))
    assert out <= moving[0]
    assert moving[-1] < before
    assert second.rungs == {
        "kuka": "straight over 2 via points",
        "abb": "straight over 1 via point",
        "reis": "straight",
    }
    checks = [check for run in solution.runs for check in run.report.checks if check.name == "via_point"]
    assert [(check.subject, check.passed) for check in checks] == [("kuka", True), ("kuka", True), ("abb", True)]
    clearance = [check for check in second.report.checks if check.name in ("clearance", "collision")]
    assert clearance
    assert all(check.passed for check in clearance)


def test_a_table_that_leaves_a_via_point_out_or_passes_it_too_late_fails(solution: Solution) -> None:
    reports = [run.report for run in solution.runs]
    place = next(place for place, run in enumerate(solution.runs) if run.name == "transfer-1")
    q, before = reports[place].q["kuka"], len(reports[place].checks)

    def check_of(changed: Array) -> object:
        changed_reports = list(reports)
        changed_reports[place] = replace(reports[place], q={**reports[place].q, "kuka": changed})
        return with_via_points(solution.cell, changed_reports)[place].checks[before]

    straight = q[0] + np.linspace(0.0, 1.0, len(q))[:, None] * (q[-1] - q[0])
    missed = check_of(straight)
    assert not missed.passed
    assert missed.value == pytest.approx(np.abs(straight - np.radians(BACK)).max(axis=1).min())
    assert "kuka misses a via point by" in missed.message
    at = rows_at(q, BACK)[0]
    backwards = np.concatenate([q[at + 1 :], q[: at + 1]])  # home, then the point, and home no more
    assert check_of(q).passed
    assert not check_of(backwards).passed


def test_the_resolved_cell_has_them(tmp_path: Path) -> None:
    cell = with_via()
    again = tmp_path / "again.yaml"
    again.write_text(render_cell(cell), encoding="utf-8")

    task = load_cell(again).task("circle")

    assert [None if point is None else point.tolist() for point in (*task.via_before, *task.via_after)] == [
        np.radians(BACK).tolist(),
        None,
        None,
        np.radians(OUT).tolist(),
    ]


def test_a_via_point_in_which_the_robot_touches_itself_is_refused_at_its_key() -> None:
    folded = [0, 30, 100, 0, -45, -180]

    with pytest.raises(InputError, match=r"tasks\.circle\.via\.before\[1\]: 'kuka' comes too close there: 'kuka/"):
        solve(with_via(**{"tasks.circle.via": {"before": [BACK, folded]}}), is_reported=False)
