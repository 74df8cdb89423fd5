"""Mismatches between a file and its format, as data, and their one rendering as text."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from cellplan.io.input.findings import KeyPath, did_you_mean, listed, shown
from cellplan.model.settings.entry import NAME_WORDS


class MismatchKind(StrEnum):
    """What is wrong with a value of a file."""

    UNKNOWN_KEY = "unknown key"
    MISSING = "missing"
    NAME = "name"  # of an entry
    TYPE = "type"
    CHOICE = "choice"  # none of the words that are allowed
    BOUND = "bound"  # of a number
    COUNT = "count"  # of entries
    RULE = "rule"  # between several keys; brings its own text


@dataclass(frozen=True, slots=True, kw_only=True)
class Mismatch:
    """A value that the format does not allow, as data; `mismatch_text` renders it."""

    kind: MismatchKind  # what is wrong
    path: KeyPath  # key path of the value
    expected: str = ""  # what may stand there, as a phrase; the whole text of a rule
    allowed: tuple[str, ...] = ()  # words or keys that may stand there
    at_least: float | None = None  # lower bound of a number or of a count; None without one
    at_most: float | None = None  # upper bound; None without one
    is_positive: bool = False  # whether the lower bound reads as "positive"
    unit: str = ""  # unit of a number, as in "of millimetres"; empty without one
    got: Any = None  # the value that was found

    @property
    def is_at_key(self) -> bool:
        """Whether the key is wrong rather than its value."""
        unexpected = self.kind is MismatchKind.RULE and self.expected.startswith("unexpected key")
        return (
            unexpected
            or self.kind is MismatchKind.UNKNOWN_KEY
            or (self.kind is MismatchKind.NAME and self.got is self.path[-1])
        )


def mismatch_text(mismatch: Mismatch) -> str:
    """A mismatch as text: what is expected, what was found, and the nearest allowed word."""
    if mismatch.kind is MismatchKind.RULE:
        return mismatch.expected
    if mismatch.kind is MismatchKind.MISSING:
        return f"missing, expected {mismatch.expected}"
    if mismatch.kind is MismatchKind.UNKNOWN_KEY:
        hint = did_you_mean(str(mismatch.path[-1]), mismatch.allowed)
        return f"unknown key{hint}; allowed: {listed(mismatch.allowed)}"
    counted = mismatch.kind is MismatchKind.COUNT and isinstance(mismatch.got, dict | tuple)
    got = str(len(mismatch.got)) if counted else shown(mismatch.got)
    is_word = mismatch.kind is MismatchKind.CHOICE and isinstance(mismatch.got, str)
    hint = did_you_mean(mismatch.got, mismatch.allowed) if is_word else ""
    return f"expected {_expected_text(mismatch)}, got {got}{hint}"


def _expected_text(mismatch: Mismatch) -> str:
    """The values allowed at the place of a mismatch, as a phrase."""
    if mismatch.kind is MismatchKind.NAME:
        return NAME_WORDS
    bound = mismatch.at_most if mismatch.at_least is None else mismatch.at_least
    side = "most" if mismatch.at_least is None else "least"
    if mismatch.kind is MismatchKind.COUNT:
        return f"at {side} {bound} {'entry' if bound == 1 else 'entries'}"
    if mismatch.kind is not MismatchKind.BOUND:
        return mismatch.expected
    number = f"number{mismatch.unit}"
    if mismatch.is_positive:
        return f"a positive {number}"
    return f"a finite {number}" if bound is None else f"a {number} of at {side} {shown(bound)}"
