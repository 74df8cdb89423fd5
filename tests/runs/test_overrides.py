"""What the command line changes of the solver: the method brings its integrator along unless the cell names one."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cellplan import Cell, load_cell
from cellplan.errors import InputError
from cellplan.files.cell.write import render_cell
from cellplan.model.solver import Integrator
from cellplan.runs.overrides import with_overrides

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
            "accurate",
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

    assert cell.solver.is_accurate == (integrator == "accurate")
    (tmp_path / "again.yaml").write_text(render_cell(cell), encoding="utf-8")
    assert load_cell(tmp_path / "again.yaml").solver.integrator == Integrator(integrator)


def test_a_method_against_the_integrator_of_the_cell_file_is_refused(cell_with: Write) -> None:
    assert refusal(cell_with("solver: {integrator: accurate}"), method="jacobian_transpose") == [
        "c with solver.method = jacobian_transpose: solver.method: expected weighted_pseudo_inverse in the accurate "
        "mode, got 'jacobian_transpose', which follows the path only as far as the feedback of its errors takes it; "
        "choose weighted_pseudo_inverse, or choose solver.integrator: euler"
    ]


@pytest.mark.parametrize(
    ("solver", "choices", "findings"),
    [
        (
            "solver: {method: quadratic_program}",
            {},
            [
                "c:14 with solver.integrator = accurate: solver.method: expected weighted_pseudo_inverse in the "
                "accurate mode, got 'quadratic_program', "
                "which gives up part of a task at a limit, and limits accelerations from step to step; "
                "choose weighted_pseudo_inverse, or choose solver.integrator: euler"
            ],
        ),
        (
            "",
            {"method": "quadratic_program"},
            [
                "c with solver.method = quadratic_program: solver.method: expected weighted_pseudo_inverse in the "
                "accurate mode, got 'quadratic_program', "
                "which gives up part of a task at a limit, and limits accelerations from step to step; "
                "choose weighted_pseudo_inverse, or choose solver.integrator: euler"
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
        "c with solver.integrator = acurate: solver.integrator: expected auto, accurate or euler, got 'acurate', did "
        "you mean 'accurate'?"
    ]


def test_settings_are_read_as_strictly_as_the_cell_file(cell_with: Write) -> None:
    cell = with_overrides(cell_with(""), ["motion.duration_s = 3", "tasks.circle.axes=[x, y, rz]"], mode="part_at_rest")

    assert (cell.motion.duration, str(cell.motion.mode), cell.tasks[0].axes) == (3.0, "part_at_rest", (0, 1, 5))


@pytest.mark.parametrize(
    ("setting", "finding"),
    [
        ("motion.duration_s", "--set: expected KEY=VALUE, such as motion.duration_s=2.5, got 'motion.duration_s'"),
        ("=3", "--set: expected KEY=VALUE, such as motion.duration_s=2.5, got '=3'"),
        (
            "motion.duration_s=010",
            "--set motion.duration_s: expected a number without leading zeros, got 010; it can be read as octal",
        ),
        (
            "motion.duration_s=",
            "--set motion.duration_s: expected a value, got nothing; leave the key out to use its default",
        ),
        ("solver.seed=1\nname: x", "--set solver.seed: expected a value on one line, got several"),
        ("motion.mode=pairwise", "--set: expected every key once, got 'motion.mode' again"),
    ],
)
def test_settings_that_cannot_be_read_are_refused(cell_with: Write, setting: str, finding: str) -> None:
    with pytest.raises(InputError) as caught:
        with_overrides(cell_with(""), [setting], mode="pairwise")

    assert str(caught.value) == finding


def test_a_setting_that_is_not_yaml_is_refused(cell_with: Write) -> None:
    with pytest.raises(InputError, match=r"^--set solver.seed: not valid YAML: "):
        with_overrides(cell_with(""), ["solver.seed=[1"])
