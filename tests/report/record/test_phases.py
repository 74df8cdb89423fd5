"""Figures of a program name the phase that they are from, also where two phases are alike."""

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from builders.random_cells import random_cell
from builders.records import whole_record

from cellplan.model.cell.acceleration import MotionAccelerations, PointAcceleration
from cellplan.model.motion.plan import Phase
from cellplan.model.report.report import Report
from cellplan.report.page.figures import key_figures
from cellplan.report.page.first_screen import worst_instant
from cellplan.report.page.render import report_page
from cellplan.report.record.common import as_json
from cellplan.report.record.phases import clock_from, phase_key
from cellplan.report.text.notes import clock_note
from cellplan.report.text.run import figure_lines

PHASES = (
    Phase(name="work-1", begin=0.0, end=4.0, in_program=True, roles={}),
    Phase(name="work-2", begin=4.0, end=8.0, in_program=True, roles={}),
)


def narrower(report: Report, by: float) -> Report:
    """The report with all of its distances and margins smaller, at the same times."""
    minima = {
        kind: value if value.minimum is None else replace(value, minimum=value.minimum - by)
        for kind, value in report.clearance.minima.items()
    }
    return replace(report, clearance=replace(report.clearance, minima=minima))


@pytest.fixture
def alike(passed_run: Any) -> dict[str, Report]:
    """Two phases with the same motion; the second one comes nearer, one joint is faster and one tool harder in it."""
    point = PointAcceleration(peak=3.5, peak_at_s=0.1, peak_jerk=80.0, peak_jerk_at_s=0.2, window=0.004)
    first = replace(
        passed_run.report, phases=PHASES, phase="work-1", accelerations=MotionAccelerations(tools={"kuka": point})
    )
    uses = [replace(use, peak_velocity=1.01 * use.peak_velocity) for use in first.joints]
    harder = MotionAccelerations(tools={"kuka": replace(point, peak_jerk=81.0)})
    second = replace(narrower(first, 1e-3), phase="work-2", joints=tuple(uses), accelerations=harder)
    return {"work-1": first, "work-2": second}


def summary(run: Any, reports: dict[str, Report]) -> Any:
    return json.loads(as_json(whole_record(reports, cell=run.cell, provenance=run.provenance)))


def instants(record: Any, path: str = "") -> Iterator[tuple[str, Any, str]]:
    """Path, holder and key of every instant of a record."""
    if isinstance(record, dict):
        for key, value in record.items():
            if key.endswith("at_s") and isinstance(value, float):
                yield f"{path}.{key}", record, key
            yield from instants(value, f"{path}.{key}")
    elif isinstance(record, list):
        for place, value in enumerate(record):
            yield from instants(value, f"{path}[{place}]")


def test_every_instant_of_a_program_names_its_phase(passed_run: Any, alike: dict[str, Report]) -> None:
    named = [(path, holder.get(phase_key(key))) for path, holder, key in instants(summary(passed_run, alike))]

    assert len(named) > 50
    assert [path for path, phase in named if phase not in alike] == []


def test_the_phase_is_that_of_the_worst_also_where_all_times_are_alike(
    passed_run: Any, alike: dict[str, Report]
) -> None:
    record = summary(passed_run, alike)

    assert {value["phase"] for value in record["clearance"].values() if value["at_s"] is not None} == {"work-2"}
    joint = record["joints"]["kuka"]["B2"]
    assert (joint["margin_phase"], joint["peak_velocity_phase"]) == ("work-1", "work-2")
    tool = record["accelerations"]["tools"]["kuka"]
    assert (tool["peak_acceleration_phase"], tool["peak_jerk_phase"]) == ("work-1", "work-2")
    assert {task["phase"] for task in record["tasks"].values()} <= set(alike)
    assert {check["phase"] for check in record["checks"]} == set(alike)


def test_terminal_page_caption_and_link_name_the_same_phase(passed_run: Any, alike: dict[str, Report]) -> None:
    record = summary(passed_run, alike)
    at = record["clearance"]["whole"]["at_s"]

    card = next(entry for entry in key_figures(record) if entry["label"] == "Smallest clearance")
    caption, page = worst_instant(record), report_page(record, cell=passed_run.cell, plots={})
    (line,) = (line for line in figure_lines(record, "the report") if line.strip().startswith("smallest clearance"))

    assert caption is not None
    assert (card["phase"], caption["phase"], caption["at_s"]) == ("work-2", "work-2", at)
    assert f"at {at:.3f} s of work-2" in line
    assert f"#t={round(4.0 + at, 4)}" in page.split("<figcaption>")[1].split("</figcaption>")[0]
    assert " s of work-2" in page.split("<figcaption>")[1].split("</figcaption>")[0]


def test_a_page_of_a_program_says_the_phase_of_each_time_in_its_tables(
    passed_run: Any, alike: dict[str, Report]
) -> None:
    page = report_page(summary(passed_run, alike), cell=passed_run.cell, plots={})
    joints = page[page.index('id="joints"') : page.index('id="clearance"')]

    times, phases = joints.count('class="at"'), joints.count('</a> <span class="soft">work-')
    assert times > 20
    assert phases >= times - len(passed_run.report.tasks) * 20  # spans in which a task is slower are those of its row
    assert joints.count('<span class="soft">work-2</span>') > 10


def test_a_run_by_itself_needs_no_phases(passed_run: Any) -> None:
    from builders.records import phase_record

    record = phase_record(passed_run.report, cell=passed_run.cell, provenance=passed_run.provenance)

    assert "phase" not in record["clearance"]["whole"]
    assert not any("s of " in line for line in figure_lines(record, "the report") if " at " in line)


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
