"""The last words of a solve: verdict, figures, failures, places."""

from pathlib import Path
from typing import Any

import pytest

from cellplan.report.text.run import summary_lines


def use(*, unit: str = "deg", margin: float | None = 40.0, ratio: float | None = 0.2) -> dict[str, Any]:
    return {
        "unit": unit,
        "margin": margin,
        "margin_at_s": 1.5,
        "velocity_ratio": ratio,
        "peak_velocity_at_s": 2.5,
    }


@pytest.fixture
def record() -> dict[str, Any]:
    return {
        "cell": "pair",
        "status": "passed",
        "mode": "simultaneous",
        "cycle_time_s": 4.0,
        "tasks": {"ring": {"robot": "pen", "max_position_error_mm": 0.00163, "max_orientation_error_deg": 0.00002}},
        "joints": {"holder": {"A1": use(), "A2": use(margin=37.25)}, "pen": {"B1": use(ratio=0.351)}},
        "clearance": {
            "whole": {"minimum_mm": 12.345, "pair": ["pen/tool", "holder/A2"], "at_s": 0.25, "certified": True}
        },
        "checks": [{"passed": True, "message": "fine"}],
        "solver": {"method": "weighted_pseudo_inverse", "slack": {"max": 0.0, "max_at_s": 0.0, "unit": "m/s"}},
    }


def test_a_passed_run_is_reported_in_a_few_lines(record: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()

    assert summary_lines(record, tmp_path) == [
        "pair: passed",
        "  mode simultaneous, 4 s",
        "  task ring (pen): largest error 0.0016 mm, 2e-05 deg",
        "  smallest joint margin 37.25 deg: holder A2 at 1.500 s",
        "  largest joint speed 35.1 % of its limit: pen B1 at 2.500 s",
        "  smallest clearance 12.35 mm, certified: pen/tool - holder/A2 at 0.250 s",
        f"report: {tmp_path / 'report.html'}",
        f"tables: {tmp_path / 'tables'}",
    ]


def test_a_method_of_ones_own_choice_and_what_it_gave_up_are_reported(record: dict[str, Any], tmp_path: Path) -> None:
    record["solver"] = {"method": "quadratic_program", "slack": {"max": 0.01234, "max_at_s": 1.5, "unit": "m/s"}}

    lines = summary_lines(record, tmp_path)

    assert lines[1] == "  mode simultaneous, 4 s, method quadratic_program"
    assert "  task slack up to 0.012 (m/s) at 1.500 s" in lines


def test_where_the_accurate_mode_gave_up_is_reported(record: dict[str, Any], tmp_path: Path) -> None:
    record["solver"] |= {"integrator": "accurate", "resolution": {"panels": 3, "euler_from_s": 1.25, "lost": None}}
    reported = summary_lines(record, tmp_path)
    record["solver"]["resolution"]["euler_from_s"] = None

    assert [line for line in reported if line not in summary_lines(record, tmp_path)] == [
        "  collocation failed at 1.250 s; continued with Euler steps"
    ]

    record["solver"]["resolution"] |= {"euler_from_s": 1.25, "lost": {"message": "'arm' is singular"}}

    assert "  collocation failed at 1.250 s; continued with Euler steps; 'arm' is singular" in summary_lines(
        record, tmp_path
    )


def test_every_failed_check_has_a_line_and_no_tables_are_offered(record: dict[str, Any], tmp_path: Path) -> None:
    record |= {
        "status": "failed",
        "checks": [
            {"passed": False, "message": "first"},
            {"passed": True, "message": "fine"},
            {"passed": False, "message": "second", "run": "ring"},
        ],
    }

    lines = summary_lines(record, tmp_path)

    assert lines[0] == "pair: failed"
    assert [line for line in lines if "FAILED" in line] == ["  FAILED first", "  FAILED ring: second"]
    assert not any(line.startswith("tables:") for line in lines)


def test_sliding_and_turning_joints_are_not_compared(record: dict[str, Any], tmp_path: Path) -> None:
    record["joints"]["rail"] = {"X": use(unit="mm", margin=500.0), "endless": use(margin=None)}

    lines = summary_lines(record, tmp_path)

    assert "  smallest joint margin 37.25 deg: holder A2 at 1.500 s" in lines
    assert "  smallest joint margin 500 mm: rail X at 1.500 s" in lines


def test_the_tables_of_all_phases_lie_in_one_folder(record: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "rejected").mkdir()
    record["runs"] = {"ring": {}, "line": {}}

    lines = summary_lines(record, tmp_path)

    assert lines[-2:] == [f"report: {tmp_path / 'report.html'}", f"tables: {tmp_path / 'rejected'}"]


def test_what_is_not_known_is_left_out(record: dict[str, Any], tmp_path: Path) -> None:
    record["joints"] = {}
    record["clearance"] = {"whole": {"minimum_mm": None, "pair": None, "at_s": None}}

    lines = summary_lines(record, tmp_path)

    assert not any("margin" in line or "speed" in line or "clearance" in line for line in lines)


def test_a_joint_that_does_not_come_back_is_named(record: dict[str, Any], tmp_path: Path) -> None:
    drifts = {
        "cycles": 25,
        "worst_drift_deg": 0.5312,
        "joint": "pen B2",
        "at_cycle": 7,
        "worst_drift_mm": 1.25,
        "sliding_joint": "rail X",
        "sliding_at_cycle": 1,
        "closes": False,
    }

    record["repeatability"] = {"ring": drifts}
    drifting = summary_lines(record, tmp_path)
    record["repeatability"] = {"all": drifts | {"closes": True}}
    closing = summary_lines(record, tmp_path)

    assert "  joint drift 0.5312 deg in cycle 7 of 25 of task ring: pen B2" in drifting
    assert "  joint drift 1.25 mm in cycle 1 of 25 of task ring: rail X" in drifting
    assert not any("drift" in line for line in closing)
