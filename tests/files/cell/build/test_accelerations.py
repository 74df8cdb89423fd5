"""The key `acceleration` of a cell and of its robots, and the cycle of the controllers."""

from collections.abc import Callable

import numpy as np
import pytest

from cellplan.files.cell.write import render_cell
from cellplan.model.cell.acceleration import LimitSource
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_limits import acceleration_limit

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]

HOLDER = "    model: kuka_kr6\n"
ALL = ", ".join(f"{name}: {{acceleration_deg_s2: 500}}" for name in ("A2", "B2", "C2", "D2", "E2", "F2"))


def of_cell(words: str) -> tuple[str, str]:
    return "environment:\n", f"acceleration: {words}\nenvironment:\n"


def of_holder(words: str) -> tuple[str, str]:
    return HOLDER, f"{HOLDER}    acceleration: {words}\n"


def limits(cell: Cell, robot: str) -> list[tuple[float | None, LimitSource]]:
    result = [acceleration_limit(cell.robot(robot), index) for index in range(6)]
    return [(None if limit is None else round(float(np.degrees(limit)), 6), source) for limit, source in result]


def test_full_speed_in_a_quarter_of_a_second_is_assumed_for_three_axes_and_in_less_for_the_wrist(load: Load) -> None:
    assert limits(load(), "holder") == [
        (round(speed / seconds, 6), LimitSource.ASSUMED)
        for speed, seconds in zip((156, 156, 156, 343, 362, 659), (0.25,) * 3 + (0.15,) * 3, strict=True)
    ]


def test_a_stated_limit_counts_and_the_others_are_assumed(load: Load) -> None:
    cell = load(of_holder("{full_speed_in_s: 0.5}\n    limits: {B2: {acceleration_deg_s2: 400}}"))

    assert limits(cell, "holder")[:3] == [
        (312.0, LimitSource.ASSUMED),
        (400.0, LimitSource.STATED),
        (312.0, LimitSource.ASSUMED),
    ]
    assert limits(cell, "worker")[0] == (720.0, LimitSource.ASSUMED)


def test_a_speed_limit_of_the_cell_leaves_the_assumption_as_it_is(load: Load) -> None:
    cell = load(of_holder("{full_speed_in_s: 0.25}\n    limits: {A2: {velocity_deg_s: 10}}"))

    assert limits(cell, "holder")[0] == (624.0, LimitSource.ASSUMED)


def test_the_word_of_a_robot_counts_before_that_of_the_cell(load: Load) -> None:
    cell = load(of_cell("{unlimited: a study of paths}"), of_holder("{full_speed_in_s: [0.4, 0.2]}"))

    assert limits(cell, "worker") == [(None, LimitSource.UNLIMITED)] * 6
    assert cell.robot("worker").acceleration.reason == "a study of paths"
    assert [limit for limit, _ in limits(cell, "holder")][:3] == [390.0, 780.0, 780.0]


def test_the_plain_word_unlimited_is_taken_without_a_reason(load: Load) -> None:
    rule = load(of_cell("unlimited")).robot("holder").acceleration
    assert rule.is_unlimited
    assert not rule.reason


def test_stated_limits_for_all_joints_need_no_assumption(load: Load) -> None:
    cell = load(of_holder(f"stated\n    limits: {{{ALL}}}"))
    assert limits(cell, "holder") == [(500.0, LimitSource.STATED)] * 6


def test_jerk_is_limited_where_the_cell_says_so(load: Load) -> None:
    cell = load(of_holder("{full_speed_in_s: 0.25}\n    limits: {A2: {jerk_deg_s3: 9000}}"))
    jerks = [joint.jerk for joint in cell.robot("holder").model.joints]
    assert jerks == [pytest.approx(np.radians(9000.0)), None, None, None, None, None]


