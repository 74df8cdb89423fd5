"""The JSON Schema on the command line."""

import json

import jsonschema
import pytest
import yaml

from cellplan.cli.main import run
from cellplan.files.robots.joint_table import FOLDER, bundled_names


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
    assert "expected at most one of --robot, --report, --series and --layout" in capsys.readouterr().err


def test_a_bundled_table_conforms_to_the_schema_of_robot_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["schema", "--robot"]) == 0

    jsonschema.validate(yaml.safe_load((FOLDER / "kuka_kr6.yaml").read_bytes()), json.loads(capsys.readouterr().out))


def test_editors_are_offered_the_bundled_robots(capsys: pytest.CaptureFixture[str]) -> None:
    run(["schema"])

    model = json.loads(capsys.readouterr().out)["$defs"]["RobotEntry"]["properties"]["model"]
    offered, permitted = model["anyOf"]
    assert tuple(offered["enum"]) == bundled_names()
    assert permitted == {"type": "string"}  # any path may stand there
