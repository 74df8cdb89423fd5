"""JSON whose values know their line: numbers are kept as they are written, keys stand once, and errors say where."""

import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError

DEEPEST: Final = 12  # levels; our own files have six
INDENT: Final = "  "
_NUMBER: Final = r"-?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?(?![0-9A-Za-z.+-])"
_SPACE: Final = re.compile(r"[ \t\r\n]*")
_NUMBERS: Final = re.compile(rf"\[[ \t\r\n]*({_NUMBER}(?:[ \t\r\n]*,[ \t\r\n]*{_NUMBER})*+)[ \t\r\n]*\]")
_SCALAR: Final = re.compile(rf'(?P<number>{_NUMBER})|(?P<word>true|false|null)\b|(?P<string>"(?:[^"\\\n]|\\.)*")')


class Raw(str):
    """A number as it is written: ``0.250000000``."""

    __slots__ = ()


Written = Raw | str | bool | None | Sequence["Written"] | Mapping[str, "Written"]


@dataclass(frozen=True, slots=True)
class Value:
    """A value of a file."""

    file: str  # name of the file in messages
    text: str  # content of the file
    at: int  # where the value begins there
    # a ``Raw`` number, a text, a flag or None; the texts of an array of numbers; or values of an array, or of an object
    # by key
    content: "Raw | str | bool | tuple[Raw, ...] | list[Value] | dict[str, Value] | None"

    @property
    def line(self) -> int:
        """Its line, from 1."""
        return _line(self.text, self.at)

    def refused(self, expected: str) -> InputError:
        """The error that something else stands here."""
        return _refused(self.file, self.text, self.at, expected)

    def members(self, keys: Collection[str]) -> "dict[str, Value]":
        """Values of an object that has exactly these keys, in any order."""
        if not isinstance(self.content, dict):
            raise self.refused(f"an object with the keys {', '.join(keys)}")
        for key, value in self.content.items():
            if key not in keys:
                raise InputError(f"{self.file}:{value.line}: expected one of the keys {', '.join(keys)}, got {key!r}")
        missing = [key for key in keys if key not in self.content]
        if missing:
            raise self.refused(f"an object with the key {missing[0]}")
        return self.content

    def items(self) -> "list[Value]":
        """Values of an array."""
        if isinstance(self.content, tuple):
            return [Value(self.file, self.text, self.at, number) for number in self.content]
        if not isinstance(self.content, list):
            raise self.refused("an array")
        return self.content

    def numbers(self, pattern: re.Pattern[str], what: str) -> tuple[Raw, ...]:
        """Numbers of an array, each of which matches a pattern."""
        if not isinstance(self.content, tuple):
            raise self.refused(f"an array of {what}")
        for place, number in enumerate(self.content):
            if not pattern.fullmatch(number):
                at = self._place_of(place)
                raise _refused(self.file, self.text, at, f"an array of {what}")
        return self.content

    def require_texts(self) -> None:
        """Make sure that the value is an array of texts."""
        for value in self.items():
            if not isinstance(value.content, str) or isinstance(value.content, Raw):
                raise value.refused("a text in quotes")

    def require(self, expected: Written, *, free: Collection[str] = ()) -> None:
        """Make sure that the value is a given one, but for the values of some keys of objects, which are free."""
        if isinstance(expected, Mapping):
            for key, value in self.members(tuple(expected)).items():
                if key not in free:
                    value.require(expected[key], free=free)
        elif isinstance(expected, Sequence) and not isinstance(expected, str):
            members = self.items()
            if len(members) != len(expected):
                raise self.refused(f"an array of {len(expected)} values")
            for value, other in zip(members, expected, strict=True):
                value.require(other, free=free)
        elif type(self.content) is not type(expected) or self.content != expected:
            raise self.refused(expected if isinstance(expected, Raw) else json.dumps(expected))

    def _place_of(self, place: int) -> int:
        """Where a number of an array begins."""
        at = self.at + 1
        for _ in range(place):
            at = self.text.index(",", at) + 1
        return _skip(self.text, at)


def parsed(text: str, file: str) -> Value:
    """The value that a file holds; an ``InputError`` has the line of what is no JSON, or of a key that stands twice."""
    value, at = _value(file, text, _skip(text, 0), 0)
    at = _skip(text, at)
    if at != len(text):
        raise _refused(file, text, at, "the end of the file")
    return value


