"""Findings about a file: where, what, got, allowed, in the order of the file."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Final

from cellplan.errors import InputError, InvalidFileError

FINDING_LIMIT: Final = 100  # of a file; more are counted only
SHOWN_LENGTH: Final = 40  # characters of a wrong text that are repeated in a message
LISTED_LIMIT: Final = 60  # words of a list in a message; more than any robot's joints
SHORTEST_GUESS: Final = 3  # characters; for shorter words every other one is near

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that is wrong in a file."""

    line: int  # line from 1; 0 when the finding is about the whole file or about a value that is not in the file
    key: str  # key path as the user would write it; empty for the whole file
    text: str  # what is wrong, what was found and what is allowed
    changes: str = ""  # what was changed of the file before it was read: ``motion.duration_s = 2.5``; empty for nothing

    def to_error(self, file: str) -> InputError:
        """The finding as one line: ``file:line: key: text``."""
        where = f"{file}:{self.line}" if self.line else file
        where += f" with {self.changes}" if self.changes else ""
        return InputError(": ".join(part for part in (where, self.key, self.text) if part))


def raise_findings(file: str, findings: Iterable[Finding], others: Sequence[InputError] = ()) -> None:
    """Raise all findings about a file at once, equal ones as one, by line, then those about the files it names."""
    ordered = _equal_ones_joined(sorted(dict.fromkeys(findings), key=lambda finding: finding.line))
    errors = [finding.to_error(file) for finding in ordered[:FINDING_LIMIT]]
    if len(ordered) > FINDING_LIMIT:
        errors.append(InputError(f"{file}: and more than {len(ordered) - FINDING_LIMIT - 1} other findings"))
    for other in others:
        errors.extend(other.findings if isinstance(other, InvalidFileError) else [other])
    if errors:
        raise InvalidFileError(errors)


def kind_of(finding: Finding) -> tuple[str, ...]:
    """What equal findings have in common: all but the line and the places in lists."""
    return re.sub(r"\[\d+\]", "[]", finding.key), finding.text, finding.changes


def _equal_ones_joined(ordered: Sequence[Finding]) -> list[Finding]:
    """The first finding of each kind, with the number of those like it and the line of the last one."""
    kinds: dict[tuple[str, ...], list[Finding]] = {}
    for finding in ordered:
        kinds.setdefault(kind_of(finding), []).append(finding)
    return [
        replace(equal[0], text=f"{equal[0].text} ({len(equal)} times, the last in line {equal[-1].line})")
        if len(equal) > 1
        else equal[0]
        for equal in kinds.values()
    ]


def key_text(path: KeyPath) -> str:
    """Key path as text: ``robots.kuka.start_deg[2]``."""
    text = ""
    for key in path:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            text += f".{key}" if text else key
    return text


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """``, did you mean 'base'?`` when a known word is near, else nothing."""
    if len(word) < SHORTEST_GUESS:
        return ""
    near = get_close_matches(word[:SHOWN_LENGTH], list(known), n=1, cutoff=0.6)
    return f", did you mean '{near[0]}'?" if near else ""


def unknown_name(what: str, name: object, known: Iterable[str]) -> str:
    """Text of a finding about a name that does not exist: ``expected a robot of this cell (kuka, abb), got 'kuke'``."""
    known = tuple(known)
    return f"expected {what} ({listed(known)}), got {shown(name)}{did_you_mean(str(name), known)}"


def listed(words: Iterable[str]) -> str:
    """Label joined by commas, or ``none``; of very many only the first."""
    words = list(words)
    more = ", …" if len(words) > LISTED_LIMIT else ""
    return ", ".join(words[:LISTED_LIMIT]) + more or "none"


def shown_whole(value: object) -> str:
    """A value beside another of its kind: as ``shown`` has it, a list with all of its elements."""
    return f"[{', '.join(map(shown_whole, value))}]" if isinstance(value, tuple | list) else shown(value)


def shown(value: object) -> str:
    """A value found in a file as a message repeats it: short, on one line, plain characters only."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, tuple | list):
        return f"a list of {len(value)}"
    if isinstance(value, int | float):
        return repr(value).removesuffix(".0")
    text = str(value)
    short = text if len(text) <= SHOWN_LENGTH else text[: SHOWN_LENGTH - 1] + "…"
    return repr(short)
