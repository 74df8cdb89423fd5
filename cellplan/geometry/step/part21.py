"""The text of a STEP file: an exchange structure of ISO 10303-21, looked through before a library reads it.

A library that meets damage reads on and leaves out what it cannot understand. What is missing, doubled or cut off is
therefore looked for in the text, where it has a line and an entity number.
"""

import re
from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError

MAX_BYTES: Final = 100_000_000
MAX_ENTITIES: Final = 1_000_000
_SPACE: Final = re.compile(r"(?:\s++|/\*.*?\*/)*+", re.DOTALL)
_STATEMENT: Final = re.compile(r"(?:[^;'\"/]++|'(?:[^'\n]|''|\n)*+'|\"[^\"]*+\"|/\*.*?\*/|/)*+;", re.DOTALL)
_STRING: Final = re.compile(r"'(?:[^']|'')*+'|\"[^\"]*+\"|/\*.*?\*/", re.DOTALL)
_ENTITY: Final = re.compile(r"#(\d+)\s*+=\s*+(?:(?:!?([A-Z_][A-Z0-9_]*+))?\s*+)(\(.*\))\s*;", re.DOTALL)
_REFERENCE: Final = re.compile(r"#(\d+)")
_KEYWORD: Final = re.compile(r"!?([A-Z_][A-Z0-9_]*+)\s*+\(")
_ODD: Final = re.compile(r"[^A-Z0-9_#=$*.,+\-()!\s&@]")
_BRACKET: Final = re.compile(r"[()]")
_NUMBERS: Final = re.compile(r"(?<![A-Za-z0-9_.#])[+-]?\d[^,()\s]*+")
_NUMBER: Final = re.compile(r"[+-]?\d++(?:\.\d*+(?:E[+-]?\d++)?)?")
_CURVE: Final = "LINE|CIRCLE|ELLIPSE|.*CURVE.*|POLYLINE|PARABOLA|HYPERBOLA|PCURVE|"
_SURFACE: Final = "PLANE|.*SURFACE.*|"
REFERS_TO: Final = {
    "ADVANCED_FACE": f"FACE_BOUND|FACE_OUTER_BOUND|{_SURFACE}",
    "FACE_BOUND": "EDGE_LOOP|VERTEX_LOOP|POLY_LOOP",
    "FACE_OUTER_BOUND": "EDGE_LOOP|VERTEX_LOOP|POLY_LOOP",
    "EDGE_LOOP": "ORIENTED_EDGE",
    "ORIENTED_EDGE": "EDGE_CURVE|EDGE|ORIENTED_EDGE|VERTEX_POINT",
    "EDGE_CURVE": f"VERTEX_POINT|{_CURVE}",
    "VERTEX_POINT": "CARTESIAN_POINT|.*POINT",
    "VERTEX_LOOP": "VERTEX_POINT",
    "CLOSED_SHELL": "ADVANCED_FACE|FACE_SURFACE|ORIENTED_FACE",
    "OPEN_SHELL": "ADVANCED_FACE|FACE_SURFACE|ORIENTED_FACE",
    "MANIFOLD_SOLID_BREP": "CLOSED_SHELL|ORIENTED_CLOSED_SHELL",
    "BREP_WITH_VOIDS": "CLOSED_SHELL|ORIENTED_CLOSED_SHELL",
    "AXIS2_PLACEMENT_3D": "CARTESIAN_POINT|DIRECTION",
    "AXIS2_PLACEMENT_2D": "CARTESIAN_POINT|DIRECTION",
    "AXIS1_PLACEMENT": "CARTESIAN_POINT|DIRECTION",
    "LINE": "CARTESIAN_POINT|VECTOR",
    "VECTOR": "DIRECTION",
    "CIRCLE": "AXIS2_PLACEMENT_[23]D",
    "ELLIPSE": "AXIS2_PLACEMENT_[23]D",
    "PLANE": "AXIS2_PLACEMENT_3D",
    "CYLINDRICAL_SURFACE": "AXIS2_PLACEMENT_3D",
    "CONICAL_SURFACE": "AXIS2_PLACEMENT_3D",
    "SPHERICAL_SURFACE": "AXIS2_PLACEMENT_3D",
    "TOROIDAL_SURFACE": "AXIS2_PLACEMENT_3D",
    "B_SPLINE_CURVE_WITH_KNOTS": "CARTESIAN_POINT",
    "B_SPLINE_SURFACE_WITH_KNOTS": "CARTESIAN_POINT",
    "PCURVE": f"DEFINITIONAL_REPRESENTATION|{_SURFACE}",
    "SURFACE_CURVE": _CURVE,
    "SEAM_CURVE": _CURVE,
    "SURFACE_OF_LINEAR_EXTRUSION": f"VECTOR|{_CURVE}",
    "SURFACE_OF_REVOLUTION": f"AXIS1_PLACEMENT|{_CURVE}",
    "CARTESIAN_POINT": "",
    "DIRECTION": "",
}  # what entities of shapes refer to: a library follows a wrong reference into nowhere; entities of several names may
# stand anywhere
_PATTERNS: Final = {name: re.compile(f"(?:{allowed})\\Z") for name, allowed in REFERS_TO.items()}
_BEGIN, _END = "ISO-10303-21;", "END-ISO-10303-21;"
UNREAD: Final = {
    "TESSELLATED": "tessellated shapes",
    "ANNOTATION": "annotations",
    "DIMENSIONAL": "dimensions",
    "GEOMETRIC_TOLERANCE": "geometric tolerances",
}  # what stands in STEP files beside shapes, by the beginning of its names