def dumped(value: Written, indent: str = "") -> str:
    """Text of a value: objects over several lines, arrays of scalars on one line, ASCII only."""
    inner = indent + INDENT
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return json.dumps(value)
    if isinstance(value, Mapping):
        parts = [f"{json.dumps(key)}: {dumped(item, inner)}" for key, item in value.items()]
        return _block("{}", parts, indent)
    if all(isinstance(item, Raw) for item in value):
        return "[" + ", ".join(str(item) for item in value) + "]"
    return _block("[]", [dumped(item, inner) for item in value], indent)


def _block(brackets: str, parts: Sequence[str], indent: str) -> str:
    """Parts between brackets, each on lines of its own."""
    if not parts:
        return brackets
    inner = indent + INDENT
    return brackets[0] + "\n" + ",\n".join(inner + part for part in parts) + "\n" + indent + brackets[1]


def _value(file: str, text: str, at: int, depth: int) -> tuple[Value, int]:
    """The value that begins at a place, and where it ends."""
    if depth > DEEPEST:
        raise _refused(file, text, at, f"at most {DEEPEST} levels")
    opening = text[at : at + 1]
    if opening == "[":
        if match := _NUMBERS.match(text, at):
            texts = tuple(map(Raw, map(str.strip, match[1].split(","))))
            return Value(file, text, at, texts), match.end()
        return _array(file, text, at, depth)
    if opening == "{":
        return _object(file, text, at, depth)
    match = _SCALAR.match(text, at)
    if match is None:
        raise _refused(file, text, at, "a value")
    if match["number"] is not None:
        return Value(file, text, at, Raw(match["number"])), match.end()
    if match["word"] is not None:
        return Value(file, text, at, {"true": True, "false": False, "null": None}[match["word"]]), match.end()
    return Value(file, text, at, _string(file, text, at, match["string"])), match.end()


def _string(file: str, text: str, at: int, quoted: str) -> str:
    """A text without its quotes."""
    try:
        string: str = json.loads(quoted)
    except ValueError as error:
        raise _refused(file, text, at, "a text") from error
    return string


def _array(file: str, text: str, at: int, depth: int) -> tuple[Value, int]:
    """An array of any values."""
    begin, items = at, list[Value]()
    at = _skip(text, at + 1)
    if text[at : at + 1] == "]":
        return Value(file, text, begin, items), at + 1
    while True:
        value, at = _value(file, text, at, depth + 1)
        items.append(value)
        at = _skip(text, at)
        if text[at : at + 1] == "]":
            return Value(file, text, begin, items), at + 1
        at = _after(file, text, at, ",")


def _object(file: str, text: str, at: int, depth: int) -> tuple[Value, int]:
    """An object, whose keys differ."""
    begin, members = at, dict[str, Value]()
    at = _skip(text, at + 1)
    if text[at : at + 1] == "}":
        return Value(file, text, begin, members), at + 1
    while True:
        match = _SCALAR.match(text, at)
        if match is None or match["string"] is None:
            raise _refused(file, text, at, "a key")
        key = _string(file, text, at, match["string"])
        if key in members:
            raise InputError(f"{file}:{_line(text, at)}: expected each key once, got {key!r} twice")
        at = _after(file, text, _skip(text, match.end()), ":")
        members[key], at = _value(file, text, at, depth + 1)
        at = _skip(text, at)
        if text[at : at + 1] == "}":
            return Value(file, text, begin, members), at + 1
        at = _after(file, text, at, ",")


def _after(file: str, text: str, at: int, sign: str) -> int:
    """Where the next value begins after a sign."""
    if text[at : at + 1] != sign:
        raise _refused(file, text, at, f"'{sign}'")
    return _skip(text, at + 1)


def _skip(text: str, at: int) -> int:
    """The next place that is no space."""
    match = _SPACE.match(text, at)
    return at if match is None else match.end()


def _line(text: str, at: int) -> int:
    """Line of a place, from 1."""
    return 1 + text.count("\n", 0, at)


def _refused(file: str, text: str, at: int, expected: str) -> InputError:
    """The error that something else stands at a place."""
    got = text[at : at + 40].partition("\n")[0].strip()
    return InputError(
        f"{file}:{_line(text, at)}: expected {expected}, got {got!r}"
        if at < len(text)
        else f"{file}:{_line(text, at)}: expected {expected}, got the end of the file; it is truncated"
    )
