"""What the command line changes of the solver: the method brings its integrator along unless the cell names one."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from cellplan import Cell, load_cell
from cellplan.errors import InputError
from cellplan.io.cell.write import render_cell
from cellplan.model.solver import Integrator
from cellplan.pipeline.overrides import with_overrides

CELL = """\
cellplan: 1
name: pen
robots:
  arm: {model: planar_3r, start_deg: [0, 30, 30]}
part:
  geometry: {box: {size_mm: [300, 300, 10]}}
  at: {xyz_mm: [700, 200, -100]}
tasks:
  circle:
    robot: arm
    path: {circle: {radius_mm: 100, plane: xy}, project: +z}
    tool_axis: normal
    axes: [x, y]
"""
Write = Callable[[str], Cell]


@pytest.fixture
def cell_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Loads a small cell with a solver section in line 14."""
    monkeypatch.chdir(tmp_path)

    def load(solver: str) -> Cell:
        Path("c").write_text(CELL + solver + "\nmotion: {duration_s: 2}\n", encoding="utf-8")
        return load_cell("c")

    return load


def refusal(cell: Cell, **choices: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        with_overrides(cell, **choices)
    return str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("solver", "choices", "integrator"),
    [
        ("", {}, "accurate"),
        ("", {"method": "weighted_pseudo_inverse"}, "accurate"),
        ("", {"method": "damped_least_squares"}, "euler"),
        ("", {"integrator": "euler"}, "euler"),
        ("", {"method": "recursive_search", "integrator": "euler"}, "euler"),
        ("solver: {method: damped_least_squares}", {"method": "weighted_pseudo_inverse"}, "accurate"),
        ("solver: {method: damped_least_squares}", {"method": "quadratic_program"}, "euler"),
        ("solver: {secondary: {posture: {}}}", {"method": "damped_least_squares"}, "euler"),
        (
            "solver: {method: damped_least_squares, secondary: {posture: {}}}",
            {"method": "weighted_pseudo_inverse"},
            "euler",
        ),
        ("solver: {integrator: euler}", {"method": "weighted_pseudo_inverse"}, "euler"),
        ("solver: {integrator: euler}", {"integrator": "accurate"}, "accurate"),
        (
            "solver: {method: damped_least_squares, integrator: euler}",
            {"method": "weighted_pseudo_inverse"},
            "euler",
        ),
        (
            "solver: {method: damped_least_squares, integrator: euler}",
            {"method": "weighted_pseudo_inverse", "integrator": "accurate"},
            "accurate",
        ),
        (
            "solver: {integrator: accurate}",
            {"method": "damped_least_squares", "integrator": "euler"},
            "euler",
        ),
    ],
)
def test_the_integrator_is_the_one_a_cell_file_with_these_words_would_take(
    cell_with: Write, tmp_path: Path, solver: str, choices: dict[str, str], integrator: str
) -> None:
    cell = with_overrides(cell_with(solver), **choices)

    assert cell.solver.integrator is Integrator(integrator)
    assert cell.solver.is_accurate == (integrator == "accurate")
    (tmp_path / "again.yaml").write_text(render_cell(cell), encoding="utf-8")
    assert load_cell(tmp_path / "again.yaml").solver.integrator is cell.solver.integrator


def test_a_method_against_the_integrator_of_the_cell_file_is_refused_with_its_line(cell_with: Write) -> None:
    assert refusal(cell_with("solver: {integrator: accurate}"), method="jacobian_transpose") == [
        "--method: expected weighted_pseudo_inverse, as c:14: solver.integrator asks for the accurate mode, got "
        "'jacobian_transpose'; add --integrator euler"
    ]


@pytest.mark.parametrize(
    ("solver", "choices", "findings"),
    [
        (
            "solver: {method: quadratic_program}",
            {},
            [
                "--integrator: expected euler, as c:14: solver.method is 'quadratic_program', got 'accurate'; "
                "add --method weighted_pseudo_inverse"
            ],
        ),
        (
            "",
            {"method": "quadratic_program"},
            ["--method: expected weighted_pseudo_inverse with --integrator accurate, got 'quadratic_program'"],
        ),
        (
            "solver: {secondary: {posture: {}}, weighting: {load: 1}}",
            {},
            [
                "--integrator: expected euler, as c:14: solver.secondary asks for goals besides the tasks, got "
                "'accurate'; remove them from the cell",
                "--integrator: expected euler, as c:14: solver.weighting.load asks for joint weights that change along "
                "the motion, got 'accurate'; remove them from the cell",
            ],
        ),
    ],
)
def test_the_accurate_mode_is_refused_where_it_does_not_go(
    cell_with: Write, solver: str, choices: dict[str, str], findings: list[str]
) -> None:
    cell = cell_with(solver)

    assert refusal(cell, integrator="accurate", **choices) == findings


def test_an_unknown_integrator_is_refused_with_the_nearest_word(cell_with: Write) -> None:
    assert refusal(cell_with(""), integrator="acurate") == [
        "--integrator: expected one of accurate, euler, got 'acurate'; did you mean 'accurate'?"
    ]


def test_a_choice_made_in_a_program_outlasts_the_same_method(cell_with: Write) -> None:
    cell = cell_with("")
    stepped = replace(cell, solver=replace(cell.solver, integrator=Integrator.EULER))

    again = with_overrides(stepped, method="weighted_pseudo_inverse", duration=3.0)

    assert again.solver.integrator is Integrator.EULER
