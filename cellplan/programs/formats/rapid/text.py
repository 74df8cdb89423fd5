"""Text of RAPID as statements: modules with declarations and routines, each statement with its file and line."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final, NoReturn

from cellplan.errors import InputError
from cellplan.programs.formats.rapid.units import NAME, WORDS

_BLOCK: Final = re.compile(r"\s*(module\s+\w+|endmodule|proc\s+\w+\s*\(\s*\)|endproc)(?![\w(])\s*(.*)", re.I | re.S)
_CODE: Final = re.compile(r'(?:[^"!]|"[^"]*")*')
_VERSION: Final = re.compile(r"(version|language)\s*:\s*\w+", re.I)
_SPACE: Final = re.compile(r"\s+")
_AROUND: Final = re.compile(r"\s*([\[\]{}(),:=\\])\s*")
_DATA: Final = re.compile(r"(task )?(pers|const|var) (\w+) (\w+)(?:\{(\d{1,3})\})?(?::=(.*))?", re.I)
_TYPES: Final = frozenset(
    {"tasks", "syncident", "triggdata"} | {"tooldata", "wobjdata", "speeddata", "zonedata", "jointtarget", "robtarget"}
)
_SHOWN: Final = 60  # characters of a statement in a message


@dataclass(frozen=True, slots=True)
class RapidStatement:
    """A statement without its semicolon, spaces where it needs them only."""

    text: str
    file: str
    line: int  # its first line there

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise an ``InputError`` that says what was expected here."""
        shown = repr(self.text[:_SHOWN]) if got is None else got[:_SHOWN]
        raise InputError(f"{self.file}:{self.line}: expected {expected}, got {shown}")


@dataclass(frozen=True, slots=True)
class Datum:
    """A declaration."""

    statement: RapidStatement  # where it stands
    storage: str  # ``pers``, ``task pers``, ``const`` or ``var``
    kind: str  # its data type, in lower case
    name: str  # its name as written
    count: int | None  # number of elements of an array; None for a single value
    value: str | None  # text of its value; None without one


@dataclass(slots=True)
class RapidModule:
    """A module: declarations and routines by name in lower case, and where it ends."""

    name: str
    data: dict[str, Datum] = field(default_factory=dict)
    routines: dict[str, list[RapidStatement]] = field(default_factory=dict)
    heads: dict[str, RapidStatement] = field(default_factory=dict)
    ends: dict[str, RapidStatement] = field(default_factory=dict)


def read_module(text: str, file: str) -> RapidModule:
    """A module of declarations and routines, with unknown statements left in the routines."""
    statements = _statements(text, file)
    first = next(statements, None)
    if first is None or not first.text.lower().startswith("module "):
        raise InputError(f"{file}:{first.line if first else 1}: expected MODULE and a name")
    module = RapidModule(name=first.text.split(" ")[1])
    is_ended, routine = False, ""
    for statement in statements:
        word, _, rest = statement.text.partition(" ")
        word = word.lower()
        if is_ended:
            statement.refuse("nothing after ENDMODULE")
        if routine:
            if word == "endproc":
                module.ends[routine] = statement
                routine = ""
            elif word in {"proc", "endmodule", "module"}:
                statement.refuse("ENDPROC")
            else:
                module.routines[routine].append(statement)
        elif word == "proc":
            routine = _routine(module, statement, rest.removesuffix("()"))
        elif word == "endmodule":
            is_ended = True
        else:
            _declare(module, statement)
    if not is_ended:
        raise InputError(f"{file}:{text.count(chr(10)) + 1}: expected ENDMODULE, got the end of the file")
    return module


def value_of(datum: Datum) -> Any:
    """Value of a declaration as nested lists of booleans, strings and numbers."""
    plain = re.sub(r"\b(true|false)\b", lambda match: match[0].lower(), datum.value or "", flags=re.I)
    try:
        return json.loads(plain, parse_int=float, parse_constant=_no_number)
    except ValueError:
        datum.statement.refuse(f"a value of {datum.kind}")


def _no_number(word: str) -> NoReturn:
    """Refuse Infinity and NaN, which are no numbers of RAPID."""
    raise ValueError(word)