def test_the_cycle_of_a_robot_counts_before_that_of_the_motion(load: Load) -> None:
    cell = load(
        ("duration_s: 4", "duration_s: 4, controller_cycle_ms: 8"), (HOLDER, f"{HOLDER}    controller_cycle_ms: 2\n")
    )
    assert [robot.controller_cycle for robot in cell.robots] == [0.002, 0.008]


@pytest.mark.parametrize(
    "words",
    ["unlimited", '{unlimited: "why: because"}', "{full_speed_in_s: [0.3, 0.2]}", "{full_speed_in_s: 0.3}"],
)
def test_rule_and_cycle_of_every_robot_are_written_out(load: Load, words: str) -> None:
    cell = load(of_cell(words))
    text = render_cell(cell)

    assert text.count("    acceleration: ") == 2
    assert text.count("    controller_cycle_ms: 4") == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            of_cell("stated"),
            "c:22: acceleration: expected a stated limit for every joint of 'holder', got none for A2, B2, C2, D2, E2, "
            "F2; give robots.holder.limits: {A2: {acceleration_deg_s2: …}}, or acceleration: {full_speed_in_s: …}",
        ),
        (
            of_holder("{full_speed_in_s: [1, 1, 1, 1, 1, 1, 1]}"),
            "c:6: robots.holder.acceleration.full_speed_in_s: expected at most 6 times, one per joint "
            "(A2, B2, C2, D2, E2, F2), got 7",
        ),
        (
            of_cell("{full_speed_in_s: [1, 1, 1, 1, 1, 1, 1]}"),
            "c:22: acceleration.full_speed_in_s: expected at most 6 times, one per joint of the longest arm that it "
            "counts for, got 7",
        ),
        (
            of_holder("{unlimited: why}\n    limits: {A2: {jerk_deg_s3: 9000}}"),
            "c:7: robots.holder.limits.A2.jerk_deg_s3: expected no limit, as robots.holder.acceleration is unlimited "
            "and nothing is judged against it, got 9000; remove it, or give robots.holder.acceleration: "
            "{full_speed_in_s: …}",
        ),
        (
            of_holder("{full_speed_in_s: 0}"),
            "c:6: robots.holder.acceleration.full_speed_in_s: expected a positive number of seconds, got 0",
        ),
        (
            of_holder("{unlimited: why, full_speed_in_s: 1}"),
            "c:6: robots.holder.acceleration: expected exactly one of the keys full_speed_in_s, unlimited, got "
            "full_speed_in_s and unlimited",
        ),
        (
            of_holder("unlimitd"),
            "c:6: robots.holder.acceleration: expected stated, unlimited, {full_speed_in_s: …} or "
            "{unlimited: reason}, got 'unlimitd', did you mean 'unlimited'?",
        ),
        (
            of_holder("3"),
            "c:6: robots.holder.acceleration: expected stated, unlimited, {full_speed_in_s: …} or "
            "{unlimited: reason}, got 3",
        ),
    ],
)
def test_a_rule_that_does_not_fit_is_refused_with_its_cure(
    refuse: Refuse, change: tuple[str, str], message: str
) -> None:
    assert message in refuse(change)


def test_a_limit_of_the_cell_beside_the_unlimited_of_the_cell_is_refused_but_not_with_a_rule_of_the_robot(
    load: Load, refuse: Refuse
) -> None:
    unlimited, limit = of_cell("unlimited"), "    limits: {B2: {acceleration_deg_s2: 400, upper_deg: 30}}\n"

    (message,) = refuse(unlimited, (HOLDER, HOLDER + limit))
    assert message.startswith("c:6: robots.holder.limits.B2.acceleration_deg_s2: expected no limit, as acceleration is")
    cell = load(unlimited, (HOLDER, f"{HOLDER}    acceleration: {{full_speed_in_s: 0.5}}\n{limit}"))
    assert limits(cell, "holder")[1] == (400.0, LimitSource.STATED)
    assert limits(cell, "worker")[1] == (None, LimitSource.UNLIMITED)
