"""Changes of a cell file: values set at addresses of its document, as if they stood in the file."""

import re
from collections.abc import Mapping
from dataclasses import replace
from enum import Enum
from pathlib import PurePath
from typing import Any, Final, get_args, get_origin

import numpy as np

from cellplan.errors import InputError
from cellplan.files.input.findings import KeyPath, did_you_mean, listed, raise_findings, shown
from cellplan.files.schema import CellDocument
from cellplan.files.schema.messages import annotation_at, fields_of
from cellplan.files.yaml.reader import YamlDocument, parse_yaml
from cellplan.files.yaml.writer import flow_text
from cellplan.model.settings.entry import PoseEntry

COMPONENTS: Final[Mapping[str, tuple[str, str]]] = {
    "x_mm": ("xyz_mm", "0"),
    "y_mm": ("xyz_mm", "1"),
    "z_mm": ("xyz_mm", "2"),
    "roll_deg": ("rpy_deg", "0"),
    "pitch_deg": ("rpy_deg", "1"),
    "yaw_deg": ("rpy_deg", "2"),
}  # of a pose, as a layout names them
INDEX: Final = re.compile(r"\[([0-9]+)\]")
NOTHING: Final = "null"  # as the value of an option: the key is left out
SHOWN_LENGTH: Final = 60  # characters of a value that are repeated in a message
LEFT_OUT: Final = object()  # in place of a value: the key is removed
AN_ADDRESS: Final = "expected an address such as motion.duration_s"


class _AddressError(Exception):
    """An address leads nowhere; the argument says why."""


def read_setting(text: str, *, option: str = "--set") -> tuple[str, object]:
    """Address and value of ``KEY=VALUE``; the value is read as strictly as one in a cell file, ``null`` leaves it out.

    Messages name the option that the text belongs to.
    """
    address, sign, value = (part.strip() for part in text.partition("="))
    if not sign or not address:
        raise InputError(f"{option}: expected KEY=VALUE, such as motion.duration_s=2.5, got {shown(text)}")
    return address, None if value == NOTHING else _as_read(f"value: {value}", f"{option} {address}")


def changed(document: YamlDocument, values: Mapping[str, object], places: Mapping[str, str] = {}) -> YamlDocument:
    """The document with other values by address, None for a key that is left out; messages name values or their places.

    See ``Cell.with_values``.
    """
    for address, value in values.items():
        document = _with_value(document, address, value, what=places.get(address) or _what(address, value))
    return document


def plain_values(values: Mapping[str, object]) -> dict[str, Any]:
    """Values as they are recorded: texts, numbers, truth values, lists and mappings, None for what is left out."""
    return {address: _plain(value, address) for address, value in values.items()}


def _with_value(document: YamlDocument, address: str, value: object, *, what: str) -> YamlDocument:
    """The document with one other value, of which messages say what it is."""
    where = f"{document.file} with {what}"
    try:
        steps = _steps(address)
        new = LEFT_OUT if value is None else _as_read(f"value: {_text(value, where)}", where)
        root, path = _edited(document.root, steps, new, annotation=CellDocument)
    except _AddressError as error:
        raise InputError(f"{where}: {error}") from None
    values = {place: mark for place, mark in document.values.items() if place[: len(path)] != path}
    earlier = {place: text for place, text in document.changes.items() if place[: len(path)] != path}
    return replace(document, root=root, values=values, changes={**earlier, path: what})


def _steps(address: str) -> list[str]:
    """Keys and indices of an address."""
    steps = INDEX.sub(r".\1", address).split(".")
    if not all(steps):
        raise _AddressError(f"{AN_ADDRESS}, got {shown(address)}")
    return steps


def _what(address: str, value: object) -> str:
    """A change as messages show it: ``motion.duration_s = 2.5``."""
    if value is None:
        return f"{address} left out"
    try:
        text = flow_text(_plain(value, address))
    except (ValueError, InputError):
        text = repr(value)
    return f"{address} = {text if len(text) <= SHOWN_LENGTH else text[: SHOWN_LENGTH - 1] + '…'}"