@dataclass(frozen=True, slots=True)
class Exchange:
    """What the text of a STEP file says of itself."""

    counts: Counter[str]  # entities by keyword
    lines: dict[int, int]  # line of each entity

    @property
    def unread(self) -> Iterator[str]:
        """What the file holds beside shapes, with its count."""
        for start, words in UNREAD.items():
            count = sum(number for name, number in self.counts.items() if name.startswith(start))
            if count:
                yield f"{words} ({count})"


def scan(text: str, file: str) -> Exchange:
    """Look through the text of a STEP file.

    Raises:
        InputError: It is no exchange structure, is cut off, refers to entities that it does not define, or states no
            unit of length; with its line and entity number.
    """
    return _Scanner(text, file).exchange()


class _Scanner:
    """Goes through the statements of one text."""

    def __init__(self, text: str, file: str) -> None:
        self._text = text
        self._file = file
        self._breaks = [match.start() for match in re.finditer("\n", text)]
        self._place = 0

    def exchange(self) -> Exchange:
        """All of it; see `scan`."""
        if not self._text.lstrip("\ufeff \t\r\n").startswith(_BEGIN):
            raise self._error(0, f"expected a STEP file that begins with {_BEGIN}, got other text")
        self._place = self._text.index(_BEGIN) + len(_BEGIN)
        self._header()
        counts: Counter[str] = Counter()
        lines: dict[int, int] = {}
        uses: list[tuple[int, int, str, int]] = []
        names: dict[int, str] = {}
        for start, statement in self._section("DATA"):
            number, keywords, references = self._entity(start, statement)
            if number in lines:
                raise self._error(
                    start, f"#{number}: expected each entity once, got it again after line {lines[number]}"
                )
            lines[number] = self._line(start)
            counts.update(keywords)
            names[number] = keywords[0] if len(keywords) == 1 else ""
            uses += [(start, number, names[number], used) for used in references]
            if len(lines) > MAX_ENTITIES:
                raise self._error(start, f"expected at most {MAX_ENTITIES} entities, got more")
        self._expect(_END)
        self._require_references(uses, names)
        if not counts["LENGTH_UNIT"]:
            raise self._error(
                0, "expected a unit of length (LENGTH_UNIT), got none; export the file again with its unit"
            )
        return Exchange(counts, lines)

    def _require_references(self, uses: list[tuple[int, int, str, int]], names: dict[int, str]) -> None:
        """Refuse references to what is not there, and those of shapes to what they cannot consist of."""
        for start, number, name, used in uses:
            if used not in names:
                raise self._error(start, f"#{number}: expected entities that the file defines, got #{used}")
            if name in _PATTERNS and not _PATTERNS[name].match(names[used]) and names[used]:
                allowed = REFERS_TO[name].strip("|").replace("|", ", ").replace(".*", "…") or "numbers only"
                got = f"#{used}, {names[used]}"
                raise self._error(start, f"#{number}: expected {name} to refer to {allowed}, got {got}")

    def _header(self) -> None:
        """The section before the data."""
        names = [statement.partition("(")[0].strip() for _, statement in self._section("HEADER")]
        for name in ("FILE_DESCRIPTION", "FILE_NAME", "FILE_SCHEMA"):
            if name not in names:
                raise self._error(self._place, f"expected {name} in the header, got {', '.join(names) or 'nothing'}")

    def _section(self, name: str) -> Iterator[tuple[int, str]]:
        """Statements of a section with their places."""
        self._expect(f"{name};")
        while True:
            start, statement = self._next()
            if statement == "ENDSEC;":
                return
            yield start, statement

    def _expect(self, words: str) -> None:
        start, statement = self._next()
        if statement.replace(" ", "") != words:
            raise self._error(start, f"expected {words}, got {_shown(statement)}")

    def _next(self) -> tuple[int, str]:
        """The next statement with its place; what does not end is refused."""
        space = _SPACE.match(self._text, self._place)
        start = self._place if space is None else space.end()
        match = _STATEMENT.match(self._text, start)
        if match is None:
            rest = _shown(self._text[start:])
            raise self._error(start, f"expected a statement that ends with ;, got {rest}: is the file cut off?")
        self._place = match.end()
        return start, match.group()

    def _entity(self, start: int, statement: str) -> tuple[int, list[str], list[int]]:
        """Number, keywords and references of an entity."""
        bare = _STRING.sub("''", statement)
        match = _ENTITY.fullmatch(bare)
        if match is None:
            raise self._error(start, f"expected an entity such as #12 = KEYWORD(...);, got {_shown(statement)}")
        number, body = int(match[1]), match[3]
        plain = body.replace("''", "")
        if (odd := _ODD.search(plain)) is not None:
            raise self._error(start, f"#{number}: expected no sign {odd.group()!r} outside of texts")
        if _depth(plain):
            raise self._error(start, f"#{number}: expected as many opening as closing brackets")
        for word in _NUMBERS.findall(plain):
            if not _NUMBER.fullmatch(word):
                raise self._error(start, f"#{number}: expected a number, got {_shown(word)}")
        keywords = [match[2]] if match[2] else _KEYWORD.findall(body)
        if not keywords:
            raise self._error(start, f"#{number}: expected a keyword, got {_shown(statement)}")
        return number, keywords, [int(used) for used in _REFERENCE.findall(body)]

    def _line(self, place: int) -> int:
        return bisect_right(self._breaks, place - 1) + 1

    def _error(self, place: int, text: str) -> InputError:
        return InputError(f"{self._file}:{self._line(place)}: {text}")


def _depth(plain: str) -> int:
    """Number of brackets that are not closed at the end; negative where one closes that was not opened."""
    depth = 0
    for bracket in _BRACKET.findall(plain):
        depth += 1 if bracket == "(" else -1
        if depth < 0:
            break
    return depth


def _shown(text: str) -> str:
    """The beginning of a text on one line."""
    words = " ".join(text.split())
    return repr(words if len(words) <= 40 else words[:40] + "…")
