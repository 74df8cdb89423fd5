"""The formats of the cell file, the robot table and the errors file as JSON Schemas, for editors and the reference."""

from typing import Any

from cellplan.io.schema.cell import CellDocument
from cellplan.io.schema.cell_errors import ErrorsDocument
from cellplan.io.schema.robot_table import RobotTableDocument


def json_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of the cell file."""
    return _finished(CellDocument.model_json_schema(), "cellplan cell file, version 1")


def robot_table_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a joint-axis table."""
    return _finished(RobotTableDocument.model_json_schema(), "cellplan robot table")


def errors_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of an errors file."""
    return _finished(ErrorsDocument.model_json_schema(), "cellplan errors file, version 1")


def _finished(schema: dict[str, Any], title: str) -> dict[str, Any]:
    """The schema with its dialect and title in front."""
    rest = {key: value for key, value in schema.items() if key != "title"}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": title, **_without_null(rest)}


def _without_null(node: Any) -> Any:
    """The schema without the "or null" that stands for an absent key: a file never holds null."""
    if isinstance(node, list):
        return [_without_null(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {key: _without_null(value) for key, value in node.items() if value is not None}
    arms = kept.get("anyOf")
    if isinstance(arms, list) and {"type": "null"} in arms:
        rest = [arm for arm in arms if arm != {"type": "null"}]
        others = {key: value for key, value in kept.items() if key != "anyOf"}
        return {**rest[0], **others} if len(rest) == 1 else {**others, "anyOf": rest}
    return kept
