"""Code of VAL3 programs: its statements, refused with file and line where they are others."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from cellplan.programs.elements.text import Statement
from cellplan.programs.formats.val3.xml import Val3Element

_NAME: Final = r"[A-Za-z]\w*"
_ITEM: Final = rf"({_NAME})(?:\s*\[\s*(\w+)\s*\])?"
_FIRST: Final = rf"({_NAME})(?:\s*\[\s*0\s*\])?"
STATEMENTS: Final = {
    "MOVE": rf"movej\s*\(\s*{_ITEM}\s*,\s*{_ITEM}\s*,\s*{_ITEM}\s*\)",  # data of joints, tool, motion descriptor
    "LINE": rf"movel\s*\(\s*{_ITEM}\s*,\s*{_ITEM}\s*,\s*{_ITEM}\s*\)",  # data of a point, tool, motion descriptor
    "ARC": rf"movec\s*\(\s*{_ITEM}\s*,\s*{_ITEM}\s*,\s*{_ITEM}\s*,\s*{_ITEM}\s*\)",
    "DELAY": r"delay\s*\(\s*[0-9]+\.[0-9]+\s*\)",
    "STAND": r"waitEndMove\s*\(\s*\)",
    "RESET": r"resetMotion\s*\(\s*\)",
    "WAIT": rf"wait\s*\(\s*{_FIRST}\s*==\s*(true|false)\s*\)",
    "SET": rf"{_FIRST}\s*=\s*(true|false)",
    "CALL": rf"call\s+({_NAME})\s*\(\s*\)",
    "LIBRARY": rf"call\s+{_NAME}:{_NAME}\s*\([-0-9., ]*\)",
}
_PATTERNS: Final = {kind: re.compile(text, re.ASCII) for kind, text in STATEMENTS.items()}
_FOR: Final = re.compile(rf"for\s+({_NAME})\s*=\s*([0-9]+)\s+to\s+([0-9]+)(?:\s+step\s+([1-9][0-9]*))?", re.ASCII)
MOST_ROUNDS: Final = 1_000_000
DEEPEST: Final = 8  # loops in one another


class Loop(NamedTuple):
    """Statements that are done again and again."""

    head: Statement
    counter: str  # name of what counts
    values: range
    body: Sequence["Node"]  # the statements


Node = Statement | Loop


def read_code(code: Val3Element, counters: Collection[str]) -> tuple[list[Node], Statement]:
    """Statements of a program between ``begin`` and ``end``, whose loops use ``counters``, and its ``end``."""
    texts = (line.partition("//")[0].strip() for line in code.text.split("\n"))
    lines = [Statement(code.file, line, text) for line, text in enumerate(texts, start=code.text_line) if text]
    first, last = (lines[0], lines[-1]) if lines else [Statement(code.file, code.line, "")] * 2
    if first.text != "begin":
        raise first.error("begin")
    if len(lines) < 2 or last.text != "end":
        raise last.error("end")
    return _CodeReader(lines=lines[1:-1][::-1], counters=counters).statements((), first), last


@dataclass(slots=True, kw_only=True)
class _CodeReader:
    """Reads statements line by line."""

    lines: list[Statement]  # lines that are left, the next one last
    counters: Collection[str]  # names of the numbers that loops may count with

    def statements(self, inside: tuple[str, ...], line: Statement) -> list[Node]:
        """Statements after a line up to the end of the loop, or of the program; ``inside`` are the counters around."""
        nodes = list[Node]()
        while self.lines:
            line = self.lines.pop()
            if line.text == "endFor" and inside:
                return nodes
            loop = _FOR.fullmatch(line.text)
            nodes.append(self._loop(line, loop, inside) if loop else line.read_by(_PATTERNS))
        if inside:
            raise line.error("endFor")
        return nodes

    def _loop(self, line: Statement, loop: re.Match[str], inside: tuple[str, ...]) -> Loop:
        """A loop and what is in it."""
        first, last, step = int(loop[2]), int(loop[3]), int(loop[4] or 1)
        if loop[1] not in self.counters or loop[1] in inside or len(inside) == DEEPEST:
            raise line.error(f"a number that is declared and counts none of at most {DEEPEST} loops around it")
        values = range(first, last + 1, step)
        if not 0 < len(values) <= MOST_ROUNDS:
            raise line.error(f"1 to {MOST_ROUNDS} rounds")
        body = self.statements((*inside, loop[1]), line)
        if not body:
            raise line.error("statements in a loop")
        return Loop(line, loop[1], values, body)
