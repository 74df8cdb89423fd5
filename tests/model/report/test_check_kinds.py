"""Kinds of checks: every name in one list, and the page that explains them names the same ones."""

import re
from pathlib import Path

import pytest

from cellplan.model.report.check_kinds import CHECK_KINDS, GRAVITY
from cellplan.model.report.report import Check

PAGE = Path(__file__).parents[3] / "docs" / "concepts" / "checks.md"
ELSEWHERE = {
    *("start_collision", "joint_margin"),  # of `check` and of a repair
    *("begin", "standing", "coming_apart"),  # of a recovery
    *("true_position_error", "true_orientation_error"),  # of a rehearsal
}


def test_a_name_that_is_not_in_the_list_does_not_exist() -> None:
    with pytest.raises(ValueError, match=r"expected one of .*, got 'depth_of_nothing'"):
        Check(name="depth_of_nothing", subject="", passed=True, value=0.0, limit=0.0, unit="mm", at_s=None, message="")


def test_a_stop_into_the_part_is_graver_than_joints_that_do_not_return() -> None:
    assert GRAVITY["stop_depth"] < GRAVITY["stop_clearance"] < GRAVITY["joint_drift"]


def test_the_page_on_checks_explains_all_of_them() -> None:
    rows = re.findall(r"^\| (`[^|]*`) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert CHECK_KINDS.keys() - named == ELSEWHERE
