"""Options as fields: what typer reads of them, and requests of jobs made from them."""

from dataclasses import dataclass
from inspect import Parameter
from pathlib import Path
from typing import Annotated, get_args

from cellplan.cli.options.request import Options, argument, given, option, parameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample(Options):
    cell: Annotated[Path, argument("CELL", "The cell.")]
    output: Annotated[Path | None, option("-o, --output DIR", "Where to.")] = None
    settings: Annotated[tuple[str, ...], option("--set KEY=VALUE", "May be repeated.")] = ()
    quiet: Annotated[bool, option("--quiet, -q", "A flag.")] = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    cell: Path
    settings: tuple[str, ...] = ()
    rounds: int = 1


def test_every_field_is_a_parameter_in_its_order() -> None:
    made = list(parameters(Sample))

    assert [parameter.name for parameter in made] == ["cell", "output", "settings", "quiet"]
    assert [parameter.default for parameter in made] == [Parameter.empty, None, None, False]
    assert [get_args(parameter.annotation)[0] for parameter in made] == [Path, Path | None, list[str], bool]


def test_an_option_is_spelled_as_its_help_shows_it() -> None:
    _, output, _, quiet = (get_args(parameter.annotation)[1] for parameter in parameters(Sample))

    assert (output.default, output.param_decls, output.metavar) == ("-o", ("--output",), "DIR")
    assert (quiet.default, quiet.param_decls, quiet.metavar) == ("--quiet", ("-q",), None)


def test_what_is_not_given_keeps_its_default_and_lists_become_tuples() -> None:
    values = {"cell": Path("a.yaml"), "output": None, "settings": None, "quiet": True}

    assert given(Sample, values) == Sample(cell=Path("a.yaml"), quiet=True)
    assert given(Sample, {**values, "settings": ["a=1"]}).settings == ("a=1",)


def test_a_request_takes_the_options_of_its_names_and_others() -> None:
    options = Sample(cell=Path("a.yaml"), settings=("a=1",))

    assert options.to(Job, rounds=3) == Job(cell=Path("a.yaml"), settings=("a=1",), rounds=3)
    assert options.to(Job, settings=()).settings == ()
