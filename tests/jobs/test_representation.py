"""Results print as one line without arrays; ``help(cellplan)`` lists the functions."""

import dataclasses
import inspect
import math
import pydoc
import re
from pathlib import Path

import pytest

import cellplan
from cellplan import Solution, load_cell, solve
from cellplan.planning.path.build import build_toolpath


@pytest.fixture(scope="module")
def solution(sound: Path) -> Solution:
    return solve(load_cell(sound / "cell" / "small.yaml"))


def test_results_are_one_line(solution: Solution) -> None:
    report, cell = solution.runs[0].report, solution.cell
    toolpath = build_toolpath(cell.tasks[0], cell.part)

    clearance = min(value.minimum for value in report.clearance.minima.values() if value.minimum is not None)
    pair = next(" - ".join(value.pair) for value in report.clearance.minima.values() if value.minimum == clearance)
    expected = (
        f"passed: {len(report.checks)} checks; smallest clearance {math.floor(1e4 * clearance) / 10:.4g} mm, {pair}"
    )
    assert repr(solution) == f"<Solution of 'small-pair', simultaneous, 1 s, {expected}>"
    assert repr(report) == f"<Report of 'small-pair', simultaneous, 1 s, {expected}>"
    assert repr(solution.runs[0]) == f"<Run of 'small-pair', all tasks, 1 s, {expected}>"
    assert repr(solution.motion) == "<Motion of 9 joints, 41 samples, 1 s>"
    assert repr(cell) == "<Cell 'small-pair': robots left, right, idle; tasks path; simultaneous>"
    assert repr(cell.robots[0]) == "<Robot 'left': left, 3 joints>"
    assert repr(cell.part) == "<Part: Box, held by left>"
    assert repr(cell.tasks[0]) == "<Task 'path' of robot 'right': SampledPath, part>"
    assert repr(toolpath) == "<Toolpath of 'path', 70.55 mm, open>"


def test_a_check_shows_its_verdict_and_message(solution: Solution) -> None:
    check = solution.runs[0].report.checks[0]

    assert repr(check) == f"<Check {check.name} of '{check.subject}' passed: {check.message}>"
    assert "\n" not in repr(check)


def test_help_describes_every_parameter_and_every_attribute() -> None:
    silent = []
    for name in cellplan.__all__:
        value = getattr(cellplan, name)
        text = inspect.getdoc(value) or ""
        named: list[str] = []
        if dataclasses.is_dataclass(value):
            named = [field.name for field in dataclasses.fields(value)]
        elif inspect.isfunction(value):
            named = [*inspect.signature(value).parameters]
        silent += [f"{name}: {entry}" for entry in named if not re.search(rf"^ +{entry}: ", text, re.MULTILINE)]

    assert silent == []


def test_help_lists_the_public_names_by_group() -> None:
    assert cellplan.__doc__ is not None
    listed = {name for name in cellplan.__all__ if f"``{name}``" in cellplan.__doc__}

    assert listed == set(cellplan.__all__) - {"__version__"}
    text = pydoc.plain(pydoc.render_doc(cellplan))
    functions = text[text.index("\nFUNCTIONS") :]
    for name in ("export_program", "load_cell", "open_gate", "rehearse", "screen", "solve", "verify", "write_run"):
        assert f"    {name}(" in functions
