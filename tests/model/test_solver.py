"""Traits of the resolution methods agree with the methods themselves."""

from pathlib import Path
from typing import get_args

import pytest

import cellplan.planning.methods
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.solver import ACCURATE_METHODS, METHODS, NULL_SPACE_METHODS, MethodName

FOLDER = Path(cellplan.planning.methods.__file__).parent


def test_every_method_has_traits_and_a_file_and_no_other_has() -> None:
    assert tuple(METHODS) == get_args(MethodName)
    assert {path.stem for path in FOLDER.glob("[a-z]*.py")} == set(METHODS)


def test_labels_differ() -> None:
    assert len({traits.label for traits in METHODS.values()}) == len(METHODS)


def test_methods_without_a_null_space_are_those_without_a_pseudo_inverse() -> None:
    without = set(METHODS) - set(NULL_SPACE_METHODS)

    assert without == {"jacobian_transpose", "heuristic_search", "recursive_search"}
    assert ACCURATE_METHODS == ("weighted_pseudo_inverse",)


@pytest.mark.parametrize("name", get_args(MethodName))
def test_a_method_that_feeds_errors_back_uses_the_gain_and_a_search_does_not(name: MethodName) -> None:
    text = (FOLDER / f"{name}.py").read_text(encoding="utf-8")

    assert SolverEntry(integrator="euler", method=name, gain_per_s=1.0).traits is METHODS[name]
    assert ("configuration_search" in text or "search_cost" in text) != METHODS[name].feeds_back
