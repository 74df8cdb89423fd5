"""Results reach standard output whole, or the command says that they did not."""

import io
import json
from pathlib import Path

import pytest

from cellplan.cli.terminal.errors import OutputError
from cellplan.cli.terminal.output import json_failure, say, say_json
from cellplan.errors import InputError, NoSolutionError


def test_json_is_one_object(capsys: pytest.CaptureFixture[str]) -> None:
    say_json({"schema": "x/1", "name": "Grüße"})

    assert json.loads(capsys.readouterr().out) == {"schema": "x/1", "name": "Grüße"}


def test_figures_that_are_not_finite_are_no_json() -> None:
    with pytest.raises(ValueError, match="Out of range float"):
        say_json({"value": float("nan")})


def test_a_machine_gets_an_object_also_when_nothing_could_be_done(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(NoSolutionError), json_failure("cellplan.solve/1", desired=True):
        raise NoSolutionError("no posture")

    assert json.loads(capsys.readouterr().out) == {
        "schema": "cellplan.solve/1",
        "status": "error",
        "exit": 3,
        "errors": ["error: no posture"],
    }


def test_people_get_no_json(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError), json_failure("cellplan.solve/1", desired=False):
        raise InputError("x")

    assert capsys.readouterr().out == ""


def test_a_full_disk_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full")
    with full.open("w") as stream:
        monkeypatch.setattr("sys.stdout", stream)
        with pytest.raises(OutputError, match=r"^standard output: the result was not shown: no space left on device$"):
            say("x")


def test_a_closed_stream_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdout", None)

    with pytest.raises(OutputError, match="got a closed one"):
        say("x")


def test_letters_that_a_terminal_lacks_are_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", io.TextIOWrapper(raw, encoding="ascii"))

    say("90°")

    assert raw.getvalue() == b"90\\xb0\n"
