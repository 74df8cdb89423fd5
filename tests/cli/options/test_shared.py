"""Options that several commands share: their help names every choice that the model knows."""

from typing import Any, get_args, get_type_hints

import pytest
import typer

from cellplan.cli.options import shared
from cellplan.cli.solve.solve import SolveOptions
from cellplan.model.cell.cell import Mode
from cellplan.model.settings.solver import SolverEntry
from cellplan.model.solver import Integrator, MethodName


def help_of(option: Any) -> str:
    (result,) = (entry for entry in get_args(option) if isinstance(entry, typer.models.OptionInfo))
    assert result.help is not None
    return result.help


def listed(words: tuple[str, ...]) -> str:
    return f": {', '.join(words[:-1])} or {words[-1]}."


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (shared.Mode, tuple(Mode)),
        (shared.Method, get_args(MethodName)),
        (get_type_hints(SolveOptions, include_extras=True)["integrator"], ("auto", *Integrator)),
    ],
)
def test_the_help_names_every_choice_in_its_order(option: Any, words: tuple[str, ...]) -> None:
    assert help_of(option).endswith(listed(words))


def test_the_schema_names_the_same_integrators() -> None:
    assert get_args(SolverEntry.model_fields["integrator"].annotation) == ("auto", *Integrator)
