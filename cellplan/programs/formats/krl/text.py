"""Files of a KUKA module: their lines, declarations and statements, anything else refused with file and line."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Final

from cellplan.errors import InputError
from cellplan.model.report.exported import ExportFrame
from cellplan.programs.elements.handshake import require_signals_like
from cellplan.programs.elements.pages import ProgramNames
from cellplan.programs.elements.text import Statement, line_error, split_lines

NAME: Final = 24  # most characters of a name
LAST_SIGNAL: Final = 4096  # number of the last input and output that all controllers of the language have
LINE: Final = 471  # most characters of a line
WHOLE: Final = 200.0  # [%] of $APO.CPTP for a share of one: 100 % is half a motion
POINT: Final = "XP"  # first letters of the name of a point; its number is that of the row, from 1
POINT_NAME: Final = rf"{POINT}[0-9]+"
EXTERNAL: Final = 6  # external axes E1 to E6
AXES: Final = tuple(f"A{axis}" for axis in range(1, 7)) + tuple(f"E{axis}" for axis in range(1, EXTERNAL + 1))
_WORDS: Final = """
ABS ACOS AND ANIN ANOUT ATAN2 AXIS BAS BASE_DATA BOOL B_AND B_EXOR B_NOT B_OR BRAKE CASE CAST_FROM CAST_TO CCLOSE
CHANNEL CHAR CIOCTL CIRC CIRC_REL CONFIRM CONST CONTINUE COPEN COS CREAD CWRITE C_DIS C_ORI C_PTP C_SPL C_VEL DECL
DEF DEFAULT DEFDAT DEFFCT DELAY DIGIN DISTANCE DO E6AXIS E6POS ELSE END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP
ENDSPLINE ENDSWITCH ENDWHILE ENUM EXIT EXOR EXT EXTFCT FALSE FOR FRAME GLOBAL GOTO HALT HOME IF IMPORT IN INI INT
INTERRUPT IS LIN LIN_REL LOAD LOAD_DATA LOOP MAXIMUM MINIMUM NOT OFF ON OR OUT PATH POS PTP PTP_REL PTP_SPLINE
PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC SEMA SIGNAL SIN SLIN SPL SPLINE SPS SPTP SQRT SREAD STATE STEP
STRUC SWITCH SWRITE TAN THEN TIME_BLOCK TO TOOL_DATA TRIGGER TRUE UNTIL USER WAIT WHEN WHILE WITH
"""
MODULES: Final = ProgramNames(NAME, frozenset(_WORDS.split()), POINT_NAME)
NUMBER: Final = r"[-+]?[0-9]{1,7}(?:\.[0-9]{1,12})?"
_BOOL: Final = r"(TRUE|FALSE)"
STATEMENTS: Final = {
    "PTP": r"PTP\s+(\w+)(?:\s+(C_PTP))?",
    "VEL_PTP": rf"BAS\s*\(\s*#VEL_PTP\s*,\s*({NUMBER})\s*\)",
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
_COMPONENT: Final = re.compile(rf"([AE][1-6])\s+({NUMBER})", re.IGNORECASE)
_FIRST: Final = re.compile(r"(DEF|DEFDAT)\s+(\w+)\s*(\(\s*\)|)(?:\s+PUBLIC)?", re.IGNORECASE)


def require_numbers(frame: ExportFrame, robot: str) -> None:
    """Refuse handshake signals that are not the numbers of inputs and outputs."""
    numbers = frozenset(map(str, range(1, LAST_SIGNAL + 1)))
    expected = f"a whole number from 1 to {LAST_SIGNAL}, as KUKA controllers number their signals"
    require_signals_like(frame, robot, numbers.__contains__, expected)


@dataclass(frozen=True, slots=True, kw_only=True)
class KrlModule:
    """What both files of a module hold."""

    path: str  # path without the ending
    externals: Mapping[str, Statement]  # declarations of other modules, by their names
    statements: Sequence[Statement]  # statements in their order
    end: Statement  # its ``END``
    points: Mapping[str, Sequence[float]]  # values of all components of each point, by name in small letters
    lines: Mapping[str, Statement]  # declarations of the points

    @property
    def name(self) -> str:
        """Its name, which is that of its files."""
        return self.path.rpartition("/")[2]


def read_module(left: dict[str, str], path: str) -> KrlModule:
    """Read both files of a module, by its path without ending, and take them out of those that are left."""
    files = f"{path}.src", f"{path}.dat"
    for file in files:
        if file not in left:
            raise InputError(f"{file}: expected a file, got none")
    name = path.rpartition("/")[2]
    source, data = (source_lines(left.pop(file), file) for file in files)
    externals, statements = _source(_body(files[0], source, ("DEF", name, "END")))
    points, lines = _data(_body(files[1], data, ("DEFDAT", name, "ENDDAT")))
    return KrlModule(path=path, externals=externals, statements=statements, end=source[-1], points=points, lines=lines)


def _source(lines: Sequence[Statement]) -> tuple[dict[str, Statement], list[Statement]]:
    """Declarations and statements of a source file."""
    externals: dict[str, Statement] = {}
    statements: list[Statement] = []
    for line in lines:
        external = _EXT.fullmatch(line.text)
        if external is None:
            statements.append(line.read_by(_PATTERNS))
        elif statements:
            raise line.error("declarations before the first statement")
        elif external[1].upper() == "BAS":
            if not _EXT_BAS.fullmatch(external[2]):
                raise line.error("EXT BAS (BAS_COMMAND :IN,REAL :IN )")
        elif external[2] or external[1] in externals:
            raise line.error("each page declared once, without parameters")
        else:
            externals[external[1]] = line
    return externals, statements


def _data(lines: Sequence[Statement]) -> tuple[dict[str, Sequence[float]], dict[str, Statement]]:
    """Points of a data file and their declarations, by name in small letters."""
    points: dict[str, Sequence[float]] = {}
    declared: dict[str, Statement] = {}
    counts = set[int]()
    for line in lines:
        external = _EXT.fullmatch(line.text)
        if external and external[1].upper() == "BAS" and _EXT_BAS.fullmatch(external[2]) and not points:
            continue
        match = _POINT.fullmatch(line.text)
        if match is None:
            raise line.error("DECL E6AXIS NAME={A1 .., A2 .., ..}")
        point = match[1].lower()
        if point in points or len(point) > NAME or not point[0].isalpha():
            raise line.error(f"names of points that differ, of at most {NAME} characters", match[1])
        points[point], count = read_components(line, match[2])
        declared[point] = line
        counts.add(count)
        if len(counts) > 1:
            raise line.error("as many axes as in the points before")
    return points, declared


def read_components(line: Statement, text: str) -> tuple[list[float], int]:
    """Values of all axes of a point, not a number for absent external ones, and how many are present."""
    components: dict[str, float] = {}
    for part in text.split(","):
        match = _COMPONENT.fullmatch(part.strip())
        if match is None or match[1].upper() in components:
            raise line.error("each axis once with a plain decimal number", part)
        components[match[1].upper()] = float(match[2])
    if any(axis not in components for axis in AXES[: len(components)]) or len(components) < len(AXES) - EXTERNAL:
        raise line.error("A1 to A6, and E1 to En without a gap", text)
    return [components.get(axis, nan) for axis in AXES], len(components)


def _body(file: str, lines: Sequence[Statement], words: tuple[str, str, str]) -> Sequence[Statement]:
    """The lines between the first and the last one, which are as they have to be."""
    first, name, last = words
    begin = _FIRST.fullmatch(lines[0].text) if lines else None
    has_brackets = first == "DEF"
    if begin is None or begin[1].upper() != first or begin[2] != name or bool(begin[3]) != has_brackets:
        at = lines[0] if lines else Statement(file, 1, "an empty file")
        raise at.error(f"{first} {name}{'()' if has_brackets else ''}")
    if lines[-1].text.upper() != last:
        raise lines[-1].error(f"{last} as the last statement")
    return lines[1:-1]


def source_lines(text: str, file: str) -> list[Statement]:
    """Lines without comments, empty ones and the header; refuses what no such file has."""
    parts = split_lines(text, file)
    if parts[-1]:
        raise line_error(file, len(parts), "a last line that is ended", parts[-1])
    lines = list[Statement]()
    for number, part in enumerate(parts[:-1], start=1):
        bad = re.search(r"[^ -~\t]", part)
        if bad:
            raise line_error(file, number, "printable ASCII", bad[0])
        if len(part) > LINE:
            raise line_error(file, number, f"at most {LINE} characters", f"{len(part)}")
        said = part.partition(";")[0].strip()
        if said and not (said.startswith("&") and not lines):
            lines.append(Statement(file, number, said))
    return lines
