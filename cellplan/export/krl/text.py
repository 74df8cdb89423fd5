"""Files of a KUKA module: their lines, declarations and statements, anything else refused with file and line."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Final, NamedTuple

from cellplan.errors import InputError
from cellplan.export.krl.names import AXES, EXTERNAL, LINE, NAME
from cellplan.export.lines import split_lines

_NUMBER: Final = r"[-+]?[0-9]{1,7}(?:\.[0-9]{1,12})?"
_BOOL: Final = r"(TRUE|FALSE)"
STATEMENTS: Final = {
    "PTP": r"PTP\s+(\w+)(?:\s+(C_PTP))?",
    "VEL_PTP": rf"BAS\s*\(\s*#VEL_PTP\s*,\s*({_NUMBER})\s*\)",
    "INITMOV": r"BAS\s*\(\s*#INITMOV\s*,\s*0\s*\)",
    "ADVANCE": r"\$ADVANCE\s*=\s*([0-9]+)",
    "TOOL": r"\$TOOL\s*=\s*(?:TOOL_DATA\s*\[\s*([0-9]+)\s*\]|\$NULLFRAME)",
    "BASE": r"\$BASE\s*=\s*(?:BASE_DATA\s*\[\s*([0-9]+)\s*\]|\$NULLFRAME)",
    "APO": r"\$APO\s*\.\s*CPTP\s*=\s*([0-9]+)",
    "OUT": rf"\$OUT\s*\[\s*([0-9]+)\s*\]\s*=\s*{_BOOL}",
    "WAIT": rf"WAIT\s+FOR\s+(?:(NOT)\s+\$IN\s*\[\s*([0-9]+)\s*\]|\$IN\s*\[\s*([0-9]+)\s*\](?:\s*==\s*{_BOOL})?)",
    "CALL": r"(\w+)\s*\(\s*\)",
}
_PATTERNS: Final = {kind: re.compile(text, re.IGNORECASE) for kind, text in STATEMENTS.items()}
_EXT: Final = re.compile(r"EXT\s+(\w+)\s*\(\s*(.*?)\s*\)", re.IGNORECASE)
_EXT_BAS: Final = re.compile(r"BAS_COMMAND\s*:\s*IN\s*,\s*REAL\s*:\s*IN", re.IGNORECASE)
_POINT: Final = re.compile(r"(?:DECL\s+)?E6AXIS\s+(\w+)\s*=\s*\{\s*(?:E6AXIS\s*:)?\s*(.*?)\s*\}", re.IGNORECASE)
_COMPONENT: Final = re.compile(rf"([AE][1-6])\s+({_NUMBER})", re.IGNORECASE)
_FIRST: Final = re.compile(r"(DEF|DEFDAT)\s+(\w+)\s*(\(\s*\)|)(?:\s+PUBLIC)?", re.IGNORECASE)


class _KrlLine(NamedTuple):
    """A line without its comment."""

    number: int  # from 1
    text: str  # what it says; never empty


class KrlStatement(NamedTuple):
    """A statement of a source file."""

    line: int  # number of its line
    kind: str  # one of ``STATEMENTS``
    text: str  # the line
    words: tuple[str | None, ...]  # what its pattern found


@dataclass(frozen=True, slots=True, kw_only=True)
class KrlModule:
    """What both files of a module hold."""

    path: str  # path without the ending
    externals: Mapping[str, int]  # lines of the declarations of other modules, by their names
    statements: Sequence[KrlStatement]  # statements in their order
    end: int  # number of the line of ``END``
    points: Mapping[str, Sequence[float]]  # values of all components of each point, by name in small letters
    lines: Mapping[str, int]  # lines of the points


def read_module(left: dict[str, str], path: str) -> KrlModule:
    """Read both files of a module.

    Args:
        left: Files that were not read yet, by path; those of the module are taken out.
        path: Path of the module without the ending.

    Raises:
        InputError: With file and line, when a text is not such a file, or one is missing.
    """
    source, data = f"{path}.src", f"{path}.dat"
    for file in (source, data):
        if file not in left:
            raise InputError(f"{file}: expected a file, got none")
    externals, statements, end = _source(source, _lines(left.pop(source), source), path.rpartition("/")[2])
    points, lines = _data(data, _lines(left.pop(data), data), path.rpartition("/")[2])
    return KrlModule(path=path, externals=externals, statements=statements, end=end, points=points, lines=lines)


def _source(file: str, lines: Sequence[_KrlLine], name: str) -> tuple[dict[str, int], list[KrlStatement], int]:
    """Declarations and statements of a source file, and the line of its end."""
    externals: dict[str, int] = {}
    statements: list[KrlStatement] = []
    for line in _body(file, lines, ("DEF", name, "END")):
        external = _EXT.fullmatch(line.text)
        if external is None:
            statements.append(_statement(file, line))
        elif statements:
            raise located(file, line.number, "declarations before the first statement", line.text)
        elif external[1].upper() == "BAS":
            if not _EXT_BAS.fullmatch(external[2]):
                raise located(file, line.number, "EXT BAS (BAS_COMMAND :IN,REAL :IN )", line.text)
        elif external[2] or external[1] in externals:
            raise located(file, line.number, "each page declared once, without parameters", line.text)
        else:
            externals[external[1]] = line.number
    return externals, statements, lines[-1].number


def _statement(file: str, line: _KrlLine) -> KrlStatement:
    """The statement of a line."""
    for kind, pattern in _PATTERNS.items():
        match = pattern.fullmatch(line.text)
        if match is not None:
            return KrlStatement(line.number, kind, line.text, match.groups())
    raise located(file, line.number, "a statement that these programs have", line.text)


def _data(file: str, lines: Sequence[_KrlLine], name: str) -> tuple[dict[str, Sequence[float]], dict[str, int]]:
    """Points of a data file and their lines, by name in small letters."""
    points: dict[str, Sequence[float]] = {}
    numbers: dict[str, int] = {}
    counts = set[int]()
    for line in _body(file, lines, ("DEFDAT", name, "ENDDAT")):
        external = _EXT.fullmatch(line.text)
        if external and external[1].upper() == "BAS" and _EXT_BAS.fullmatch(external[2]) and not points:
            continue
        match = _POINT.fullmatch(line.text)
        if match is None:
            raise located(file, line.number, "DECL E6AXIS NAME={A1 .., A2 .., ..}", line.text)
        point = match[1].lower()
        if point in points or len(point) > NAME or not point[0].isalpha():
            raise located(file, line.number, f"names of points that differ, of at most {NAME} characters", match[1])
        points[point], count = _components(file, line, match[2])
        numbers[point] = line.number
        counts.add(count)
        if len(counts) > 1:
            raise located(file, line.number, "as many axes as in the points before", line.text)
    return points, numbers


def _components(file: str, line: _KrlLine, text: str) -> tuple[list[float], int]:
    """Values of all axes of a point, not a number for absent external ones, and how many are present."""
    components: dict[str, float] = {}
    for part in text.split(","):
        match = _COMPONENT.fullmatch(part.strip())
        if match is None or match[1].upper() in components:
            raise located(file, line.number, "each axis once with a plain decimal number", part)
        components[match[1].upper()] = float(match[2])
    if any(axis not in components for axis in AXES[: len(components)]) or len(components) < len(AXES) - EXTERNAL:
        raise located(file, line.number, "A1 to A6, and E1 to En without a gap", text)
    return [components.get(axis, nan) for axis in AXES], len(components)


def _body(file: str, lines: Sequence[_KrlLine], words: tuple[str, str, str]) -> Sequence[_KrlLine]:
    """The lines between the first and the last one, which are as they have to be."""
    first, name, last = words
    begin = _FIRST.fullmatch(lines[0].text) if lines else None
    has_brackets = first == "DEF"
    if begin is None or begin[1].upper() != first or begin[2] != name or bool(begin[3]) != has_brackets:
        where, got = (lines[0].number, lines[0].text) if lines else (1, "an empty file")
        raise located(file, where, f"{first} {name}{'()' if has_brackets else ''}", got)
    if lines[-1].text.upper() != last:
        raise located(file, lines[-1].number, f"{last} as the last statement", lines[-1].text)
    return lines[1:-1]


def _lines(text: str, file: str) -> list[_KrlLine]:
    """Lines without comments, empty ones and the header; refuses what no such file has."""
    parts = split_lines(text, file)
    if parts[-1]:
        raise located(file, len(parts), "a last line that is ended", parts[-1])
    lines = list[_KrlLine]()
    for number, part in enumerate(parts[:-1], start=1):
        bad = re.search(r"[^ -~\t]", part)
        if bad:
            raise located(file, number, "printable ASCII", bad[0])
        if len(part) > LINE:
            raise located(file, number, f"at most {LINE} characters", f"{len(part)}")
        said = part.partition(";")[0].strip()
        if said and not (said.startswith("&") and not lines):
            lines.append(_KrlLine(number, said))
    return lines


def located(file: str, line: int, expected: str, got: str) -> InputError:
    """An error as one located line."""
    return InputError(f"{file}:{line}: expected {expected}, got {got[:60]!r}")
