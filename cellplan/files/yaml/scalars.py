"""What an unquoted word of a file means: a number, true, false or a text; what could mean two things is refused."""

import math
import re
from typing import Final

NUMBER: Final = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
WHOLE_NUMBER: Final = re.compile(r"[-+]?[0-9]+")
LEADING_ZERO: Final = re.compile(r"[-+]?0[0-9]")
GROUPED: Final = re.compile(r"[-+]?[0-9][0-9_]*_[0-9_]*(?:\.[0-9_]*)?(?:[eE][-+]?[0-9]+)?")
OTHER_BASE: Final = re.compile(r"[-+]?0(?:[xX][0-9a-fA-F_]+|[oO][0-7_]+|[bB][01_]+)")
SEXAGESIMAL: Final = re.compile(r"[-+]?[0-9][0-9_]*(?::[0-9]{1,2})+(?:\.[0-9_]*)?")
DATE: Final = re.compile(r"[0-9]{4}-[0-9]{1,2}-[0-9]{1,2}(?:[Tt ].*)?")
NOT_FINITE: Final = re.compile(r"[-+]?\.?(?:nan|inf|infinity)", re.IGNORECASE)
OLD_TRUTH_WORDS: Final = frozenset({"yes", "no", "on", "off", "true", "false"})
NOTHING: Final = frozenset({"", "~", "null"})
WHOLE_DIGITS: Final = 30  # a longer whole number is read as a floating-point one; nothing in a cell counts so far


class SurpriseError(ValueError):
    """A word that YAML readers understand in different ways."""


def plain_value(text: str) -> str | int | float | bool:
    """Value of an unquoted scalar; ``SurpriseError`` where empty, not finite, or other in YAML 1.1 than in 1.2."""
    if text in {"true", "false"}:
        return text == "true"
    if text.lower() in NOTHING:
        raise SurpriseError("expected a value, got nothing; leave the key out to use its default")
    if text.lower() in OLD_TRUTH_WORDS:
        raise SurpriseError(f"'{text}' can be read as a truth value; write true or false, or put it in quotes")
    return text if not text[0].isdigit() and text[0] not in "+-.nNiI" else _number_or_text(text)


def _number_or_text(text: str) -> str | int | float:
    """Number, or a text that cannot be taken for one."""
    if NUMBER.fullmatch(text):
        return _number(text)
    if NOT_FINITE.fullmatch(text):
        raise SurpriseError(f"expected a finite number, got {text}")
    if OTHER_BASE.fullmatch(text):
        raise SurpriseError(f"expected a decimal number, got {_short(text)}; write it in tens or put it in quotes")
    if GROUPED.fullmatch(text):
        raise SurpriseError(f"expected digits without '_', got {_short(text)}")
    if SEXAGESIMAL.fullmatch(text):
        raise SurpriseError(
            f"'{_short(text)}' can be read as a number to base 60; write a decimal number or put it in quotes"
        )
    if DATE.fullmatch(text):
        raise SurpriseError(f"'{_short(text)}' can be read as a date; put it in quotes")
    return text


def _number(text: str) -> int | float:
    """Finite number that cannot be read as an octal one."""
    if LEADING_ZERO.match(text):
        raise SurpriseError(f"expected a number without leading zeros, got {_short(text)}; it can be read as octal")
    if len(text) <= WHOLE_DIGITS and WHOLE_NUMBER.fullmatch(text):
        return int(text)
    value = float(text)
    if not math.isfinite(value):
        raise SurpriseError(f"expected a finite number, got {_short(text)}")
    if value == 0.0 and text.lower().partition("e")[0].strip("+-0."):
        raise SurpriseError(f"expected a number that can be distinguished from zero, got {_short(text)}")
    return value


def _short(text: str) -> str:
    """A number's text as messages repeat it."""
    return text if len(text) <= 40 else text[:39] + "…"
