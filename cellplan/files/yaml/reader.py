"""Strict YAML: plain mappings, lists, words and numbers, with the line of every key and value.

Works on the parser's events, so that size, depth and forbidden constructs are seen before anything is built.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import yaml

from cellplan.errors import InputError
from cellplan.files.input.files import digest, read_regular_file
from cellplan.files.input.findings import Finding, KeyPath, key_text, shown
from cellplan.files.yaml.scalars import SurpriseError, plain_value

SIZE_LIMIT: Final = 2_000_000  # [bytes]
NODE_LIMIT: Final = 200_000
DEPTH_LIMIT: Final = 32
KEY_LENGTH_LIMIT: Final = 100  # [characters] no key of a cell comes near
FORBIDDEN_IN_KEYS: Final = frozenset("<>")  # no name has them; the schema marks its choices with them
WORDS_AS_KEYS: Final = frozenset({"on", "off"})  # of a process; a key is never a truth value

# Everything that is not printable text: it could hide words from the reader or shift the line numbers.
CONTROL_CHARACTERS: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff\ufffe\uffff]"
)
QUOTES: Final = frozenset("'\"")
BRACKETS: Final = frozenset("{}[],")
LINE_BREAK: Final = re.compile("\r\n|\r|\n")


class Unreadable:
    """Takes the place of a refused value, so that the rest of the file can still be read."""

    def __repr__(self) -> str:
        """What a message would show."""
        return "an unreadable value"


UNREADABLE: Final = Unreadable()


class SourceMark(NamedTuple):
    """A place in a file; line and column count from 1."""

    line: int
    column: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class YamlDocument:
    """A file as plain values, and where they stand."""

    file: str  # name in messages
    digest: str  # SHA-256 of the bytes that were read
    root: dict[str, Any]  # the values: dict, tuple, str, int, float, bool, or ``UNREADABLE`` where a finding was made
    values: Mapping[KeyPath, SourceMark]  # place of each value; a block mapping or list stands at its key
    keys: Mapping[KeyPath, SourceMark]  # place of each key
    findings: tuple[Finding, ...]  # what the reader refused; the caller adds its own and raises all at once
    unreadable: frozenset[KeyPath]  # key paths whose value was refused
    changes: Mapping[KeyPath, str] = field(default_factory=dict)  # keys set after reading, with their texts in messages
    sources: Mapping[KeyPath, KeyPath] = field(default_factory=dict)  # keys that stand elsewhere in the file, by where

    def line(self, path: KeyPath) -> int:
        """Line of a value; of the nearest enclosing one when the value is absent."""
        while path and path not in self.values:
            path = path[:-1]
        return self.values[path].line

    def finding(self, path: KeyPath, text: str) -> Finding:
        """A finding about a value."""
        return self._finding(path, self.line(path), text)

    def key_finding(self, path: KeyPath, text: str) -> Finding:
        """A finding about a key."""
        return self._finding(path, self.keys[path].line if path in self.keys else self.line(path), text)

    def _finding(self, path: KeyPath, line: int, text: str) -> Finding:
        """A finding at a line, or at the change that set the value."""
        is_new = path not in self.values
        set_here = [
            change
            for place, change in self.changes.items()
            if path[: len(place)] == place or (is_new and place[: len(path)] == path)
        ]
        if set_here:
            return Finding(line=0, key=key_text(self.source(path)), text=text, changes=set_here[-1])
        key = key_text(self.source(path))
        return Finding(line=line, key=key, text=text, changes=", ".join(self.changes.values()))

    def source(self, path: KeyPath) -> KeyPath:
        """Where the value at a key path stands in the file."""
        known = next((path[:n] for n in range(len(path), 0, -1) if path[:n] in self.sources), None)
        return path if known is None else (*self.sources[known], *path[len(known) :])

    def lines(self) -> dict[str, int]:
        """Line of each value by key path as text."""
        return {key_text(path): mark.line for path, mark in self.values.items() if path}


def read_yaml(path: Path, *, file: str) -> YamlDocument:
    """Read a regular file of UTF-8, not too large, whose outermost value is a mapping."""
    return parse_yaml(read_regular_file(path, file=file, limit=SIZE_LIMIT), file=file)


def parse_yaml(data: bytes, *, file: str) -> YamlDocument:
    """Read the bytes of a file of UTF-8 whose outermost value is a mapping, within the limits on nodes and depth."""
    if len(data) > SIZE_LIMIT:
        raise InputError(f"{file}: expected a file of at most {SIZE_LIMIT / 1e6:g} MB, got a larger one")
    text = _decoded(data, file)
    composer = _Composer(file, _events(text, file))
    root = composer.document()
    return YamlDocument(
        file=file,
        digest=digest(data),
        root=root,
        values=composer.values,
        keys=composer.keys,
        findings=tuple(composer.findings),
        unreadable=frozenset(composer.unreadable),
    )


def _decoded(data: bytes, file: str) -> str:
    """Text of the file, after its byte-order mark and without control characters."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = len(LINE_BREAK.findall(data[: error.start].decode("utf-8", "replace"))) + 1
        raise InputError(f"{file}:{line}: expected UTF-8 text, got byte 0x{data[error.start]:02x}") from None
    match = CONTROL_CHARACTERS.search(text)
    if match:
        line = len(LINE_BREAK.findall(text, 0, match.start())) + 1
        raise InputError(f"{file}:{line}: expected printable text, got control character U+{ord(match[0]):04X}")
    return text


