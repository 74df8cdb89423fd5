"""Plain values as YAML text: every number reads back to the same value, every text stays a text."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Final

from cellplan.files.yaml.scalars import SurpriseError, plain_value

WIDTH: Final = 120  # [characters] of a line; what is longer is opened up, one entry to a line
PLAIN_TEXT: Final = re.compile(r"[A-Za-z0-9_+][A-Za-z0-9_+./-]*|-[A-Za-z][A-Za-z0-9_+./-]*")


def yaml_text(values: Mapping[str, object]) -> str:
    """Text of a mapping of words, numbers, truth values, lists and mappings; ends with a line break."""
    return "\n".join(_block_mapping(values, "")) + "\n"


def _block_mapping(values: Mapping[str, object], indent: str) -> Iterator[str]:
    """Lines of a mapping, one key to a line."""
    for key, value in values.items():
        head = f"{indent}{_text(key)}:"
        flow = f"{head} {flow_text(value)}"
        is_open = isinstance(value, Mapping | tuple | list) and bool(value)
        if not is_open or (_depth(value) <= 2 and len(flow) <= WIDTH):
            yield flow
            continue
        yield head
        yield from _block(value, indent + "  ")


def _block(value: object, indent: str) -> Iterator[str]:
    """Lines of a mapping or list."""
    if isinstance(value, Mapping):
        yield from _block_mapping(value, indent)
    elif isinstance(value, tuple | list):
        for item in value:
            yield f"{indent}- {flow_text(item)}"


def _depth(value: object) -> int:
    """Levels of mappings and lists in a value."""
    if isinstance(value, Mapping):
        return 1 + max((_depth(item) for item in value.values()), default=0)
    if isinstance(value, tuple | list):
        return 1 + max((_depth(item) for item in value), default=0)
    return 0


def flow_text(value: object) -> str:
    """A value on one line, as it would stand behind its key; ``ValueError`` where a number is not finite."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_text(key)}: {flow_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(flow_text(item) for item in value) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return _number(value) if isinstance(value, int | float) else _text(str(value))


def _number(value: float) -> str:
    """Shortest text that reads back to the same number, whole ones without a decimal point."""
    if not math.isfinite(value):
        raise ValueError(f"a number to be written must be finite, got {value!r}")
    if float(value).is_integer() and abs(value) < 1e15 and math.copysign(1.0, value) * value >= 0.0:
        return "-0.0" if value == 0.0 and math.copysign(1.0, value) < 0.0 else str(int(value))
    mantissa, mark, exponent = repr(float(value)).partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{mark}{exponent}" if mark else mantissa


def _text(text: str) -> str:
    """A text, in quotes where it could be read as something else."""
    try:
        is_plain = PLAIN_TEXT.fullmatch(text) is not None and plain_value(text) == text
    except SurpriseError:
        is_plain = False
    if is_plain:
        return text
    return '"' + "".join(_escaped(character) for character in text) + '"'


def _escaped(character: str) -> str:
    """A character inside double quotes."""
    if character in '"\\':
        return "\\" + character
    code = ord(character)
    return character if character.isprintable() else f"\\x{code:02x}" if code < 256 else f"\\U{code:08x}"
