"""How a motion was found: settings in use under the names of the cell file; words only where they are worth it."""

from dataclasses import replace
from typing import Any, get_args

import numpy as np
import pytest
from builders.records import phase_record

from cellplan.model.motion.motion import Motion, Resolution
from cellplan.model.settings.solver import SolverEntry, WeightingEntry
from cellplan.model.solver import Integrator, MethodName
from cellplan.report.page.render import report_page
from cellplan.report.record.sections.solver import PlanningFacts, solver_record
from cellplan.report.text.method import method_lines

METHODS: tuple[MethodName, ...] = get_args(MethodName)
OWN_SECTION = {
    "damped_least_squares": "damped_least_squares",
    "filtered_inverse": "filtered_inverse",
    "filtered_inverse_ii": "filtered_inverse",
    "heuristic_search": "search",
    "recursive_search": "search",
    "quadratic_program": "quadratic_program",
}


def settings(method: MethodName = "weighted_pseudo_inverse", **given: Any) -> SolverEntry:
    return SolverEntry.model_validate({"method": method, **given}).at_step(1e-3)


def motion(iterations: list[float], slack: list[float]) -> Motion:
    n = len(slack) + 1
    return Motion(times=0.5 * np.arange(n), q=np.zeros((n, 1)), iterations=np.array(iterations), slack=np.array(slack))


def said(solver: SolverEntry, of: Motion | None = None) -> list[str]:
    return list(method_lines(solver_record(solver, PlanningFacts(motion=of)), 1e-3))


def resolved(**figures: Any) -> Motion:
    """A motion of the accurate mode."""
    counts = {"panels": 9, "nodes": 96, "sweeps": 31, "solves": 2976} | figures
    made = Resolution(integrator=Integrator.ACCURATE, **counts)
    return Motion(times=np.arange(2.0), q=np.zeros((2, 1)), resolution=made)


@pytest.mark.parametrize("method", METHODS)
def test_settings_in_use_are_those_of_the_cell_file(method: MethodName) -> None:
    record = solver_record(settings(method))["settings"]
    section = OWN_SECTION.get(method)
    expected = {} if section is None else SolverEntry().model_dump(mode="json")[section]
    if method == "heuristic_search":
        expected.pop("sequence")  # it finds its own
    assert record == expected


@pytest.mark.parametrize("method", METHODS)
def test_every_method_has_a_name_for_people(method: MethodName) -> None:
    first, *more = said(settings(method, integrator="euler"), motion([1, 1], [0, 0]))
    assert first.startswith("Method: ")
    assert "_" not in first
    assert [line.startswith("No accurate mode: ") for line in more] == [True] * (method != "weighted_pseudo_inverse")


def test_an_easy_motion_by_the_usual_method_is_reported_in_one_sentence() -> None:
    assert said(settings(gain_per_s=650, integrator="euler"), motion([1, 1], [0, 0])) == [
        "Method: weighted pseudo-inverse, Euler steps of 1 ms; pose errors are fed back with a gain of 650 per second."
    ]


@pytest.mark.parametrize(
    ("error_between", "words"),
    [
        (6.4567e-8, "below 0.000065 mm"),
        (9.99e-8, "below 0.0001 mm"),
        (0.0, "below 0.0000000011 mm"),
        (4e-13, "below 0.0000000011 mm"),
        (1.5e-4, "below 0.16 mm"),
    ],
)
def test_an_error_between_nodes_is_never_reported_smaller_than_it_is(error_between: float, words: str) -> None:
    assert said(settings(), resolved(error_between=error_between)) == [
        "Method: weighted pseudo-inverse.",
        f"Accurate mode: 96 nodes in 9 panels, error between nodes {words}.",
    ]


