"""A command from its options to its exit status: shown to people, given to machines, also when it fails."""

import json
from dataclasses import dataclass

import pytest
import typer

from cellplan.cli.command import as_command
from cellplan.cli.options.request import Options
from cellplan.cli.options.shared import AsJson, Watch
from cellplan.cli.terminal.output import Result
from cellplan.errors import ExitStatus, InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample(Options):
    SCHEMA = "cellplan.sample/1"

    watch: Watch = False
    as_json: AsJson = False


def failing(options: Sample) -> Result:
    """Is as it says."""
    return Result(ExitStatus.CHECK_FAILED, ["sample: failed"], {"schema": options.schema})


def refusing(options: Sample) -> Result:
    """Refuses its options."""
    raise InputError("no")


@pytest.mark.parametrize(
    ("as_json", "text"), [(False, "sample: failed\n"), (True, '{\n  "schema": "cellplan.sample/1"\n}\n')]
)
def test_a_result_is_shown_and_gives_the_exit_status(
    as_json: bool, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(typer.Exit) as end:
        as_command(failing)(verbose=False, watch=False, as_json=as_json)

    assert (end.value.exit_code, capsys.readouterr().out) == (1, text)


def test_a_failure_is_one_json_object_too(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError):
        as_command(refusing)(verbose=False, watch=False, as_json=True)

    assert json.loads(capsys.readouterr().out)["schema"] == "cellplan.sample/1"


def test_watching_tells_of_failures_itself(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError):
        as_command(refusing)(verbose=False, watch=True, as_json=True)

    assert capsys.readouterr().out == ""
