"""What decides the length of the common clock, in the record and in words."""

from dataclasses import replace

import pytest
from builders.random_cells import random_cell

from cellplan.report.record.clock import clock_from
from cellplan.report.text.notes import clock_note


@pytest.mark.parametrize(
    ("duration", "step", "origin"),
    [
        (4.0, 0.001, "motion.duration_s"),
        (0.3, 0.1, "motion.duration_s"),  # 0.3 / 0.1 is 2.9999999999999996
        (4.0, 4.0, "motion.duration_s"),
        (4.0, 0.03, "step after motion.duration_s"),
        (4.0005, 0.001, "step after motion.duration_s"),
        (None, 0.03, "tasks"),
    ],
)
def test_the_record_says_what_the_clock_follows(duration: float | None, step: float, origin: str) -> None:
    cell = random_cell(0, operators=1)
    assert clock_from(replace(cell, motion=replace(cell.motion, duration=duration, step=step))) == origin


def test_only_a_clock_as_long_as_the_cell_says_needs_no_words() -> None:
    assert clock_note({"clock_from": "tasks"}).endswith("the clock ends with the last task")
    assert clock_note({"clock_from": "step after motion.duration_s"}).endswith("the clock ends with the step after it")
    assert not clock_note({"clock_from": "motion.duration_s"})
