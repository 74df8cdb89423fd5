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


def words(lines: list[str]) -> list[str]:
    """Lines without the width of their columns."""
    return [" ".join(line.split()) for line in lines]


def test_a_passed_run_is_reported_in_a_few_lines(record: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()

    assert summary_lines(record, tmp_path) == [
        "pair: passed",
        "  1 check passed; mode simultaneous, 4 s",
        "  smallest clearance     12.3 mm, certified       pen/tool - holder/A2 at 0.250 s",
        "  smallest joint margin  37.2 deg                 holder A2 at 1.500 s",
        "  largest joint speed    35.1 % of its limit      pen B1 at 2.500 s",
        "  largest tool error     0.00163 mm, 0.00002 deg  task ring (pen)",
        f"report: {tmp_path / 'report.html'}",
        f"tables: {tmp_path / 'tables'}",
    ]


def test_a_method_of_ones_own_choice_and_what_it_gave_up_are_reported(record: dict[str, Any], tmp_path: Path) -> None:
    record["solver"] = {"method": "quadratic_program", "slack": {"max": 0.01234, "max_at_s": 1.5, "unit": "m/s"}}

    lines = summary_lines(record, tmp_path)

    assert lines[1] == "  1 check passed; mode simultaneous, 4 s, method quadratic_program"
    assert "largest task slack 0.012 m/s at 1.500 s" in words(lines)
    assert any(line.startswith("  note: No accurate mode: quadratic_program gives up part of a task") for line in lines)


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

    record["solver"]["secondary"] = {"posture": {"gain": 50.0}}

    line = next(line for line in summary_lines(record, tmp_path) if "collocation" in line)
    assert line.endswith("Euler steps; 'arm' is singular; smaller gains of the secondary goals may help")


def test_every_failed_check_has_a_line_and_no_tables_are_offered(record: dict[str, Any], tmp_path: Path) -> None:
    record |= {
        "status": "failed",
        "checks": [
            {"name": "collision", "passed": False, "message": "first"},
            {"name": "joint_position", "passed": False, "message": "second", "phase": "ring"},
            {"name": "collision", "passed": True, "message": "fine"},
            {"name": "collision", "passed": False, "message": "third"},
        ],
    }

    lines = summary_lines(record, tmp_path)

    assert lines[:7] == [
        "pair: failed",
        "  3 of 4 checks failed; mode simultaneous, 4 s",
        "  collisions: 2 failed",
        "    FAILED first",
        "    FAILED third",
        "  joint limits: 1 failed",
        "    FAILED ring: second",
    ]
    assert not any(line.startswith("tables:") for line in lines)


def test_of_many_failed_checks_of_one_kind_the_first_are_shown(record: dict[str, Any], tmp_path: Path) -> None:
    record["checks"] = [{"name": "joint_drift", "passed": False, "message": f"joint {x}"} for x in range(10)]

    lines = summary_lines(record, tmp_path)

    assert lines[2:4] == ["  joint drift: 10 failed", "    FAILED joint 0"]
    assert lines[10:12] == ["    FAILED joint 7", "    and 2 more, all in the report"]


def test_pairs_that_were_not_checked_in_full_are_counted_by_kind(record: dict[str, Any], tmp_path: Path) -> None:
    grip = {"kind": "grip", "bodies": ["a/hand", "part"], "reason": "holds the part"}
    record["left_out"] = [{**grip, "kind": "contact_only"}, grip, {**grip, "kind": "contact_only"}]
    some = summary_lines(record, tmp_path)
    record["left_out"] = []

    assert "  not checked in full: 3 pairs (1 grip, 2 contact only); all in the report" in some
    assert "  every pair was checked in full" in summary_lines(record, tmp_path)


def test_sliding_and_turning_joints_are_not_compared(record: dict[str, Any], tmp_path: Path) -> None:
    record["joints"]["rail"] = {"X": use(unit="mm", margin=500.0), "endless": use(margin=None)}

    lines = summary_lines(record, tmp_path)

    assert "smallest joint margin 37.2 deg holder A2 at 1.500 s" in words(lines)
    assert "smallest joint margin 500.0 mm rail X at 1.500 s" in words(lines)


def test_a_sliding_joint_has_a_force(record: dict[str, Any], tmp_path: Path) -> None:
    drive = {"peak_torque_at_s": 0.5, "torque_ratio": 0.75, "unit": "N"}
    record["torques"] = {"rail": {"joints": {"X": drive}, "energy_j": 5.0}}

    lines = words(summary_lines(record, tmp_path))

    assert "largest joint force 75.0 % of its limit rail X at 0.500 s" in lines


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


@pytest.mark.parametrize(
    ("binding", "limit", "words_of_it"),
    [
        (
            "ring",
            "tolerance between rows",
            "40.0: tolerance between rows, at 3 mm at 2.000 s; a smaller motion.step_s allows",
        ),
        ("pen B2", "jerk", "40.0: pen B2, jerk, at 3 mm at 2.000 s"),
    ],
)
def test_what_binds_the_feed_is_said_once(
    record: dict[str, Any], tmp_path: Path, binding: str, limit: str, words_of_it: str
) -> None:
    feed = {"feed_mm_s": 40.0, "greatest_mm_s": 40.1, "at_mm": 3.0, "at_s": 2.0, "in_ramp": False, "point": ""}
    record["tasks"]["ring"]["greatest_feed"] = feed | {"binding": binding, "limit": limit}

    assert any(f"task ring at {words_of_it}" in line for line in words(summary_lines(record, tmp_path)))


def test_a_tube_in_which_a_path_is_no_smoother_is_said(record: dict[str, Any], tmp_path: Path) -> None:
    errors = {"max_position_error_mm": 0.1, "max_orientation_error_deg": 0.1, "max_depth_mm": 0.0}
    for smoothed, is_said in ((0.99, True), (0.1, False)):
        points = {"given": 1.0, "smoothed": smoothed, "bound": 0.05}
        record["tasks"]["ring"]["smoothing"] = errors | {"points": points, "axes": None}
        (row,) = [line for line in words(summary_lines(record, tmp_path)) if line.startswith("roughness of points")]
        assert ("the tube gains nothing" in row) == is_said


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

    assert "largest joint drift 0.5312 deg pen B2 in cycle 7 of 25 of task ring" in words(drifting)
    assert "largest joint drift 1.25 mm rail X in cycle 1 of 25 of task ring" in words(drifting)
    assert not any("drift" in line for line in closing)
