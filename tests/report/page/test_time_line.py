"""Time line: every robot has something to do, or stands, all the time; ticks are round numbers."""

from dataclasses import replace
from typing import Any

import pytest
from builders.records import phase_record

from cellplan.model.motion.plan import Carry, Hold, Phase, Transfer, Work
from cellplan.model.settings.task import ProcessEntry
from cellplan.model.task.task import StraightMove
from cellplan.report.page.time_line import task_times, time_line

OVER = {"process", "settle"}  # drawn over other spans


@pytest.fixture
def busy(passed_run: Any) -> Any:
    """A run of which one task has a process, a dwell and an approach, and begins late."""
    circle = next(task for task in passed_run.cell.tasks if task.name == "circle")
    process = ProcessEntry(feed_mm_s=200.0, on_delay_s=0.3, off_delay_s=0.2)
    timed = replace(circle, process=process, dwell=0.25, approach=StraightMove(distance=0.05, duration=0.5), settle=0.1)
    tasks = tuple(timed if task is circle else task for task in passed_run.cell.tasks)
    accuracy = tuple(
        replace(accuracy, start_s=0.5, end_s=3.0) if accuracy.task == "circle" else accuracy
        for accuracy in passed_run.report.accuracy
    )
    roles = {"kuka": Work("circle"), "abb": Work("rhombus"), "staubli": Transfer("work"), "reis": Carry()}
    phases = (Phase(name="all tasks", roles=roles, end=4.0),)
    report = replace(passed_run.report, accuracy=accuracy, phases=phases)
    return replace(passed_run, cell=replace(passed_run.cell, tasks=tasks), report=report)


def line_of(run: Any) -> Any:
    record = phase_record(run.report, cell=run.cell, provenance=run.provenance)
    return time_line(record, run.cell), task_times(record, run.cell)


def test_spans_of_a_robot_follow_one_another_from_begin_to_end(busy: Any) -> None:
    line, _ = line_of(busy)

    assert line["total"] == pytest.approx(4.0)
    for strip in line["strips"]:
        spans = [span for span in strip["spans"] if span["kind"] not in OVER]
        assert spans[0]["begin"] == 0.0
        assert spans[-1]["end"] == pytest.approx(4.0)
        assert [span["begin"] for span in spans[1:]] == pytest.approx([span["end"] for span in spans[:-1]])
        assert sum(span["width"] for span in spans) == pytest.approx(100.0, abs=0.01)  # in thousandths of a percent


def test_a_process_is_on_from_its_start_until_its_delay_at_the_end_is_over(busy: Any) -> None:
    line, times = line_of(busy)

    spans = {span["kind"]: (span["begin"], span["end"]) for span in line["strips"][0]["spans"] if span["width"] > 0.0}
    assert spans["process"] == pytest.approx((0.5, 3.2))
    assert spans["work"] == pytest.approx((0.8, 3.0))
    assert spans["dwell"] == pytest.approx((3.2, 3.45))
    assert spans["settle"] == pytest.approx((0.5, 0.6))
    assert spans["move"] == pytest.approx((0.0, 0.5))
    (circle,) = [task for task in times if task["name"] == "circle"]
    assert circle["process"] == pytest.approx(spans["process"])


@pytest.mark.parametrize("total", [0.03, 1.0, 4.0, 6.0, 23.476, 599.0])
def test_ticks_are_few_round_and_equally_far_apart(busy: Any, total: float) -> None:
    roles = {"kuka": str(Hold())}
    record = {"phases": [{"name": "p", "begin_s": 0.0, "end_s": total, "roles": roles}], "tasks": {}, "phase": None}

    ticks = [tick["at"] for tick in time_line({**record, "cycle_time_s": total}, busy.cell)["ticks"]]

    step = ticks[1]
    assert float(f"{step:.0e}") == pytest.approx(step)
    assert 3 <= len(ticks) <= 7
    assert ticks == pytest.approx([k * step for k in range(len(ticks))])
    assert total - step < ticks[-1] <= total * (1.0 + 1e-9)