def _text(value: object, where: str) -> str:
    """A value as YAML on one line."""
    try:
        return flow_text(_plain(value, where))
    except ValueError:
        raise InputError(f"{where}: expected finite numbers, got {shown(value)}") from None


def _as_read(text: str, where: str) -> Any:
    """The value of the key ``value`` in a line of YAML."""
    if "\n" in text or "\r" in text:
        raise InputError(f"{where}: expected a value on one line, got several")
    try:
        document = parse_yaml(text.encode(), file=where)
    except InputError as error:
        raise InputError(str(error).replace(f"{where}:1:", f"{where}:", 1)) from None
    raise_findings(where, [replace(finding, line=0, key="") for finding in document.findings])
    return document.root["value"]


def _plain(value: object, where: str) -> Any:
    """A value as a cell file could hold it."""
    plain: object = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if isinstance(plain, Enum | PurePath):
        plain = plain.as_posix() if isinstance(plain, PurePath) else plain.value
    if isinstance(plain, Mapping):
        return {str(key): _plain(item, where) for key, item in plain.items()}
    if isinstance(plain, tuple | list):
        return [_plain(item, where) for item in plain]
    if plain is None or isinstance(plain, bool | int | float | str):
        return plain
    raise InputError(f"{where}: expected a number, a text, true, false, a list or a mapping, got {shown(value)}")


def _edited(node: Any, steps: list[str], value: Any, *, annotation: Any) -> tuple[Any, KeyPath]:
    """A node of the document with a value below it, and the key path of that value from the node on."""
    if not steps:
        return value, ()
    key: str | int
    if isinstance(node, tuple):
        key, rest, child = _element(node, steps)
    elif isinstance(node, dict):
        key, rest, child = _entry(node, steps, annotation)
    else:
        raise _AddressError(f"{AN_ADDRESS}, got {shown(steps[0])} below the value {shown(node)}")
    new, below = _edited(child, rest, value, annotation=annotation_at(annotation, (key,)))
    if isinstance(node, tuple):
        if new is LEFT_OUT:
            raise _AddressError("expected a value, as an element of a list cannot be left out, got nothing")
        return tuple(new if index == key else item for index, item in enumerate(node)), (key, *below)
    members = {name: item for name, item in node.items() if name != key}
    return members if new is LEFT_OUT else {**node, key: new}, (key, *below)


def _element(node: tuple[Any, ...], steps: list[str]) -> tuple[int, list[str], Any]:
    """Index in a list, the steps behind it, and the element."""
    first, *rest = steps
    if not first.isdecimal() or int(first) >= len(node):
        allowed = f"an index from 0 to {len(node) - 1}" if node else "a list with entries"
        raise _AddressError(f"expected {allowed}, got {shown(first)}")
    return int(first), rest, node[int(first)]


def _entry(node: dict[str, Any], steps: list[str], annotation: Any) -> tuple[str, list[str], Any]:
    """Key in a mapping, the steps after it, and the value of the key or its default."""
    for count in range(len(steps), 0, -1):  # names of joints may have dots
        if (name := ".".join(steps[:count])) in node:
            return name, steps[count:], node[name]
    first, *rest = steps
    fields = fields_of(annotation)
    if first in COMPONENTS and first not in fields and _is_pose(annotation):
        whole, index = COMPONENTS[first]
        return whole, [index, *rest], node.get(whole, fields[whole].default)
    if rest and get_origin(annotation) is dict:
        _require_optional(first, node, get_args(annotation)[1])
    default = fields[first].get_default(call_default_factory=True) if first in fields else None
    return first, rest, default if isinstance(default, tuple) else {}


def _is_pose(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, PoseEntry)


def _require_optional(name: str, node: dict[str, Any], annotation: Any) -> None:
    """Refuse to set a single value of an entry that does not exist and could not be made of that value alone."""
    if any(field.is_required() for field in fields_of(annotation).values()):
        known = list(node)
        raise _AddressError(f"expected one of {listed(known)}, got {shown(name)}{did_you_mean(name, known)}")
