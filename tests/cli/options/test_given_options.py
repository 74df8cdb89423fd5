"""No option is dropped in silence: not the first of two, and not one that has no meaning beside another."""

import inspect
from typing import Any, get_args

import pytest
from typer.main import get_command

from cellplan.cli.command import as_command
from cellplan.cli.main import COMMANDS, app, run
from cellplan.cli.options.completion import SHELLS
from cellplan.cli.options.given_options import NOT_WITH, ONLY_WITH

PROGRAM: Any = get_command(app)
NAMES = [name for group in COMMANDS.values() for name in group]
ONCE = [
    (name, max(option.opts, key=len))
    for name in NAMES
    for option in PROGRAM.commands[name].params
    if option.param_type_name == "option" and not option.multiple and not option.is_flag
]


def refusal(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line with which a command line is refused."""
    assert run(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    return err


@pytest.mark.parametrize(("command", "option"), ONCE)
def test_what_may_be_given_once_refuses_a_second_one(
    command: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refusal([command, "a", option, "1", option, "2"], capsys)

    assert line == f"error: {option}: expected once, got it 2 times; leave all but one of them out\n"


def test_a_short_name_and_an_equals_sign_count_too(capsys: pytest.CaptureFixture[str]) -> None:
    line = refusal(["solve", "a.yaml", "-o", "a", "--output=b", "--output", "c"], capsys)

    assert line == "error: --output: expected once, got it 3 times; leave all but one of them out\n"


def test_options_of_the_program_itself_count_too(capsys: pytest.CaptureFixture[str]) -> None:
    option = "--show-completion"

    line = refusal([option, SHELLS[0], option, SHELLS[1]], capsys)

    assert line == f"error: {option}: expected once, got it 2 times; leave all but one of them out\n"


def test_flags_and_options_that_may_be_repeated_are_all_taken(capsys: pytest.CaptureFixture[str]) -> None:
    line = refusal(["check", "no.yaml", "-q", "-q", "--set", "a=1", "--set", "b=2", "--allow-dir", "."], capsys)

    assert line == "error: no.yaml: no such file\n"


def test_help_is_shown_whatever_else_is_given(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["solve", "--task", "a", "--task", "b", "--help"]) == 0
    assert "Usage: cellplan solve" in capsys.readouterr().out


def with_value(command: str, option: str) -> list[str]:
    """An option of a command with a value where it takes one."""
    (one,) = [param for param in PROGRAM.commands[command].params if option in param.opts]
    return [option] if one.is_flag else [option, "1"]


@pytest.mark.parametrize(
    ("command", "needed", "option"), [(*pair, option) for pair, options in ONLY_WITH.items() for option in options]
)
def test_an_option_that_says_nothing_without_another_is_refused(
    command: str, needed: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refusal([command, "a", *with_value(command, option)], capsys)

    assert line == f"error: {option}: expected only with {needed}, without which it says nothing; leave it out\n"


@pytest.mark.parametrize(
    ("command", "first", "option"), [(*pair, option) for pair, options in NOT_WITH.items() for option in options]
)
def test_an_option_that_another_takes_no_notice_of_is_refused(
    command: str, first: str, option: str, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refusal([command, "a", *with_value(command, first), *with_value(command, option)], capsys)

    assert line == f"error: {option}: expected not together with {first}, which takes no notice of it; leave it out\n"


def test_arguments_of_xacro_files_are_given_once_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["robots", "arm.xacro", "--xacro-arg", "a=1", "--xacro-arg", "a=2"]) == 2
    assert "--xacro-arg: expected every name once, got 'a' again" in capsys.readouterr().err


def test_every_option_of_every_command_is_among_these() -> None:
    """Options that are read as lists are those that may be repeated, and no others."""
    for name in NAMES:
        command = next(group[name] for group in COMMANDS.values() if name in group)
        for parameter in inspect.signature(as_command(command)).parameters.values():
            options = [param for param in PROGRAM.commands[name].params if param.name == parameter.name]
            assert len(options) == 1
            is_list = "list" in str(get_args(parameter.annotation)[0])
            assert options[0].param_type_name == "argument" or options[0].multiple == is_list
