"""APT and CLDATA: cutter locations as CAM systems state them before a postprocessor."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.paths.locations import MM_PER_INCH, UPRIGHT, Locations, Point, file_lines, number, wrong_number
from cellplan.files.cell.paths.settings import CamSettings
from cellplan.files.input.findings import did_you_mean, shown
from cellplan.model.task.task import ProgrammedPath

UNITS: Final = {"MM": 1.0, "INCH": MM_PER_INCH, "INCHES": MM_PER_INCH}
FEEDS: Final = {"MMPM": 1.0, "IPM": MM_PER_INCH}  # units of feeds in [mm/min]
TEXTS: Final = frozenset({"PARTNO", "PPRINT", "REMARK"})  # the rest of the line is words
_STILL: Final = (
    "AUXFUN CLEARP CLPRNT COOLNT CUTTER DELAY DISPLY END INTOL LOADTL MACHIN MSYS NOPOST OPSTOP OUTTOL PAINT PREFUN "
    "SPINDL STOP TLDATA TOLER TOOLNO"
)
STILL: Final = TEXTS.union(_STILL.split())  # words that move no tool
READ: Final = ("GOTO", "FROM", "FEDRAT", "RAPID", "MULTAX", "UNITS", "FINI")
MOVING: Final = {
    "CIRCLE": "arcs",
    "MOVARC": "arcs",
    "CYCLE": "cycles",
    "TRACUT": "transformations",
    "COPY": "copies",
    "INDEX": "copies",
    "GODLTA": "steps",
    "GOHOME": "moves home",
    "RETRCT": "retracts",
    "ROTABL": "turns of the table",
    "ROTATE": "turns of the table",
    "CUTCOM": "cutter compensation",
    "ORIGIN": "another origin",
    "TRANS": "shifts",
    "INSERT": "code of a controller",
}  # words that move the tool in a way that is not read
_STATEMENT: Final = re.compile(r"\s*([A-Z][A-Z0-9]*)\s*(?:/(.*))?", re.DOTALL)
_TOOL_PATH: Final = re.compile(r"\s*(TOOL PATH|END-OF-PATH)\s*(?:/.*)?", re.DOTALL)


@dataclass(slots=True)
class _Reader:
    """What the statements up to one have said."""

    at: Locations
    unit: float | None = None  # [mm] of a length
    feed: float | None = None  # [mm/s]
    is_rapid: bool = False  # whether the next move is a rapid
    is_multax: bool | None = None  # whether points may have tool axes; None until it is stated
    axis: Point = UPRIGHT
    ended: int = 0  # line of FINI; 0 before it

    def read(self, line: int, text: str) -> None:
        """One statement."""
        if self.ended:
            self.at.refuse(line, f"expected nothing after FINI in line {self.ended}, got {shown(text.strip())}")
        if path := _TOOL_PATH.fullmatch(text):
            self.at.unused[path.group(1)] += 1
            return
        match = _STATEMENT.fullmatch(text)
        word, rest = (match.group(1), match.group(2)) if match else ("", None)
        if match is None and (title := re.match(r"\s*([A-Z]+)", text)) and title.group(1) in TEXTS:
            word = title.group(1)
        if word in STILL:
            self._count(line, word)
        elif word in {"GOTO", "FROM"}:
            self._go(line, word, self._numbers(line, word, rest))
        elif word == "FEDRAT":
            self._feed(line, self._values(rest))
        elif word in READ:
            self._state(line, word, self._values(rest))
        elif word in MOVING:
            self.at.refuse(
                line, f"expected motions as points (GOTO), got {MOVING[word]} ({word}); have CAM write them as points"
            )
        else:
            known = did_you_mean(word, [*READ, *STILL])
            self.at.refuse(line, f"expected a statement of APT, got {shown(text.strip())}{known}")

    def _count(self, line: int, word: str) -> None:
        """A word that moves nothing."""
        if word == "LOADTL" and self.at.points:
            self.at.refuse(line, "expected one tool, got LOADTL after the first point; write a file for each tool")
        self.at.unused[word] += 1

    def _values(self, rest: str | None) -> list[str]:
        return [] if rest is None else [value.strip() for value in rest.split(",")]

    def _numbers(self, line: int, word: str, rest: str | None) -> list[float]:
        """The numbers of a statement."""
        numbers = []
        for text in self._values(rest):
            value = number(text)
            if value is None:
                self.at.refuse(line, f"{word}: {wrong_number(text)}")
            numbers.append(value)
        return numbers

    def _go(self, line: int, word: str, values: list[float]) -> None:
        """A point, with a tool axis where it has one."""
        if len(values) not in {3, 6}:
            self.at.refuse(line, f"expected {word}/x,y,z or {word}/x,y,z,i,j,k, got {len(values)} numbers")
        if self.unit is None:
            self.at.refuse(
                line, "expected UNITS before the first point, got none; write UNITS/MM or UNITS/INCHES above it"
            )
        if len(values) > 3:
            if self.is_multax is False:
                self.at.refuse(
                    line, f"expected {word}/x,y,z after MULTAX/OFF, got a tool axis; write MULTAX/ON above it"
                )
            self.axis = self.at.unit_axis(line, (values[3], values[4], values[5]))
        if word == "FROM" and self.at.points:
            self.at.refuse(line, "expected FROM before the first point, got it after one; write GOTO")
        if self.feed is None and not self.is_rapid and self.at.points:
            self.at.refuse(line, "expected a feed before the first move, got none; write FEDRAT or RAPID above it")
        x, y, z = (value * self.unit for value in values[:3])
        self.at.move(line, (x, y, z), self.axis, None if self.is_rapid else self.feed)
        self.is_rapid = False

    def _feed(self, line: int, values: list[str]) -> None:
        """A feed per minute, in a unit of its own or that of the file."""
        words = [value.upper() for value in values if number(value) is None]
        amounts = [value for value in map(number, values) if value is not None]
        if len(amounts) != 1 or len(words) > 1 or any(word not in FEEDS for word in words):
            got = shown(",".join(values))
            self.at.refuse(line, f"expected FEDRAT/v, FEDRAT/v,MMPM or FEDRAT/v,IPM, got {got}; feeds are per minute")
        unit = FEEDS[words[0]] if words else self.unit
        if unit is None:
            self.at.refuse(
                line, "expected UNITS before the first feed, got none; write UNITS/MM or UNITS/INCHES above it"
            )
        self.feed = self.at.feed(line, amounts[0], unit)

    def _state(self, line: int, word: str, values: list[str]) -> None:
        """A statement about those that follow."""
        allowed: dict[str, tuple[tuple[str, ...], ...]] = {
            "RAPID": ((),),
            "FINI": ((),),
            "MULTAX": ((), ("ON",), ("OFF",)),
            "UNITS": tuple((it,) for it in UNITS),
        }
        given = tuple(value.upper() for value in values)
        if given not in allowed[word]:
            forms = " or ".join("/".join((word, *form)) for form in allowed[word])
            self.at.refuse(line, f"expected {forms}, got {shown('/'.join((word, ','.join(values))))}")
        if word == "RAPID":
            self.is_rapid = True
        elif word == "FINI":
            self.ended = line
        elif word == "MULTAX":
            self.is_multax = given != ("OFF",)
        elif self.at.points and UNITS[given[0]] != self.unit:
            self.at.refuse(line, "expected one unit in a file, got another one after the first point")
        else:
            self.unit = UNITS[given[0]]


def read_apt(path: Path, settings: CamSettings) -> tuple[ProgrammedPath, str]:
    """Read APT or CLDATA as text: ``GOTO``, ``FROM``, ``MULTAX``, ``FEDRAT``, ``RAPID`` and ``UNITS``.

    A tool axis holds until another one is stated, ``RAPID`` for the next point only. Statements that move no tool are
    counted.

    Returns:
        The path, and what of the file is not part of it.

    Raises:
        InputError: The file cannot be read, or a line has anything else.
    """
    reader = _Reader(Locations(settings.source))
    for line, text in _statements(path, settings.source):
        reader.read(line, text)
    return reader.at.path(settings), reader.at.remark


def _statements(path: Path, file: str) -> Iterator[tuple[int, str]]:
    """Statements with the number of their first line: continued after ``$``, without comments after ``$$``."""
    begun, parts = 0, list[str]()
    for line, text in file_lines(path, file):
        code, sign, _ = text.partition("$")
        is_continued = bool(sign) and not text[len(code) :].startswith("$$")
        if parts or code.strip():
            parts.append(code)
            begun = begun or line
        if parts and not is_continued:
            yield begun, "".join(parts).upper()
            begun, parts = 0, []
    if parts:
        raise InputError(f"{file}:{begun}: expected the rest of a statement after '$', got the end of the file")
