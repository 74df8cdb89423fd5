"""Rules between tasks, kept and broken by a known amount, of programs that were written by hand."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders.uncertified import uncertified

from cellplan.checks.joints.joins import with_via_points
from cellplan.files.cell.load import load_cell
from cellplan.model.report.report import Check
from cellplan.model.settings.program import OrderEntry, ProgramEntry
from cellplan.model.settings.units import Mm
from cellplan.runs.solution import Solution
from cellplan.runs.solve import solve

FIXED = Path(__file__).resolve().parents[2] / "cells" / "fixed_part.yaml"
VALUES: dict[str, object] = {
    "motion": {"mode": "part_at_rest", "step_s": 0.05},
    "tasks.ring.duration_s": 4,
    "tasks.frame.duration_s": 5,
    "program": {},
}


def solved(values: dict[str, object], **rules: Any) -> Solution:
    """The cell with rules that are judged only, and not refused where no program keeps them."""
    cell = load_cell(FIXED).with_values({**VALUES, **values})
    return uncertified(replace(cell, program=ProgramEntry(**rules)))


def checks_of(solution: Solution, name: str) -> list[tuple[str | None, Check]]:
    """Checks of a kind, with the phases in whose report they stand."""
    return [(run.name, check) for run in solution.runs for check in run.report.checks if check.name == name]


@pytest.fixture(scope="module")
def at_once() -> Solution:
    return solved({"tasks.ring.tack": True}, tacks_first=True, together=("ring", "frame"))


def test_tasks_at_once_begin_together_and_not_one_after_the_other(at_once: Solution) -> None:
    """The second begins with the first, whose path takes four seconds."""
    [(phase, together)], [(_, order)] = checks_of(at_once, "together"), checks_of(at_once, "task_order")

    assert (phase, together.subject, together.value) == ("work-1", "ring, frame", 0.0)
    assert not order.passed
    assert order.value == pytest.approx(-4.0)
    assert order.limit == 0.0
    assert not at_once.passed


@pytest.mark.slow
def test_tasks_in_turn_begin_apart_by_a_path_and_what_lies_between() -> None:
    solution = solved({"tasks.ring.after": "frame"}, together=("ring", "frame"))
    between = sum(run.report.cycle_time for run in solution.runs[1:3])

    [(phase, together)] = checks_of(solution, "together")

    assert phase == "work-2"
    assert not together.passed
    assert together.value == pytest.approx(between)
    assert together.at_s == pytest.approx(0.5)


@pytest.mark.slow
def test_turns_and_robots_are_judged_by_what_the_program_does() -> None:
    """One alternation kept, and tasks of two robots that one should do."""
    turns = OrderEntry(alternate=(("ring",), ("frame",)))
    solution = solved({"tasks.frame.after": "ring"}, same_robot=("ring", "frame"), order=turns)

    [(_, order)], [(_, robots)] = checks_of(solution, "task_order"), checks_of(solution, "same_robot")
    transfer = solution.runs[2].report.cycle_time
    assert order.passed
    assert order.value == pytest.approx(0.5 + transfer + 0.5)
    assert not robots.passed
    assert (robots.value, robots.limit) == (2, 1)
    assert "done by left, right" in robots.message


@pytest.mark.slow
def test_a_rest_lasts_from_the_end_of_one_path_to_the_begin_of_the_next() -> None:
    """Paths on opposite faces of a block, 300 mm apart: the part cools while one tool leaves and the other comes."""
    solution = solved({"tasks.frame.after": "ring"}, rest_s=60.0, apart_mm=Mm(301))
    far = solved({"tasks.frame.after": "ring"}, rest_s=60.0, apart_mm=Mm(299))

    [(phase, rest)] = checks_of(solution, "rest")

    assert phase == "work-2"
    assert rest.subject == "ring, frame"
    assert rest.value == pytest.approx(0.5 + solution.runs[2].report.cycle_time + 0.5)
    assert (rest.passed, rest.limit) == (False, 60.0)
    assert checks_of(far, "rest") == []


@pytest.mark.slow
def test_paths_at_once_leave_no_rest_unless_they_begin_together_by_a_rule() -> None:
    [(_, rest)] = checks_of(solved({}, rest_s=0.1, apart_mm=Mm(400)), "rest")
    together = solved({}, rest_s=0.1, apart_mm=Mm(400), together=("ring", "frame"))

    assert not rest.passed
    assert rest.value in (pytest.approx(-4.0), pytest.approx(-5.0))
    assert checks_of(together, "rest") == []


@pytest.mark.slow
def test_tips_at_once_keep_the_distance_of_their_paths_on_the_part() -> None:
    near, far = solved({}, arcs_apart_mm=Mm(250)), solved({}, arcs_apart_mm=Mm(700))
    tasks, times = near.runs[1].schedule.tasks, near.runs[1].schedule.times
    rows = (times >= 0.5) & (times <= min(it.end for it in tasks))
    gaps = np.linalg.norm(tasks[0].X_PT[rows, :3, 3] - tasks[1].X_PT[rows, :3, 3], axis=1)

    [(phase, passing)], [(_, failing)] = checks_of(near, "arc_distance"), checks_of(far, "arc_distance")

    assert phase == "work-1"
    assert passing.value == failing.value == pytest.approx(1e3 * gaps.min(), abs=0.2)  # the tolerance of both tools
    assert passing.value >= 300.0
    assert (passing.passed, failing.passed, failing.limit) == (True, False, 700.0)
    assert checks_of(solved({"tasks.frame.after": "ring"}, arcs_apart_mm=Mm(700)), "arc_distance") == []


SERVICE = {"at": [10, 0, 20, 0, 45, 0], "takes_s": 1.23, "every": {"seams": 1}}


@pytest.mark.slow
def test_a_tool_is_cleaned_in_its_place_for_its_time_and_not_too_late() -> None:
    """The transfer with a service lasts as long as both ways and the service, in whole steps."""
    cell = load_cell(FIXED).with_values(
        {**VALUES, "tasks.frame.after": "ring", "robots.right.service": SERVICE, "program": {"cycles": 2}}
    )
    late = solve(cell, is_reported=False)
    clean = solve(cell.with_values({"tasks.frame.via": {"before": ["service"]}}), is_reported=False)

    [(_, count)] = checks_of(late, "service")
    assert (count.passed, count.value, count.limit) == (False, 2, 1)  # one in each cycle
    [(phase, stay), (_, count)] = checks_of(clean, "service")
    assert (phase, stay.passed, stay.limit) == ("transfer-2", True, 1.23)
    assert stay.value == pytest.approx(1.25)
    assert (count.passed, count.value) == (True, 1)
    run = next(run for run in clean.runs if run.name == phase)
    rows = np.flatnonzero(np.abs(run.report.q["right"] - np.radians(SERVICE["at"])).max(axis=1) < 1e-9)
    assert np.ptp(run.report.times[rows]) == pytest.approx(1.25)
    for q in run.report.q.values():
        assert np.ptp(q[rows], axis=0).max() < 1e-9
    short = replace(run.report, times=run.report.times * 0.5)
    reports = [short if it is run else it.report for it in clean.runs]
    checks = [it for it in with_via_points(clean.cell, reports)[2].checks[len(short.checks) :] if it.name == "service"]
    assert [(it.passed, it.value) for it in checks] == [(False, pytest.approx(0.625))]
