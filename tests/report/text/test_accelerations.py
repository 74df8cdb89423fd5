"""Accelerations on the screen: the worst joint, tool and part, and what was not judged."""

from typing import Any

from cellplan.report.text.run import acceleration_rows, not_judged_lines


def use(ratio: float | None, source: str = "assumed", *, peak: float = 100.0, jerk: float = 500.0) -> dict[str, Any]:
    return {
        "unit": "deg",
        "acceleration_ratio": ratio,
        "acceleration_limit_source": source,
        "peak_acceleration": peak,
        "peak_acceleration_at_s": 1.25,
        "peak_jerk": jerk,
        "peak_jerk_at_s": 0.75,
        "jerk_window_ms": 4.0,
    }


def point(peak: float) -> dict[str, Any]:
    return {"peak_acceleration_m_s2": peak, "peak_acceleration_at_s": 0.5}


def record(**changes: Any) -> dict[str, Any]:
    results = {"tools": {"holder": point(1.0), "pen": point(2.345)}, "part": {"corner": point(57.0)}, "not_judged": []}
    joints = {
        "holder": {"A1": use(0.2), "A2": use(0.471, "stated")},
        "pen": {"B1": use(None, "unlimited", jerk=1234.0)},
    }
    return {"joints": joints, "accelerations": results | changes}


def test_the_worst_joint_the_largest_jerk_tool_and_part_have_a_line_each() -> None:
    assert list(acceleration_rows(record())) == [
        ("largest joint acceleration", "47.1 % of its stated limit", "holder A2 at 1.250 s"),
        ("largest joint jerk", "1234 deg/s3 over 4 ms", "pen B1 at 0.750 s"),
        ("largest tool acceleration", "2.35 m/s2", "tool tip of pen at 0.500 s"),
        ("largest part acceleration", "57 m/s2", "part at 0.500 s"),
    ]


def test_what_was_not_judged_is_reported_once_for_each_reason() -> None:
    left = [{"robot": name, "what": "accelerations and jerk", "reason": "a study"} for name in ("holder", "pen")]
    failing = {"robot": None, "what": "accelerations at 2.000 s, when pen/B1 fails", "reason": "it stops at once"}

    assert list(not_judged_lines(record(not_judged=[*left, failing]))) == [
        "  not judged: accelerations and jerk of holder, pen (a study)",
        "  not judged: accelerations at 2.000 s, when pen/B1 fails (it stops at once)",
    ]


def test_joints_without_limits_are_shown_by_their_own_figure() -> None:
    joints = {"pen": {"B1": use(None, "unlimited", peak=321.0)}}

    first = next(iter(acceleration_rows(record() | {"joints": joints})))

    assert first == ("largest joint acceleration", "321.0 deg/s2, not limited", "pen B1 at 1.250 s")


def test_a_record_of_an_older_version_has_no_such_lines() -> None:
    assert [*acceleration_rows({"joints": {}}), *not_judged_lines({"joints": {}})] == []
