"""The file format: its JSON Schema, and any spoiled cell refused with a line and nothing but our own errors."""

import copy
import math
import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from cellplan.errors import InvalidFileError
from cellplan.files.cell.load import load_cell
from cellplan.files.input.findings import key_text
from cellplan.files.schema import CellDocument, RobotTableDocument
from cellplan.files.schema.json_schemas import json_schema, robot_table_schema
from cellplan.files.yaml.reader import parse_yaml
from cellplan.files.yaml.writer import yaml_text

ROOT = Path(__file__).resolve().parents[3]
Place = tuple[str | int, ...]


def plain(value: Any) -> Any:
    """Lists for tuples, so that values can be changed in place."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, tuple) else value


FOUR_ROBOTS = plain(parse_yaml((ROOT / "cells" / "four_robots.yaml").read_bytes(), file="cell").root)


def four_robots() -> dict[str, Any]:
    """A copy to be spoiled."""
    return copy.deepcopy(FOUR_ROBOTS)


def places(value: Any, path: Place = ()) -> list[Place]:
    paths = [path] if path else []
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        paths += places(item, (*path, key))
    return paths


PLACES = places(FOUR_ROBOTS)


def owner(document: Any, place: Place) -> Any:
    for key in place[:-1]:
        document = document[key]
    return document


def reported(text: str) -> list[str]:
    """Findings about a cell; none when it is accepted. Anything but our own error fails the test."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cell.yaml"
        path.write_text(text, encoding="utf-8")
        try:
            load_cell(path)
        except InvalidFileError as error:
            return [str(finding).removeprefix(str(path)) for finding in error.findings]
    return []


def lines_of(findings: list[str]) -> list[int]:
    return [int(line.split(":")[1]) for line in findings]


@given(place=st.sampled_from(PLACES))
def test_a_dropped_key_is_a_default_or_a_located_finding(place: Place) -> None:
    document = four_robots()
    del owner(document, place)[place[-1]]

    text = yaml_text(document)

    assert all(1 <= line <= len(text.splitlines()) for line in lines_of(reported(text)))


@given(place=st.sampled_from([place for place in PLACES if isinstance(place[-1], str)]))
def test_a_renamed_key_is_named_with_its_own_line(place: Place) -> None:
    document = four_robots()
    parent = owner(document, place)
    renamed = {(f"{key}q" if key == place[-1] else key): value for key, value in parent.items()}
    parent.clear()
    parent.update(renamed)
    new_place = (*place[:-1], f"{place[-1]}q")

    text = yaml_text(document)
    findings = reported(text)

    names = {("robots",), ("tasks",), ("environment",)}
    if place[:-1] not in names:  # names are free; elsewhere the key is unknown
        line = parse_yaml(text.encode(), file="cell").keys[new_place].line
        assert any(finding.startswith(f":{line}: {key_text(new_place)}: unknown key") for finding in findings)


WRONG = [True, "wrong word", [], {}, [1, 2], {"a": 1}, -1, 1e300, 5e-324, "", -7.5, ["x"], 10**25]


@given(place=st.sampled_from(PLACES), wrong=st.sampled_from(WRONG))
def test_a_value_of_another_kind_is_fine_or_named_with_its_line(place: Place, wrong: Any) -> None:
    document = four_robots()
    owner(document, place)[place[-1]] = wrong

    text = yaml_text(document)
    findings = reported(text)

    assert all(1 <= line <= len(text.splitlines()) for line in lines_of(findings))
    assert all("Input should" not in finding and "<" not in finding for finding in findings)
    kind_differs = isinstance(wrong, bool | list | dict) and wrong not in ([], {})
    if kind_differs and not isinstance(owner(FOUR_ROBOTS, place)[place[-1]], type(wrong)):
        line = parse_yaml(text.encode(), file="cell").line(place)
        assert any(finding.startswith(f":{line}: {key_text(place)}") for finding in findings)


@given(
    place=st.sampled_from([place for place in PLACES if isinstance(owner(FOUR_ROBOTS, place)[place[-1]], int | float)]),
    word=st.sampled_from([".nan", ".inf", "-.inf", "1e400", "010", "1:30", "0x10", "1_0", "no", "2020-01-01", "~"]),
)
def test_words_that_are_no_number_are_refused_where_they_stand(place: Place, word: str) -> None:
    document = four_robots()
    owner(document, place)[place[-1]] = 987654321
    text = yaml_text(document)
    line = parse_yaml(text.encode(), file="cell").line(place)

    findings = reported(text.replace("987654321", word))

    named = [finding for finding in findings if f": {key_text(place)}: " in finding]
    assert named
    assert named[0].startswith(f":{line}: ")


def walk(node: Any) -> list[Any]:
    children = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return [node, *(path for child in children for path in walk(child))]


def test_the_json_schema_is_closed_and_holds_no_null() -> None:
    nodes = walk(json_schema())

    objects = [
        node for node in nodes if isinstance(node, dict) and node.get("type") == "object" and "properties" in node
    ]
    assert objects
    assert all(node["additionalProperties"] is False for node in objects)
    assert None not in nodes
    assert {"type": "null"} not in nodes
    assert all({"description", "$ref"} & set(field) for node in objects for field in node["properties"].values())


@pytest.mark.parametrize("schema", [json_schema(), robot_table_schema()], ids=["cell", "robot table"])
def test_editors_can_explain_every_key_and_name_it_as_the_file_does(schema: dict[str, Any]) -> None:
    for entry in (schema, *schema["$defs"].values()):
        for key, field in entry.get("properties", {}).items():
            kind = schema["$defs"].get(field.get("$ref", "").rpartition("/")[2], {})
            assert len(field.get("description") or kind["description"]) > 3, key
            assert kind.get("title") or field["title"] == key
        assert "Entry" not in entry["title"]


def test_the_json_schema_refuses_names_that_no_cell_may_have() -> None:
    rules = Draft202012Validator(json_schema())
    document = four_robots()
    rules.validate(document)

    document["environment"]["a fence"] = document["environment"].pop("floor")
    (finding,) = rules.iter_errors(document)
    assert "'a fence'" in finding.message


@pytest.mark.parametrize("model", [CellDocument, RobotTableDocument])
def test_every_key_with_a_unitless_name_is_not_a_length_or_an_angle(model: Any) -> None:
    lengths = {"xyz", "rpy", "radius", "length", "size", "duration", "step", "feed", "clearance", "start_deg_s"}

    entries = [node for node in walk(model.model_json_schema()) if isinstance(node, dict) and "properties" in node]
    numbers = {
        name
        for entry in entries
        for name, value in entry["properties"].items()
        if any(isinstance(node, dict) and node.get("type") == "number" for node in walk(value))
    }

    assert {"xyz_mm", "rpy_deg", "clearance_mm", "length_mm"} & numbers
    assert not numbers & lengths


def test_defaults_of_the_schema_are_finite() -> None:
    assert all(math.isfinite(node) for node in walk(json_schema()) if isinstance(node, float))
