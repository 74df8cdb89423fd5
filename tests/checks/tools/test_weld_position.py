"""Torches and welds on the sides of a fixed block, whose angles are known, within their limits and beyond."""

import json
from pathlib import Path

import pytest
from builders.uncertified import uncertified

from cellplan.files.cell.load import load_cell
from cellplan.model.report.report import Check

NAMES = ("torch_angle", "weld_slope", "weld_rotation")
FIXED = Path(__file__).resolve().parents[3] / "cells" / "fixed_part.yaml"


def checks_of(values: dict[str, object]) -> dict[tuple[str, str], Check]:
    report = uncertified(load_cell(FIXED).with_values({"motion.step_s": 0.05, **values})).runs[0].report
    return {(check.name, check.subject): check for check in report.checks if check.name in NAMES}


@pytest.mark.slow
def test_horizontal_tools_weld_all_slopes_of_a_ring_and_the_walls_of_a_frame() -> None:
    """A ring on a wall runs up and down, and level at its top and bottom; the tool looks level all along."""
    checks = checks_of(
        {
            "tasks.ring.torch": {"within_deg": 80},
            "tasks.ring.weld_position": {"slope_deg": [-90, 30]},
            "tasks.frame.torch": {"within_deg": 91},
        }
    )

    assert checks["torch_angle", "ring"].value == pytest.approx(90.0, abs=0.02)
    assert not checks["torch_angle", "ring"].passed
    assert checks["torch_angle", "frame"].passed
    assert not checks["weld_slope", "ring"].passed
    assert checks["weld_slope", "ring"].limit == pytest.approx(30.0)
    assert 85.0 < checks["weld_slope", "ring"].value <= 90.0
    assert checks["weld_rotation", "ring"].passed
    assert "position PC, PF, PG" in checks["weld_rotation", "ring"].message
    assert ("weld_slope", "frame") not in checks


def test_tasks_that_demand_nothing_have_no_check(sound: Path) -> None:
    report = json.loads((sound / "run" / "report.json").read_text(encoding="utf-8"))

    names = {check["name"] for check in report["checks"]}
    assert "position_error" in names
    assert not names & set(NAMES)


@pytest.mark.slow
def test_a_level_tool_keeps_a_limit_of_a_right_angle() -> None:
    """Its angle is 90 deg but for the rounding of joint positions."""
    assert checks_of({"tasks.frame.torch": {"within_deg": 90}})["torch_angle", "frame"].passed
    assert not checks_of({"tasks.frame.torch": {"within_deg": 89.9999}})["torch_angle", "frame"].passed