def _events(text: str, file: str) -> Iterator[Any]:
    """Events of the parser; its errors become one located line."""
    line, last = 1, None
    try:
        for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
            line, last = _mark(event).line, event
            yield event
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark is not None else line
        if mark and text[mark.index : mark.index + 1] == "\t":
            raise InputError(f"{file}:{line}: not valid YAML: a tab cannot indent, use spaces") from None
        problem = " ".join((error.problem or error.context or "cannot be read").split())
        opening = _left_open(text, error, last)
        if opening is not None:
            raise InputError(f"{file}:{opening}: not valid YAML: {problem}; what opens here is not closed") from None
        raise InputError(f"{file}:{line}: not valid YAML: {problem}") from None
    except (yaml.YAMLError, ValueError, OverflowError, IndexError):
        raise InputError(f"{file}:{line}: not valid YAML near this line") from None


def _left_open(text: str, error: yaml.MarkedYAMLError, last: Any) -> int | None:
    """Line of a quote or bracket without its end, which the parser misses only further down; None for other errors.

    A quote is left open when the file ends in it, or when the parser stumbles right behind a text of several lines. A
    bracket is when the parser stumbles in a line that is indented no deeper than the one with the opening.
    """
    opening, place = error.context_mark, error.problem_mark
    if place is None:
        return None
    if isinstance(last, yaml.ScalarEvent) and last.style in QUOTES and last.start_mark and last.end_mark:
        start, end = last.start_mark.line, last.end_mark.line
        if end == place.line:
            return int(start) + 1 if start < end else None
    if opening is None or opening.line >= place.line:
        return None
    lines = [*LINE_BREAK.split(text), ""]
    mark = lines[opening.line][opening.column : opening.column + 1]
    before = lines[place.line][: place.column]
    is_lower = _indent(lines[place.line]) <= _indent(lines[opening.line]) and not BRACKETS & set(before)
    return int(opening.line) + 1 if mark in QUOTES or (mark in BRACKETS and is_lower) else None


def _indent(line: str) -> int:
    """Blanks before the first word."""
    return len(line) - len(line.lstrip(" "))


