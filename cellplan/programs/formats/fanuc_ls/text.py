"""Files of TP programs: sections, attributes, numbered lines and points; anything else refused with file and line."""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, zip_longest
from typing import Final, NamedTuple

from cellplan.errors import InputError
from cellplan.programs.elements.text import Statement, lines_of, truncated_error

LINES: Final = 9999  # most of a program
COMMENT: Final = 16  # most characters of the comment of a program or a point
REMARK: Final = 32  # most characters of a remark
SLOTS: Final = 5  # groups that DEFAULT_GROUP lists, or more where a higher one moves
_SECTIONS: Final = ("/PROG", "/ATTR", "/MN", "/POS", "/END")
_COUNT: Final = r"[0-9]{1,9}"
_DATE: Final = r"DATE\s+[0-9-]{6,10}\s+TIME\s+[0-9:]{5,8}"
_TASK: Final = ("STACK_SIZE", "TASK_PRIORITY", "TIME_SLICE", "BUSY_LAMP_OFF", "ABORT_REQUEST", "PAUSE_REQUEST")
_ATTRIBUTES: Final = {
    **dict.fromkeys(("OWNER", "FILE_NAME"), r"[A-Z0-9_]*"),
    "COMMENT": rf'"[^";]{{0,{COMMENT}}}"',
    **dict.fromkeys(("PROG_SIZE", "VERSION", "LINE_COUNT", "MEMORY_SIZE", *_TASK), _COUNT),
    **dict.fromkeys(("CREATE", "MODIFIED"), _DATE),
    "PROTECT": r"READ_WRITE|READ",
    "DEFAULT_GROUP": rf"[1*](?:\s*,\s*[1*]){{{SLOTS - 1},7}}",
    "CONTROL_CODE": r"[0-9]{8} [0-9]{8}",
    "LOCAL_REGISTERS": r"[0-9]+,[0-9]+,[0-9]+",
}
_ATTRIBUTE: Final = re.compile(r"(?:TCD:\s*)?([A-Z_]+)\s*=\s*(.*?)\s*([,;])")
_LINE: Final = re.compile(r"([0-9]{1,6})\s*:\s*(.*?)\s*;")
_NUMBER: Final = r"-?(?:[0-9]{1,7}(?:\.[0-9]{0,12})?|\.[0-9]{1,12})"
_NAME: Final = r"(?:[JE][1-9]|[XYZWPR])"
_AXIS: Final = re.compile(rf"({_NAME})\s*=\s*({_NUMBER})\s*(deg|mm)")
_AXES: Final = rf"{_NAME}\s*=\s*{_NUMBER}\s*(?:deg|mm)"
_CONFIG: Final = r"CONFIG\s*:\s*'([NF] [UD] [TB](?:,\s*-?[0-9]){3})'\s*,"
_GROUP: Final = re.compile(
    rf"GP([1-8])\s*:\s*UF\s*:\s*([0-9]{{1,3}})\s*,\s*UT\s*:\s*([0-9]{{1,3}})\s*,"
    rf"\s*(?:{_CONFIG})?\s*({_AXES}(?:\s*,\s*{_AXES})*)\s*"
)
_POINT: Final = re.compile(rf'P\s*\[\s*([0-9]{{1,5}})\s*(?::\s*"([^"]{{0,{COMMENT}}})"\s*)?\]\s*\{{\s*(.*?)\s*\}}\s*;')
_P: Final = rf"P\s*\[\s*([0-9]{{1,5}}(?:\s*:[^\]\"]{{0,{COMMENT}}})?)\s*\]\s+"
_FEED: Final = r"(?:([0-9]{1,4}(?:\.[0-9])?)\s*mm/sec|WELD_SPEED)\s+(FINE|CR\s*[0-9]{1,4})"
_SUFFIX: Final = r"(?:\s+(\S.*))?"
_PATTERNS: Final = {
    kind: re.compile(text)
    for kind, text in {
        "J": rf"J\s+{_P}([0-9]{{1,6}}(?:\.[0-9]{{1,6}})?)\s*(%|sec|msec)\s+(FINE|CNT\s*[0-9]{{1,3}}){_SUFFIX}",
        "L": rf"L\s+{_P}{_FEED}{_SUFFIX}",
        "C": rf"C\s+{_P}{_P}{_FEED}{_SUFFIX}",
        "UFRAME": r"UFRAME_NUM\s*(?:\[\s*GP([1-8])\s*\])?\s*=\s*([0-9]{1,3})",
        "UTOOL": r"UTOOL_NUM\s*(?:\[\s*GP([1-8])\s*\])?\s*=\s*([0-9]{1,3})",
        "OUT": r"DO\s*\[\s*([0-9]{1,5})\s*\]\s*=\s*(ON|OFF)",
        "WAIT": r"WAIT\s+DI\s*\[\s*([0-9]{1,5})\s*\]\s*=\s*(ON|OFF)",
        "DWELL": r"WAIT\s+([0-9]{0,3}\.[0-9]{2})\s*\(sec\)",
        "CALL": r"CALL\s+([A-Z][A-Z0-9_]*)",
        "LINE": r"((?:Weave|Track|Arc|Weld)\s.*|CALL\s+\w+\s*\(.*\))",
    }.items()
}


class TpPose(NamedTuple):
    """What a point says of one group."""

    base: int  # number of its user frame
    tool: int  # number of its tool frame
    axes: Mapping[str, str]  # units by name of the axis, in the order of the file
    values: Sequence[float]  # of these axes
    configuration: str = ""  # of an arm; empty for joint positions


class TpPoint(NamedTuple):
    """A point of a program."""

    statement: Statement  # where it begins
    poses: Mapping[int, TpPose]  # by number of the group
    name: str = ""


