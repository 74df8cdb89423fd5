"""Statements of URScript files: one on each line, and the routines that a program calls in order."""

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from cellplan.errors import InputError
from cellplan.programs.elements.text import line_error, lines_of, truncated_error
from cellplan.programs.formats.urscript.text import page_name

MOVES: Final = ("movej", "servoj")  # instructions of rows
_GAP: Final = re.compile(r"\s*([()\[\],=:])\s*")


class UrscriptStatement(NamedTuple):
    """One instruction: its line, from 1, its text without comment and spare spaces, and the line as it stands."""

    line: int
    text: str
    shown: str


class Statements:
    """Instructions of a file, taken one after the other."""

    def __init__(self, text: str, file: str) -> None:
        """Find all instructions."""
        self.file, self.place = file, 0
        lines = lines_of(text, file)
        self.all = [
            UrscriptStatement(number, plain, content)
            for number, line in enumerate(lines, start=1)
            if (content := line.partition("#")[0].strip()) and (plain := compact(content))
        ]
        self.last = len(lines)

    def call_routines(self, most: int) -> None:
        """Put the instructions of routines, of at most so many rows, where the program calls them in order."""
        inside, called = list[UrscriptStatement](), list[str]()
        while self.peek().text.startswith("def "):
            called.append(page_name(len(called) + 1))
            self.take(f"def {called[-1]}():")
            inside += self._routine(most)
        if not called:
            self._require_length([statement for statement in self.all if statement.text.startswith(MOVES)], most)
            return
        start = self.place
        while self.peek().text != f"{called[0]}()":
            self.place += 1
        begin = self.all[start : self.place]
        for name in called:
            self.take(f"{name}()")
        if moves := [statement for statement in begin if statement.text.startswith(MOVES)]:
            raise line_error(self.file, moves[0].line, f"{called[0]}()", moves[0].shown)
        self.all, self.place = [*begin, *inside, *self.all[self.place :]], 0

    def _routine(self, most: int) -> list[UrscriptStatement]:
        """The instructions of a routine up to its end."""
        statements, depth = list[UrscriptStatement](), 1
        while depth:
            at = self.peek()
            depth += at.text.startswith("while ") - (at.text == "end")
            statements.append(at)
            self.place += 1
        self._require_length([statement for statement in statements if statement.text.startswith(MOVES)], most)
        return statements[:-1]

    def _require_length(self, moves: Sequence[UrscriptStatement], most: int) -> None:
        """Refuse more rows than a routine holds."""
        if len(moves) > most:
            line = moves[most].line
            raise InputError(f"{self.file}:{line}: expected {most} rows at most in a routine, got {len(moves)}")

    def peek(self) -> UrscriptStatement:
        """The next instruction; ``InputError`` where there is none."""
        if self.place == len(self.all):
            raise truncated_error(self.file, self.last, "an instruction")
        return self.all[self.place]

    def take(self, expected: str) -> None:
        """Go past an instruction that has to be a given one."""
        statement = self.peek()
        if statement.text != compact(expected):
            raise line_error(self.file, statement.line, expected.strip(), statement.shown)
        self.place += 1

    def end(self) -> None:
        """Make sure that nothing follows."""
        if self.place < len(self.all):
            statement = self.all[self.place]
            raise line_error(self.file, statement.line, "the end of the file", statement.shown)


def compact(text: str) -> str:
    """An instruction with single spaces between words, and none beside brackets and signs."""
    return _GAP.sub(r"\1", " ".join(text.split()))
