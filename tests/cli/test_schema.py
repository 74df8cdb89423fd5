"""The JSON Schema on the command line."""

import json

import pytest

from cellplan.cli.main import run


def test_the_schema_is_one_json_object_with_the_keys_of_a_cell(capsys: pytest.CaptureFixture[str]) -> None:
    status = run(["schema"])

    schema = json.loads(capsys.readouterr().out)
    assert status == 0
    assert schema["$schema"].startswith("https://json-schema.org/")
    assert {"cellplan", "name", "robots", "part", "tasks", "environment", "motion"} <= set(schema["properties"])


def test_one_schema_is_printed_at_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["schema", "--layout"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "cellplan.layout/1"

    assert run(["schema", "--series"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "cellplan.series/1"

    assert run(["schema", "--layout", "--report"]) == 2
    assert "expected one of --report, --series and --layout, got 2" in capsys.readouterr().err
