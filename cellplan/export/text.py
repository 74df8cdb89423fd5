"""Text that every controller reads: plain decimals, safe names, printable ASCII."""

import re
import unicodedata
from collections.abc import Collection, Iterable
from typing import Final

MADE_OF: Final = {"ä": "ae", "ö": "oe", "ü": "ue", "Ä": "Ae", "Ö": "Oe", "Ü": "Ue", "ß": "ss"}  # as they are spelled
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


def comment(note: str, sign: str, *, forbidden: str = "") -> list[str]:
    """Comment lines of a note, each with the sign of a comment before it.

    Args:
        sign: What begins a comment: ``;`` or ``!``.
        forbidden: Characters that may not stand in one, which become question marks.
    """
    words = [re.sub(f"[{re.escape(forbidden)}]", "?", word) if forbidden else word for word in ascii_text(note).split()]
    lines = [""]
    for word in words:
        if lines[-1] and len(lines[-1]) + 1 + len(word) > LINE:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return [f"{sign} {line[:LINE]}".rstrip() for line in lines]


def safe_names(names: Iterable[str], *, longest: int, reserved: Collection[str] = ()) -> dict[str, str]:
    """Names that a controller takes, by the name in the cell: letters, digits and underscores, unique without case.

    Args:
        names: Names in the cell, in their order: the same names always give the same result.
        reserved: Words of the language, in any case.
    """
    taken = {word.lower() for word in reserved}
    chosen: dict[str, str] = {}
    for name in names:
        plain = re.sub(r"[^A-Za-z0-9_]", "_", ascii_text(name)).strip("_") or "x"
        plain = plain if plain[0].isalpha() else f"p_{plain}"
        safe_name, number = plain[:longest], 1
        while safe_name.lower() in taken:
            number += 1
            ending = f"_{number}"
            safe_name = plain[: longest - len(ending)] + ending
        taken.add(safe_name.lower())
        chosen[name] = safe_name
    return chosen


def joined(lines: Iterable[str], *, line_end: str = "\n") -> str:
    """Lines as a text whose last line is ended too."""
    return "".join(line + line_end for line in lines)
