"""Lines and statements of a text, and errors that say at which of them something else stands."""

import re
from collections.abc import Mapping
from typing import NamedTuple

from cellplan.errors import InputError


class Statement(NamedTuple):
    """A statement of a program."""

    file: str
    line: int  # its line, from 1
    text: str  # what it says; never empty
    kind: str = ""  # which pattern of its language it follows
    words: tuple[str | None, ...] = ()  # what that pattern found

    def error(self, expected: str, got: str | None = None) -> InputError:
        """The error that something else is expected here."""
        return line_error(self.file, self.line, expected, self.text if got is None else got)

    def read_by(self, patterns: Mapping[str, re.Pattern[str]]) -> "Statement":
        """The same with its kind and words.

        Raises:
            InputError: It follows none of the patterns.
        """
        for kind, pattern in patterns.items():
            if match := pattern.fullmatch(self.text):
                return self._replace(kind=kind, words=match.groups())
        raise self.error("a statement that these programs have")


def split_lines(text: str, file: str) -> list[str]:
    """Lines without their ends, which are all like the first one; what follows the last one comes last.

    Raises:
        InputError: With file and line, where a line ends otherwise.
    """
    parts = text.split("\n")
    crossed = [part.endswith("\r") for part in parts[:-1]]
    for number, (part, is_crossed) in enumerate(zip(parts[:-1], crossed, strict=True), start=1):
        if is_crossed != crossed[0] or "\r" in part.removesuffix("\r"):
            raise InputError(f"{file}:{number}: expected one kind of line end, got two")
    if "\r" in parts[-1]:
        raise InputError(f"{file}:{len(parts)}: expected one kind of line end, got two")
    return [*(part.removesuffix("\r") for part in parts[:-1]), parts[-1]]


def line_error(file: str, line: int, expected: str, got: str) -> InputError:
    """The error that a line of a file holds something else.

    Args:
        got: What stands there, of which the first characters are shown.
    """
    return mismatch_error(file, line, expected, repr(got[:60]))


def mismatch_error(file: str, line: int, expected: str, actual: str) -> InputError:
    """The error that something else was found at a line of a file.

    Args:
        actual: What is there, in words.
    """
    return InputError(f"{file}:{line}: expected {expected}, got {actual}")


def truncated_error(file: str, line: int, expected: str) -> InputError:
    """The error that a file ends too early."""
    return mismatch_error(file, line, expected, "the end of the file; it is truncated")


def lines_of(text: str, file: str) -> list[str]:
    """Lines of a text of printable ASCII characters whose last line is ended, with one kind of line end.

    Raises:
        InputError: With file and line, when it is no such text.
    """
    if not text.endswith("\n"):
        raise truncated_error(file, 1 + text.count("\n"), "an ended last line")
    end = "\r\n" if text.endswith("\r\n") else "\n"
    lines = text.split(end)[:-1]
    for number, line in enumerate(lines, start=1):
        if not (line.isascii() and line.replace("\t", " ").isprintable()):
            raise line_error(file, number, "printable ASCII characters and one kind of line end", line)
    return lines