class TpFile(NamedTuple):
    """What a file holds."""

    groups: frozenset[int]  # that it moves
    head: Statement  # its ``/ATTR``
    statements: Sequence[Statement]
    points: Mapping[int, TpPoint]
    end: Statement  # its ``/END``


def read_file(left: dict[str, str], name: str) -> TpFile:
    """Read the file of a program, by its name, and take it out of those that are left."""
    path = f"{name}.ls"
    if path not in left:
        raise InputError(f"{path}: expected a file, got none")
    lines = lines_of(left.pop(path), path)
    statements = [Statement(path, number, line.strip()) for number, line in enumerate(lines, start=1) if line.strip()]
    if not statements or not re.fullmatch(rf"/PROG\s+{name}", statements[0].text):
        at = statements[0] if statements else Statement(path, 1, "an empty file")
        raise at.error(f"/PROG {name}")
    attributes, motions, positions, (end,) = _sections(statements)
    return TpFile(_groups(attributes), attributes[0], _statements(motions), _points(positions), end)


def _sections(lines: Sequence[Statement]) -> tuple[Sequence[Statement], ...]:
    """Lines of the attributes with their head, of the motions and of the points; and the last line."""
    parts = [line for line, after in pairwise([*lines, lines[-1]]) if (line.text, after.text) != ("/APPL", "/MN")]
    heads = [place for place, line in enumerate(parts) if line.text.startswith("/")]
    for place, word in zip_longest(heads, _SECTIONS):
        if place is None:
            raise truncated_error(parts[-1].file, parts[-1].line, str(word))
        if word is None or parts[place].text.split()[0] != word:
            raise parts[place].error(word or "the end of the file")
    _, attributes, motions, positions, end = heads
    if attributes != 1 or end != len(parts) - 1:
        raise parts[1 if attributes > 1 else -1].error("/ATTR" if attributes > 1 else "nothing behind /END")
    return parts[attributes:motions], parts[motions + 1 : positions], parts[positions + 1 : end], parts[end:]


def _groups(lines: Sequence[Statement]) -> frozenset[int]:
    """Groups that a program moves, by its attributes, each of which stands there once."""
    values: dict[str, str] = {}
    for line in lines[1:]:
        match = _ATTRIBUTE.fullmatch(line.text)
        if match is None or match[1] in values or not re.fullmatch(_ATTRIBUTES.get(match[1], r"\0"), match[2]):
            raise line.error("an attribute of a program, each once")
        if (match[3] == ",") is not (match[1] in _TASK[:-1]):
            raise line.error("a comma within TCD, and a semicolon behind it and behind all others")
        values[match[1]] = match[2]
    if "DEFAULT_GROUP" not in values:
        raise lines[0].error("the attribute DEFAULT_GROUP", "none")
    slots = values["DEFAULT_GROUP"].split(",")
    return frozenset(number for number, slot in enumerate(slots, start=1) if slot.strip() == "1")


def _statements(lines: Sequence[Statement]) -> list[Statement]:
    """Instructions of the numbered lines, without remarks and empty ones."""
    statements, before = [], 0
    for line in _whole(lines):
        match = _LINE.fullmatch(line.text)
        if match is None or ";" in match[2]:
            raise line.error("one numbered instruction that ends in a semicolon")
        if not before < int(match[1]) <= LINES:
            raise line.error(f"a number above that of the line before, at most {LINES}", match[1])
        before = int(match[1])
        if match[2] and not match[2].startswith("!"):
            statements.append(line._replace(text=match[2]).read_by(_PATTERNS))
    return statements


def _whole(lines: Sequence[Statement]) -> Iterator[Statement]:
    """Lines with those behind them that begin with a colon and continue them."""
    open_line: Statement | None = None
    for line in lines:
        whole = line
        if open_line is not None:
            if not line.text.startswith(":"):
                raise open_line.error("one numbered instruction that ends in a semicolon")
            whole = open_line._replace(text=f"{open_line.text} {line.text[1:].strip()}")
        open_line = None if whole.text.endswith(";") else whole
        if open_line is None:
            yield whole
    if open_line is not None:
        raise open_line.error("one numbered instruction that ends in a semicolon")


def _points(lines: Sequence[Statement]) -> dict[int, TpPoint]:
    """Points by number, each there once."""
    points: dict[int, TpPoint] = {}
    block: list[Statement] = []
    for line in lines:
        block.append(line)
        if line.text.endswith("};"):
            number, point = _point(block[0], " ".join(part.text for part in block))
            if number in points:
                raise block[0].error("each point once", f"P[{number}] again")
            points[number] = point
            block = []
    if block:
        raise block[0].error("a point that ends in };")
    return points


def _point(begin: Statement, text: str) -> tuple[int, TpPoint]:
    """Number of a point and what it says of its groups."""
    match = _POINT.fullmatch(text)
    if match is None:
        raise begin.error("P[n]{ .. };", text)
    poses: dict[int, TpPose] = {}
    place = 0
    while place < len(match[3]):
        group = _GROUP.match(match[3], place)
        if group is None or int(group[1]) in poses:
            raise begin.error("GPn: UF : n, UT : n, and axes in deg or mm, of each group once", match[3][place:])
        axes = _AXIS.findall(group[5])
        units = {name: unit for name, _, unit in axes}
        if len(units) < len(axes):
            raise begin.error("each axis once", group[5])
        values = [float(value) for _, value, _ in axes]
        poses[int(group[1])] = TpPose(int(group[2]), int(group[3]), units, values, group[4] or "")
        place = group.end()
    return int(match[1]), TpPoint(begin, poses, match[2] or "")
