"""Figures of clocks that only a report states: a search does not work them out, and all else stays the same."""

from pathlib import Path
from typing import Any

import pytest

from cellplan import load_cell, solve
from cellplan.model.cell.cell import Cell
from cellplan.model.progress import silent
from cellplan.runs.early_clearance import EarlyClearance
from cellplan.runs.solve import certified, solve_motion

SHIPPED = Path(__file__).parents[2] / "cells"


def on_two_controllers(**checks: Any) -> Cell:
    """Two planar arms, each on a controller of its own."""
    values: dict[str, Any] = {
        "controllers": {name: {"kind": "other", "reaction_ms": 20} for name in ("a", "b")},
        "robots.left.controller": {"id": "a"},
        "robots.right.controller": {"id": "b"},
        "motion.step_s": 0.04,
        "tasks.circle.tolerance.position_mm": 1,
        "tasks.circle.tolerance.orientation_deg": 1,
    }
    return load_cell(SHIPPED / "planar_pair.yaml").with_values(values | checks)


@pytest.mark.slow
def test_a_search_has_the_same_program_without_figures_of_clocks() -> None:
    cell = on_two_controllers()

    full, searched = solve(cell), solve(cell, is_reported=False)

    first, second = full.runs[0].report, searched.runs[0].report
    assert first.skew is not None
    assert first.stops is not None
    assert (second.skew, second.stops) == (None, None)
    assert first.checks == second.checks
    assert (full.program.tables, full.program.clock) == (searched.program.tables, searched.program.clock)


@pytest.mark.parametrize("clearance_mm", [pytest.param(0.001, marks=pytest.mark.slow), 9000])
def test_what_a_cell_demands_of_stops_counts_in_a_search_too(clearance_mm: float) -> None:
    cell = on_two_controllers(**{"checks.stop": {"clearance_mm": clearance_mm}})
    _, motion = solve_motion(cell, task=None, progress=silent)

    result = certified(motion, progress=silent, early=EarlyClearance())

    report = result.runs[0].report
    assert report.skew is None
    (check,) = [check for check in report.checks if check.name == "stop_clearance"]
    assert check.passed is (clearance_mm < 1.0)
