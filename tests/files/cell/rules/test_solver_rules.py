"""The integrator of a cell: accurate wherever it goes, refused by line where it does not."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan.files.cell.load import load_cell
from cellplan.files.cell.write import render_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.solver import Integrator

Load = Callable[..., Cell]
Refuse = Callable[..., list[str]]
OR_EULER = "or choose solver.integrator: euler"


def with_solver(settings: str) -> tuple[str, str]:
    """The change that gives the small cell a solver, in line 22."""
    return "environment:", f"solver: {{{settings}}}\nenvironment:"


@pytest.mark.parametrize(
    "settings",
    [
        "seed: 0",
        "integrator: auto",
        "gain_per_s: 650",
        "gain_per_s: 10, damping: 0.3",
        "damping: 0",
        "secondary: {}",
        "weighting: {near_limits: 0, load: 0}",
        "weighting: {near_limits: 0.1}",
        "weighting: {load: 1}",
        "secondary: {posture: {}}",
        "quadratic_program: {ramp_s: 1}",
    ],
)
def test_nothing_said_means_accurate_where_the_rest_allows_it(load: Load, settings: str) -> None:
    assert load().solver.integrator == "auto"

    solver = load(with_solver(settings)).solver

    assert (solver.integrator, solver.is_accurate) == ("auto", True)


@pytest.mark.parametrize(
    "settings",
    [
        "method: damped_least_squares",
        "method: recursive_search",
        "method: damped_least_squares, secondary: {posture: {}}",
    ],
)
def test_nothing_said_means_euler_where_the_accurate_mode_does_not_go(load: Load, settings: str) -> None:
    solver = load(with_solver(settings)).solver

    assert (solver.integrator, solver.is_accurate) == ("auto", False)


def test_euler_may_be_asked_for_with_everything(load: Load) -> None:
    assert load(with_solver("integrator: euler")).solver.integrator == "euler"
    assert load(with_solver("integrator: euler, method: quadratic_program")).solver.integrator == "euler"


@pytest.mark.parametrize(
    ("settings", "accuracy"),
    [("seed: 0", 1e-7), ("accuracy_mm: 1", 1e-3), ("accuracy_mm: 2e-5, integrator: euler", 2e-8)],
)
def test_the_accuracy_is_read_in_millimetres(load: Load, settings: str, accuracy: float) -> None:
    solver = load(with_solver(settings)).solver
    assert solver.accuracy_mm.si == pytest.approx(accuracy, rel=1e-15)  # a unit in the last place


@pytest.mark.parametrize(
    ("settings", "findings"),
    [
        (
            "method: jacobian_transpose",
            [
                "c:22: solver.method: expected weighted_pseudo_inverse in the accurate mode, got 'jacobian_transpose', "
                "which follows the path only as far as the feedback of its errors takes it; "
                f"choose weighted_pseudo_inverse, {OR_EULER}"
            ],
        ),
        (
            "method: quadratic_program, weighting: {near_limits: 0.5, load: 1}",
            [
                "c:22: solver.method: expected weighted_pseudo_inverse in the accurate mode, got 'quadratic_program', "
                "which gives up part of a task at a limit, and limits accelerations from step to step; "
                f"choose weighted_pseudo_inverse, {OR_EULER}",
            ],
        ),
    ],
)
def test_what_is_in_the_way_of_the_accurate_mode_is_reported_line_by_line(
    refuse: Refuse, settings: str, findings: list[str]
) -> None:
    assert refuse(with_solver(f"integrator: accurate, {settings}")) == findings


@pytest.mark.parametrize(
    ("settings", "finding"),
    [
        ("integrator: rk4", "c:22: solver.integrator: expected auto, accurate or euler, got 'rk4'"),
        (
            "integrator: eulr",
            "c:22: solver.integrator: expected auto, accurate or euler, got 'eulr', did you mean 'euler'?",
        ),
        ("accuracy_mm: 0", "c:22: solver.accuracy_mm: expected a positive number of millimetres, got 0"),
        (
            "accuracy_mm: 1e-10",
            "c:22: solver.accuracy_mm: expected a number of millimetres of at least 1e-09, got 1e-10",
        ),
        ("accuracy_mm: 1.5", "c:22: solver.accuracy_mm: expected a number of millimetres of at most 1, got 1.5"),
    ],
)
def test_other_integrators_and_accuracies_are_refused(refuse: Refuse, settings: str, finding: str) -> None:
    assert refuse(with_solver(settings)) == [finding]


@pytest.mark.parametrize("settings", ["seed: 0", "method: damped_least_squares", "integrator: euler, accuracy_mm: 0.3"])
def test_the_integrator_that_was_taken_is_written_out(load: Load, tmp_path: Path, settings: str) -> None:
    cell = load(with_solver(settings))
    text = render_cell(cell)
    (tmp_path / "again.yaml").write_text(text, encoding="utf-8")

    again = load_cell(tmp_path / "again.yaml")

    assert f"integrator: {'accurate' if cell.solver.is_accurate else 'euler'}" in text
    assert (again.solver.is_accurate, again.solver.accuracy_mm) == (cell.solver.is_accurate, cell.solver.accuracy_mm)
    assert "solver.integrator" in again.origin.lines
    assert render_cell(again) == text


def test_every_cell_of_the_papers_takes_steps_as_published(cells: Path) -> None:
    named = {path.stem: load_cell(path) for path in (cells / "papers").glob("*.yaml")}

    silent = [name for name, cell in named.items() if "solver.integrator" not in cell.origin.lines]
    assert silent == []
    assert {cell.solver.integrator for cell in named.values()} == {Integrator.EULER}
