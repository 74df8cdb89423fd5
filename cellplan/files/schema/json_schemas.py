"""The formats of the cell file, the robot table and the errors file as JSON Schemas, for editors and the reference."""

import re
from collections.abc import Iterable
from typing import Any

from cellplan.files.schema.cell import CellDocument
from cellplan.files.schema.robot_table import RobotTableDocument
from cellplan.model.settings.cell_errors import ErrorsDocument


def json_schema(models: Iterable[str] = ()) -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the cell file.

    ``models`` are the names that editors offer as the model of a robot.
    """
    schema = _finished(CellDocument.model_json_schema(), "cellplan cell file, version 1")
    if names := list(models):
        model = schema["$defs"]["RobotEntry"]["properties"]["model"]
        model["anyOf"] = [{"enum": names}, {"type": model.pop("type")}]
    return schema


def robot_table_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a joint-axis table."""
    return _finished(RobotTableDocument.model_json_schema(), "cellplan robot table")


def errors_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of an errors file."""
    return _finished(ErrorsDocument.model_json_schema(), "cellplan errors file, version 1")


def entry_title(name: str) -> str:
    """Kind of entry in words: ``PartShapeEntry`` becomes ``Part shape``."""
    return re.sub(r"(?<!^)([A-Z])", lambda match: " " + match[1].lower(), name.removesuffix("Entry"))


def _finished(schema: dict[str, Any], title: str) -> dict[str, Any]:
    """The schema with its dialect and title in front."""
    _shorten(schema)
    rest = {key: value for key, value in schema.items() if key != "title"}
    finished = _without_null(rest)
    for entry in (finished, *finished["$defs"].values()):
        _entitle(entry.get("properties", {}))
    for name, entry in finished["$defs"].items():
        entry["title"] = entry_title(name)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **finished}


def _shorten(schema: dict[str, Any]) -> None:
    """Leave out of docstrings the keys, which have descriptions of their own, and what a reference says as well."""
    definitions = {f"#/$defs/{name}": entry for name, entry in schema["$defs"].items()}
    for entry in (schema, *definitions.values()):
        entry["description"] = entry["description"].partition("\n\n")[0]
    for field in (field for entry in (schema, *definitions.values()) for field in entry.get("properties", {}).values()):
        if "$ref" in field and field.get("description") == definitions[field["$ref"]]["description"]:
            del field["description"]


def _entitle(fields: dict[str, Any]) -> None:
    """Title of each key as the file writes it, which editors show; free names match their pattern or are refused."""
    for key, field in fields.items():
        if "$ref" not in field:
            field["title"] = key
        if "patternProperties" in field:
            field["additionalProperties"] = False


def _without_null(node: Any) -> Any:
    """The schema without the "or null" that stands for an absent key: a file never holds null."""
    if isinstance(node, list):
        return [_without_null(item) for item in node]
    if not isinstance(node, dict):
        return node
    members = {key: _without_null(value) for key, value in node.items() if value is not None}
    arms = members.get("anyOf")
    if isinstance(arms, list) and {"type": "null"} in arms:
        rest = [arm for arm in arms if arm != {"type": "null"}]
        others = {key: value for key, value in members.items() if key != "anyOf"}
        return {**rest[0], **others} if len(rest) == 1 else {**others, "anyOf": rest}
    return members
