"""JSON Schema (draft 2020-12) of records, generated from their types."""

import types
from collections.abc import Mapping
from typing import Annotated, Any, Final, Union, get_args, get_origin, get_type_hints, is_typeddict

from cellplan.report.record.phases import AT, phase_key
from cellplan.report.record.run import RunRecord
from cellplan.report.record.series import SeriesRecord
from cellplan.report.record.summary import SummaryRecord

PHASE_OF_INSTANT: Final = Annotated[str | None, "its phase; only in the record of a program"]
DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
TYPES: Final[Mapping[object, str]] = {
    str: "string",
    bool: "boolean",
    int: "integer",
    float: "number",
    type(None): "null",
}


def report_schema(*, closed: bool = False) -> dict[str, Any]:
    """The JSON Schema of ``report.json``; the published one is not closed: it permits keys of later releases."""
    definitions: dict[str, dict[str, Any]] = {}
    forms = [_schema(form, definitions, closed=closed) for form in (RunRecord, SummaryRecord)]
    for definition in definitions.values():
        definition["properties"] = _with_phases(definition["properties"])
    return {
        "$schema": DIALECT,
        "title": "cellplan.report/1",
        "description": "report.json of a run, or of several runs (with the key `runs`)",
        "oneOf": forms,
        "$defs": definitions,
    }


def _with_phases(properties: dict[str, Any]) -> dict[str, Any]:
    """The keys of a record, each of an instant followed by that of its phase; see ``in_phase``."""
    named: dict[str, Any] = {}
    for key, schema in properties.items():
        named[key] = schema
        if key.endswith(AT) and schema.get("type") != "array":
            named.setdefault(phase_key(key), properties.get(phase_key(key), _schema(PHASE_OF_INSTANT, {}, closed=True)))
    return named


def series_schema(*, closed: bool = False) -> dict[str, Any]:
    """The JSON Schema of ``series.json``, closed as that of ``report.json``."""
    return record_schema(SeriesRecord, "cellplan.series/1", "series.json of a run", closed=closed)


def record_schema(form: Any, title: str, description: str, *, closed: bool = False) -> dict[str, Any]:
    """The JSON Schema of a file with one record of a typed form; ``title`` is the name and version of its format."""
    definitions: dict[str, dict[str, Any]] = {}
    top = _schema(form, definitions, closed=closed)
    return {"$schema": DIALECT, "title": title, "description": description, **top, "$defs": definitions}


def _schema(form: Any, definitions: dict[str, dict[str, Any]], *, closed: bool) -> dict[str, Any]:
    """The schema of one type; records are added to the definitions."""
    if is_typeddict(form):
        name = form.__name__.strip("_")
        if name not in definitions:
            definitions[name] = {}  # reserves its place before the records within it
            definitions[name].update(_record_schema(form, definitions, closed=closed))
        return {"$ref": f"#/$defs/{name}"}
    origin, arguments = get_origin(form), get_args(form)
    if origin is Annotated:
        return {**_schema(arguments[0], definitions, closed=closed), "description": arguments[1]}
    if origin in {Union, types.UnionType}:
        return {"anyOf": [_schema(argument, definitions, closed=closed) for argument in arguments]}
    if origin is list:
        return {"type": "array", "items": _schema(arguments[0], definitions, closed=closed)}
    if origin is dict:
        return {"type": "object", "additionalProperties": _schema(arguments[1], definitions, closed=closed)}
    return {} if form is Any else {"type": TYPES[form]}


def _record_schema(form: Any, definitions: dict[str, dict[str, Any]], *, closed: bool) -> dict[str, Any]:
    hints = get_type_hints(form, include_extras=True)
    schema = {
        "type": "object",
        "description": form.__doc__ or "",
        "properties": {key: _schema(hint, definitions, closed=closed) for key, hint in hints.items()},
        "required": sorted(form.__required_keys__),
    }
    return {**schema, "additionalProperties": False} if closed else schema
