"""Code of VAL3 programs: its statements, refused with file and line where they are others."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.export.val3.xml import Val3Element

_NAME: Final = r"[A-Za-z]\w*"
_ITEM: Final = rf"({_NAME})(?:\s*\[\s*(\w+)\s*\])?"
_MOVE: Final = re.compile(rf"movej\s*\(\s*{_ITEM}\s*,\s*{_ITEM}\s*,\s*{_ITEM}\s*\)", re.ASCII)
_STAND: Final = re.compile(r"waitEndMove\s*\(\s*\)")
_RESET: Final = re.compile(r"resetMotion\s*\(\s*\)")
_WAIT: Final = re.compile(rf"wait\s*\(\s*({_NAME})(?:\s*\[\s*0\s*\])?\s*==\s*(true|false)\s*\)", re.ASCII)
_SET: Final = re.compile(rf"({_NAME})(?:\s*\[\s*0\s*\])?\s*=\s*(true|false)", re.ASCII)
_CALL: Final = re.compile(rf"call\s+({_NAME})\s*\(\s*\)", re.ASCII)
_FOR: Final = re.compile(rf"for\s+({_NAME})\s*=\s*([0-9]+)\s+to\s+([0-9]+)(?:\s+step\s+([1-9][0-9]*))?", re.ASCII)
MOST_ROUNDS: Final = 1_000_000
DEEPEST: Final = 8  # loops in one another


@dataclass(frozen=True, slots=True, kw_only=True)
class Val3Statement:
    """A statement."""

    line: int  # its line in the file
    text: str  # what stands there


@dataclass(frozen=True, slots=True, kw_only=True)
class Val3Move(Val3Statement):
    """A motion of the joints."""

    names: tuple[str, str, str]  # data of the joints, of the tool and of the motion descriptor
    indices: tuple[int | str, int | str, int | str]  # which of their values: a number, or the name that a loop counts


@dataclass(frozen=True, slots=True, kw_only=True)
class StandStill(Val3Statement):
    """A wait until all motions have ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Reset(Val3Statement):
    """All motions that were not made yet are forgotten."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WaitFor(Val3Statement):
    """A wait for an input."""

    name: str  # its data
    is_on: bool  # the state


@dataclass(frozen=True, slots=True, kw_only=True)
class SetOutput(Val3Statement):
    """A change of an output."""

    name: str  # its data
    is_on: bool  # the state


@dataclass(frozen=True, slots=True, kw_only=True)
class Call(Val3Statement):
    """A call of another program."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop(Val3Statement):
    """Statements that are done again and again."""

    counter: str  # name of what counts
    values: range
    body: Sequence["Node"]  # the statements


Node = Val3Move | StandStill | Reset | WaitFor | SetOutput | Call | Loop


def read_code(code: Val3Element, counters: Collection[str]) -> tuple[list[Node], int]:
    """Statements of a program between ``begin`` and ``end``, and the line of its ``end``.

    Args:
        counters: Names of the numbers that loops may count with.

    Raises:
        InputError: With file and line, where a statement is none of those that such programs have.
    """
    lines = [
        (code.text_line + place, said)
        for place, line in enumerate(code.text.split("\n"))
        for said in [line.partition("//")[0].strip()]
        if said
    ]
    first, last = (lines[0], lines[-1]) if lines else ((code.line, ""), (code.line, ""))
    if first[1] != "begin" or len(lines) < 2 or last[1] != "end":
        (line, said), word = (first, "begin") if first[1] != "begin" else (last, "end")
        raise _error(code, line, word, said)
    reader = _CodeReader(code=code, lines=lines[1:-1][::-1], counters=counters)
    return reader.statements(()), last[0]


@dataclass(slots=True, kw_only=True)
class _CodeReader:
    """Reads statements line by line."""

    code: Val3Element
    lines: list[tuple[int, str]]  # numbers and texts of the lines that are left, the next one last
    counters: Collection[str]  # names of the numbers that loops may count with

    def statements(self, inside: tuple[str, ...]) -> list[Node]:
        """Statements up to the end of the loop, or of the program.

        Args:
            inside: What the loops around them count with.
        """
        nodes = list[Node]()
        while self.lines:
            line, said = self.lines.pop()
            if said == "endFor" and inside:
                return nodes
            loop = _FOR.fullmatch(said)
            if loop:
                nodes.append(self._loop(line, loop, inside))
            else:
                nodes.append(self._simple(line, said))
        if inside:
            raise _error(self.code, line, "endFor", said)
        return nodes

    def _loop(self, line: int, loop: re.Match[str], inside: tuple[str, ...]) -> Loop:
        """A loop and what is in it."""
        first, last, step = int(loop[2]), int(loop[3]), int(loop[4] or 1)
        if loop[1] not in self.counters or loop[1] in inside or len(inside) == DEEPEST:
            expected = f"a number that is declared and counts none of at most {DEEPEST} loops around it"
            raise _error(self.code, line, expected, loop[0])
        values = range(first, last + 1, step)
        if not 0 < len(values) <= MOST_ROUNDS:
            raise _error(self.code, line, f"1 to {MOST_ROUNDS} rounds", loop[0])
        body = self.statements((*inside, loop[1]))
        if not body:
            raise _error(self.code, line, "statements in a loop", loop[0])
        return Loop(line=line, text=loop[0], counter=loop[1], values=values, body=body)

    def _simple(self, line: int, said: str) -> Node:
        """Any statement but a loop."""
        if match := _MOVE.fullmatch(said):
            names, indices = (match[1], match[3], match[5]), (_index(match[2]), _index(match[4]), _index(match[6]))
            return Val3Move(line=line, text=said, names=names, indices=indices)
        if _STAND.fullmatch(said):
            return StandStill(line=line, text=said)
        if _RESET.fullmatch(said):
            return Reset(line=line, text=said)
        if match := _WAIT.fullmatch(said):
            return WaitFor(line=line, text=said, name=match[1], is_on=match[2] == "true")
        if match := _SET.fullmatch(said):
            return SetOutput(line=line, text=said, name=match[1], is_on=match[2] == "true")
        if match := _CALL.fullmatch(said):
            return Call(line=line, text=said, name=match[1])
        raise _error(self.code, line, "a statement that these programs have", said)


def _index(said: str | None) -> int | str:
    """An index: a number, or a name; the first value without one."""
    if said is None:
        return 0
    return int(said) if said.isdecimal() else said


def _error(code: Val3Element, line: int, expected: str, got: str) -> InputError:
    """One located line."""
    return InputError(f"{code.file}:{line}: expected {expected}, got {got[:60]!r}")