def test_a_fall_back_to_steps_is_reported_with_its_instant_and_gain() -> None:
    solver = settings(gain_per_s=650)
    back = "continued with Euler steps of 1 ms; pose errors are fed back with a gain of 650 per second."

    part = said(solver, resolved(panels=1, nodes=12, error_between=None, euler_from=1.25))
    whole = said(solver, resolved(panels=0, nodes=0, euler_from=0.0))

    assert part[1:] == ["Accurate mode: 12 nodes in 1 panel.", f"Collocation failed at 1.250 s; {back}"]
    assert whole[1:] == [f"Collocation failed at 0.000 s; {back}"]


def test_without_the_motion_the_accuracy_asked_for_is_reported() -> None:
    assert said(settings(accuracy_mm=2e-5))[1:] == ["Accurate mode: error between nodes at most 0.00002 mm."]


def test_the_record_says_what_the_accurate_mode_took() -> None:
    record = solver_record(
        settings(accuracy_mm=0.01), PlanningFacts(motion=resolved(error_between=2.5e-9, euler_from=0.5))
    )

    assert (record["integrator"], record["accuracy_mm"]) == ("accurate", 0.01)
    assert record["resolution"] == {
        "panels": 9,
        "nodes": 96,
        "sweeps": 31,
        "solves": 2976,
        "error_between_nodes_mm": 2.5e-6,
        "euler_from_s": 0.5,
        "lost": None,
    }
    assert solver_record(settings())["resolution"] is None
    assert solver_record(settings("quadratic_program"))["integrator"] == "euler"


def test_a_method_that_rules_the_accurate_mode_out_is_never_said_to_be_accurate() -> None:
    changed = settings("damped_least_squares", weighting=WeightingEntry(load=1.0))

    assert changed.integrator == "auto"
    assert solver_record(changed)["integrator"] == "euler"
    assert "Euler steps" in said(changed)[0]


def test_goals_weights_iterations_and_slack_are_reported_when_there_are_any() -> None:
    solver = settings(
        "quadratic_program",
        secondary={"joint_limits": {"gain": 2}, "obstacles": {"within_mm": 150}},
        weighting={"near_limits": 1.5},
    )
    assert said(solver, motion([1, 4, 2], [0, 0, 0.125]))[2:] == [
        "Secondary goals: joint limits (gain 2), obstacles (gain 0.1).",
        "Joint weights change along the motion: near limits 1.5.",
        "Iterations per step: 2.33 on average, 4 at most, at 0.500 s.",
        "Task slack: at most 0.125 at 1.000 s (norm of the twist residual, mixed units: m/s and rad/s).",
    ]
    record = solver_record(solver)
    assert record["secondary"] == {"joint_limits": {"gain": 2.0}, "obstacles": {"gain": 0.1, "within_mm": 150.0}}
    assert record["weighting"] == {"near_limits": 1.5, "load": 0.0}
    assert (record["damping"], solver_record(settings(damping=0.3))["damping"]) == ("auto", 0.3)


def test_the_joints_of_a_sequence_are_named() -> None:
    sequence = [{"robot": "arm", "joint": "A2"}, {"robot": "arm", "joint": "A1"}]
    record = solver_record(settings("recursive_search", search={"sequence": tuple(sequence)}))
    assert record["settings"]["sequence"] == sequence


def test_every_weight_that_can_change_is_recorded() -> None:
    assert list(solver_record(settings())["weighting"]) == list(WeightingEntry.model_fields)


@pytest.fixture
def searched(passed_run: Any) -> Any:
    solver = passed_run.cell.solver.changed(method="recursive_search")
    return replace(passed_run, cell=replace(passed_run.cell, solver=solver))


def test_the_page_says_how_the_motion_was_found(searched: Any) -> None:
    record = phase_record(searched.report, cell=searched.cell, provenance=searched.provenance)
    page = report_page(record, cell=searched.cell, plots={})
    assert "<p>Method: recursive search, joint by joint.</p>" in page
    assert "manipulability at least 2.24 · 10^−7" in page  # 3e-7 + 1e-7 sin 4
