"""Text that every controller reads: plain decimals, safe names, printable ASCII."""

import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from functools import lru_cache
from typing import Final, NamedTuple, NoReturn

from cellplan.errors import InputError

MADE_OF: Final = {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}  # as they are spelled
NONE: Final = r"(?!)"  # the pattern of no name
LINE: Final = 78  # characters of a comment; the shortest limit of all dialects is above 80


def fixed(value: float, decimals: int) -> str:
    """A number with fixed decimals: no exponent, no ``-0.000``, a point whatever the locale."""
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def ascii_text(text: str) -> str:
    """Printable ASCII nearest to a text: letters without accents, everything else unknown as a question mark."""
    spelled = "".join(MADE_OF.get(letter, letter) for letter in unicodedata.normalize("NFC", text))
    plain = unicodedata.normalize("NFKD", spelled)
    letters = (letter for letter in plain if not unicodedata.combining(letter))
    return "".join(letter if " " <= letter <= "~" else "?" for letter in letters)


def comment(note: str, sign: str, *, forbidden: str = "", longest: int = LINE) -> list[str]:
    """Comment lines of a note behind a sign such as ``;``; forbidden characters become question marks."""
    words = [re.sub(f"[{re.escape(forbidden)}]", "?", word) if forbidden else word for word in ascii_text(note).split()]
    lines = [""]
    for part in (word[first : first + longest] for word in words for first in range(0, len(word), longest)):
        if lines[-1] and len(lines[-1]) + 1 + len(part) > longest:
            lines.append("")
        lines[-1] = f"{lines[-1]} {part}".strip()
    return [f"{sign} {line}".rstrip() for line in lines]


def safe_names(
    names: Iterable[str], *, longest: int, reserved: Collection[str] = (), data: str = NONE
) -> dict[str, str]:
    """Names that a controller takes, by the name in the cell: letters, digits and underscores, unique without case.

    The order of the names decides. Reserved are words of the language, in any case, and names of other data, which
    follow a pattern.
    """
    words, taken, chosen = _lower_case(frozenset(reserved)), set[str](), dict[str, str]()
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", ascii_text(name)).strip("_") or "x"
        is_free = plain[0].isalpha() and not re.fullmatch(data, plain, re.IGNORECASE)
        plain = plain if is_free else f"p_{plain}"
        safe_name, number = plain[:longest], 1
        while safe_name.lower() in taken or safe_name.lower() in words:
            number += 1
            ending = f"_{number}"
            safe_name = plain[: longest - len(ending)] + ending
        taken.add(safe_name.lower())
        chosen[name] = safe_name
    return chosen


def point_stems(
    routines: Mapping[str, str], *, longest: int, others: Collection[str] = (), data: str = NONE
) -> dict[str, str]:
    """What names of points, ``STEM_1``, ``STEM_2`` and so on, begin with, by the task of a routine.

    That is the name of the routine, or one with a ``p`` behind it where a point would have the name of a routine, of
    something else, or of other data, which follow a pattern.
    """
    names, stems = (*routines.values(), *others), dict[str, str]()
    for task, routine in routines.items():
        for letters in range(longest):
            stem = f"{routine[: longest - letters - 1]}_{'p' * letters}" if letters else routine
            is_other = any(re.fullmatch(rf"{stem}_\d+", name, re.IGNORECASE) for name in names)
            if not (is_other or re.fullmatch(data, f"{stem}_1", re.IGNORECASE) or stem in stems.values()):
                break
        stems[task] = stem
    return stems


@lru_cache(maxsize=8)
def _lower_case(words: frozenset[str]) -> frozenset[str]:
    """Words of a language, of which RAPID has twenty thousand, in small letters."""
    return frozenset(word.lower() for word in words)


def joined(lines: Iterable[str], *, line_end: str = "\n") -> str:
    """Lines as a text whose last line is ended too."""
    return "".join(line + line_end for line in lines)


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

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise the error that something else is expected here."""
        raise self.error(expected, got)

    def read_by(self, patterns: Mapping[str, re.Pattern[str]]) -> "Statement":
        """The same with its kind and words, by the one of the patterns that it follows."""
        for kind, pattern in patterns.items():
            if match := pattern.fullmatch(self.text):
                return self._replace(kind=kind, words=match.groups())
        raise self.error("a statement that these programs have")


def split_lines(text: str, file: str) -> list[str]:
    """Lines without their ends, which must all be like the first one; what follows the last one comes last."""
    parts = text.split("\n")
    crossed = [part.endswith("\r") for part in parts[:-1]]
    for number, (part, is_crossed) in enumerate(zip(parts[:-1], crossed, strict=True), start=1):
        if is_crossed != crossed[0] or "\r" in part.removesuffix("\r"):
            raise InputError(f"{file}:{number}: expected one kind of line end, got two")
    if "\r" in parts[-1]:
        raise InputError(f"{file}:{len(parts)}: expected one kind of line end, got two")
    return [*(part.removesuffix("\r") for part in parts[:-1]), parts[-1]]


def line_error(file: str, line: int, expected: str, got: str) -> InputError:
    """The error that a line of a file holds something else; of what it holds the first characters are shown."""
    return mismatch_error(file, line, expected, repr(got[:60]))


def mismatch_error(file: str, line: int, expected: str, actual: str) -> InputError:
    """The error that something else was found at a line of a file; ``actual`` names it in words."""
    return InputError(f"{file}:{line}: expected {expected}, got {actual}")


def truncated_error(file: str, line: int, expected: str) -> InputError:
    """The error that a file ends too early."""
    return mismatch_error(file, line, expected, "the end of the file; it is truncated")


def lines_of(text: str, file: str) -> list[str]:
    """Lines of a text of printable ASCII characters whose last line is ended, with one kind of line end."""
    if not text.endswith("\n"):
        raise truncated_error(file, 1 + text.count("\n"), "an ended last line")
    end = "\r\n" if text.endswith("\r\n") else "\n"
    lines = text.split(end)[:-1]
    for number, line in enumerate(lines, start=1):
        if not (line.isascii() and line.replace("\t", " ").isprintable()):
            raise line_error(file, number, "printable ASCII characters and one kind of line end", line)
    return lines