@dataclass(slots=True, eq=False)
class _Composer:
    """Builds plain values from parser events and notes where they stand."""

    file: str
    events: Iterator[Any]
    values: dict[KeyPath, SourceMark] = field(default_factory=dict)
    keys: dict[KeyPath, SourceMark] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    unreadable: set[KeyPath] = field(default_factory=set)
    count: int = 0

    def document(self) -> dict[str, Any]:
        """The one document of the file."""
        next(self.events)
        start = next(self.events)
        if isinstance(start, yaml.StreamEndEvent):
            raise InputError(f"{self.file}: expected a mapping, got an empty file")
        if start.version or start.tags:
            raise InputError(f"{self.file}:{_mark(start).line}: YAML directives (%) are not allowed")
        first = next(self.events)
        if not isinstance(first, yaml.MappingStartEvent):
            raise InputError(f"{self.file}:{_mark(first).line}: expected a mapping (key: value) as the whole file")
        root: dict[str, Any] = self._value(first, (), _mark(first))
        next(self.events)
        more = next(self.events)
        if not isinstance(more, yaml.StreamEndEvent):
            raise InputError(f"{self.file}:{_mark(more).line}: expected one YAML document, got a second one")
        return root

    def _value(self, event: Any, path: KeyPath, key_mark: SourceMark) -> Any:
        """Value that begins with an event."""
        self._count(event, len(path))
        is_block = isinstance(event, yaml.CollectionStartEvent) and not event.flow_style
        self.values[path] = key_mark if is_block else _mark(event)
        if isinstance(event, yaml.AliasEvent):
            return self._refuse(
                event, path, f"YAML aliases (*) are not allowed, got {shown(event.anchor)}; write it out"
            )
        if event.anchor is not None:
            self._complain(event, path, f"YAML anchors (&) are not allowed, got {shown(event.anchor)}")
        if event.tag is not None:
            self._complain(event, path, f"YAML tags (!) are not allowed, got {shown(event.tag)}")
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(path)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(path)
        return self._scalar(event, path)

    def _mapping(self, path: KeyPath) -> dict[str, Any]:
        """Mapping whose start event was read."""
        mapping: dict[str, Any] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            self._count(event, len(path))
            key = self._key(event, path)
            if key is None or key in mapping:
                if key is not None:
                    first = self.keys[(*path, key)].line
                    self._complain(event, (*path, key), f"duplicate key, first given in line {first}")
                self._skip(next(self.events))
                continue
            self.keys[(*path, key)] = _mark(event)
            mapping[key] = self._value(next(self.events), (*path, key), _mark(event))
        return mapping

    def _key(self, event: Any, path: KeyPath) -> str | None:
        """Text of a key; None when it was refused."""
        if not isinstance(event, yaml.ScalarEvent):
            self._complain(event, path, "expected a word as key, got something else")
            if not isinstance(event, yaml.AliasEvent):
                self._skip(event)
            return None
        if event.anchor is not None or event.tag is not None:
            self._complain(event, (*path, event.value), "YAML anchors (&) and tags (!) are not allowed")
        if event.value == "<<":
            self._complain(event, path, "YAML merge keys (<<) are not allowed; write the values out")
            return None
        if not event.value.isprintable() or len(event.value) > KEY_LENGTH_LIMIT:
            self._complain(event, path, f"expected a short word as key, got {shown(event.value)}")
            return None
        if FORBIDDEN_IN_KEYS & set(event.value):
            self._complain(event, path, f"expected a key without '<' and '>', got {shown(event.value)}")
            return None
        value = self._scalar(event, path, is_key=True)
        if isinstance(value, bool):
            self._complain(event, path, f"expected a word as key, got {event.value}; put it in quotes")
            return None
        return None if value is UNREADABLE else str(event.value)

    def _sequence(self, path: KeyPath) -> tuple[Any, ...]:
        """List whose start event was read."""
        items: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            items.append(self._value(event, (*path, len(items)), _mark(event)))
        return tuple(items)

    def _scalar(self, event: Any, path: KeyPath, *, is_key: bool = False) -> Any:
        """Word, number or truth value."""
        refuse = self._complain if is_key else self._refuse
        if match := CONTROL_CHARACTERS.search(event.value):
            refuse(event, path, f"expected printable text, got control character U+{ord(match[0]):04X}")
            return UNREADABLE
        if not event.implicit[0] or (is_key and event.value in WORDS_AS_KEYS):
            return event.value
        try:
            return plain_value(event.value)
        except SurpriseError as surprise:
            refuse(event, path, str(surprise))
            return UNREADABLE

    def _skip(self, event: Any) -> None:
        """Pass over a value that has no place."""
        depth = 0
        while True:
            self._count(event, depth)
            depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
            if depth == 0:
                return
            event = next(self.events)

    def _count(self, event: Any, depth: int) -> None:
        """Stop at a file that is too large or too deep to be a cell."""
        self.count += 1
        if self.count > NODE_LIMIT:
            raise InputError(f"{self.file}:{_mark(event).line}: expected at most {NODE_LIMIT} values, got more")
        if depth >= DEPTH_LIMIT:
            raise InputError(f"{self.file}:{_mark(event).line}: expected at most {DEPTH_LIMIT} levels, got more")

    def _refuse(self, event: Any, path: KeyPath, text: str) -> Unreadable:
        """Record a finding and leave a mark in place of the value."""
        self._complain(event, path, text)
        self.unreadable.add(path)
        return UNREADABLE

    def _complain(self, event: Any, path: KeyPath, text: str) -> None:
        """Note a finding about what an event holds."""
        self.findings.append(Finding(line=_mark(event).line, key=key_text(path), text=text))


def _mark(event: Any) -> SourceMark:
    """Where an event starts."""
    return SourceMark(event.start_mark.line + 1, event.start_mark.column + 1)