def _routine(module: RapidModule, statement: RapidStatement, name: str) -> str:
    """Begin a routine; its name in lower case."""
    key = name.lower()
    if key in module.routines or key in module.data:
        statement.refuse("a name that is used once", name)
    if not NAME.fullmatch(name) or (key in WORDS and key != "main"):
        statement.refuse("a routine with a name of at most 32 letters, digits and _", name)
    module.routines[key] = []
    module.heads[key] = statement
    return key


def _declare(module: RapidModule, statement: RapidStatement) -> None:
    """Take a declaration."""
    if module.routines:
        statement.refuse("declarations before routines")
    match = _DATA.fullmatch(statement.text)
    if match is None or match[3].lower() not in _TYPES:
        statement.refuse("a declaration, PROC or ENDMODULE")
    task, storage, kind, name, count, value = match.groups()
    key, storage = name.lower(), storage.lower()
    if key in module.data:
        statement.refuse("a name that is used once", name)
    if not NAME.fullmatch(name) or key in WORDS:
        statement.refuse("a name of at most 32 letters, digits and _", name)
    if task and storage != "pers":
        statement.refuse("TASK before PERS only")
    if storage in {"pers", "const"} and not value:
        statement.refuse(f"a value of {name}")
    number = None if count is None else int(count)
    module.data[key] = Datum(statement, f"{(task or '').lower()}{storage}", kind.lower(), name, number, value)


def _statements(text: str, file: str) -> Iterator[RapidStatement]:
    """Statements of a file, comments and the header of a version left out."""
    pending, begun, is_header = "", 0, False
    for number, line in enumerate(_lines(text, file), start=1):
        if not pending and (line.strip() == "%%%" or is_header):
            is_header = _header(line, RapidStatement(line.strip(), file, number), is_header=is_header)
            continue
        rest = _code(line, RapidStatement(line.strip(), file, number))
        while rest.strip():
            begun = begun if pending else number
            block = None if pending else _BLOCK.match(rest)
            if block:
                yield RapidStatement(plain_statement(block[1]), file, number)
                rest = block[2]
                continue
            head, ended, rest = rest.partition(";")
            pending = f"{pending} {head}" if pending else head
            if ended:
                yield RapidStatement(plain_statement(pending), file, begun)
                pending = ""
    if pending:
        RapidStatement(plain_statement(pending), file, begun).refuse("a semicolon at the end of the statement")
    if is_header:
        raise InputError(f"{file}: expected a second line %%% after the version")


def _lines(text: str, file: str) -> Iterator[str]:
    """Lines of a text of printable ASCII whose last line is ended."""
    lines = text.split("\n")
    if lines.pop():
        raise InputError(f"{file}:{len(lines) + 1}: expected the last line to be ended; the file is truncated")
    for number, line in enumerate(lines, start=1):
        plain = line.removesuffix("\r")
        if not (plain.isascii() and plain.replace("\t", " ").isprintable()):
            raise InputError(f"{file}:{number}: expected printable ASCII, got {plain[:_SHOWN]!r}")
        yield plain


def _code(line: str, statement: RapidStatement) -> str:
    """A line without its comment."""
    if '"' not in line:
        return line.partition("!")[0]
    match = _CODE.match(line)
    code = match[0] if match else ""
    if line[len(code) :].startswith('"'):
        statement.refuse("a closing quotation mark")
    return code


def _header(line: str, statement: RapidStatement, *, is_header: bool) -> bool:
    """Whether the header of a version goes on after a line of it."""
    if line.strip() == "%%%":
        return not is_header
    if line.strip() and not _VERSION.fullmatch(line.strip()):
        statement.refuse("VERSION or LANGUAGE, or %%%")
    return True


def plain_statement(text: str) -> str:
    """A statement with one space between words and none round signs."""
    text = text.strip()
    space = text.find(" ")
    is_written_here = space > 0 and "\t" not in text and text.find(" ", space + 1) < 0
    if is_written_here and text[space + 1 : space + 3] == "[[" and text[space - 1].isalnum():
        return text[:space] + text[space + 1 :]
    return _AROUND.sub(r"\1", _SPACE.sub(" ", text))
