"""The help of the program: its groups, its examples and its first steps."""

import re
import shlex

import pytest

from cellplan.cli.main import COMMANDS, EXAMPLES, FIRST_STEPS, run

STEPS = re.findall(r"^  (cellplan .*?)  ", FIRST_STEPS, re.MULTILINE)
LINES = [*STEPS, *(line for lines in EXAMPLES.values() for line in lines)]


@pytest.mark.parametrize("line", LINES)
def test_every_example_is_understood(line: str, capsys: pytest.CaptureFixture[str]) -> None:
    status = run([*shlex.split(line)[1:], "--help"])  # options are read, values are not

    assert (status, "Usage: cellplan" in capsys.readouterr().out) == (0, True)


@pytest.mark.parametrize("line", LINES)
def test_examples_fit_a_usual_terminal(line: str) -> None:
    assert len(f"    {line}") <= 80


def test_first_steps_are_shown_without_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 2
    assert capsys.readouterr().out == f"{FIRST_STEPS}\n"


@pytest.mark.parametrize("columns", [60, 100, 200])
def test_help_fits_the_terminal(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))

    assert run(["--help"]) == 0

    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= min(columns, 110)
    assert max(map(len, lines)) > min(columns, 110) - 15
    assert [line[:-1] for line in lines if re.fullmatch(r"\w[\w ]*:", line)][1:] == list(COMMANDS)
