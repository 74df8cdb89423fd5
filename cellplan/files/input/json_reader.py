"""JSON that the program wrote itself, read back strictly: no key twice, no NaN, one object."""

import json
from collections.abc import Mapping
from typing import Any, NoReturn

from cellplan.errors import InputError
from cellplan.files.input.files import utf8_text
from cellplan.files.input.findings import shown


def parse_json(data: bytes, file: str) -> dict[str, Any]:
    """The object of a JSON file with finite numbers and each key once; an ``InputError`` has file and line."""
    text = utf8_text(data, file=file)
    try:
        value = json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        raise InputError(f"{file}:{error.lineno}: expected JSON: {error.msg.lower()}") from None
    except RecursionError:
        raise InputError(f"{file}: expected JSON of a few levels, got a deeply nested one") from None
    except ValueError as error:
        raise InputError(f"{file}: {error}") from None
    if not isinstance(value, dict):
        raise InputError(f"{file}: expected a JSON object, got {shown(value)}")
    return value


def required(record: Mapping[str, Any], key: str, kind: type, *, file: str) -> Any:
    """The value of a key that must be there and of one type."""
    if key not in record:
        raise InputError(f"{file}: {key}: missing")
    value = record[key]
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise InputError(f"{file}: {key}: expected {_KINDS[kind]}, got {shown(value)}")
    return value


_KINDS = {dict: "an object", list: "a list", str: "a text", int: "a whole number", bool: "true or false"}


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object of the file."""
    members = dict(pairs)
    if len(members) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"key {shown(twice)} stands twice")
    return members


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"expected finite numbers, got {word}")
