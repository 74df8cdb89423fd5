"""Whether two figures, or two texts with figures in them, say the same up to the noise of the arithmetic."""

import math
import re
from typing import Any, Final

RELATIVE: Final = 1e-6  # [-] figures have seven digits at least
NOISE: Final = 1e-7  # [-] in printed units; below it stands the noise of the arithmetic
NUMBER: Final = re.compile(r"((?<![\w.])[-−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]))")  # not a part of a name


def is_same(got: Any, expected: Any, *, noise: float = NOISE) -> bool:
    """Whether two single values are the same up to rounding; a number is never the same as a word.

    A whole number is a count: it is the same or another one.

    Args:
        noise: Difference of numbers in their printed unit below which stands the noise of the arithmetic.
    """
    are_numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (got, expected))
    if are_numbers and isinstance(expected, int):
        return bool(got == expected)
    if are_numbers:
        return math.isclose(got, expected, rel_tol=RELATIVE, abs_tol=noise)
    if isinstance(got, str) and isinstance(expected, str):
        return first_difference(got, expected) is None
    return type(got) is type(expected) and bool(got == expected)


def first_difference(got: str, expected: str) -> tuple[int, str, str] | None:
    """Place in the first text, and the piece of each, at which two texts say something else; None when nowhere."""
    if got == expected:
        return None
    place = 0
    pieces, others = NUMBER.split(got), NUMBER.split(expected)
    for index, (piece, other) in enumerate(zip(pieces, others, strict=False)):
        is_number = index % 2 == 1
        if piece != other and not (is_number and is_same(_number(piece), _number(other))):
            same = 0 if is_number else len(_common_start(piece, other))
            return place + same, piece[same:], other[same:]
        place += len(piece)
    return (
        None if len(pieces) == len(others) else (place, "".join(pieces[len(others) :]), "".join(others[len(pieces) :]))
    )


def _number(text: str) -> float:
    """A number as it is printed, with a hyphen or the sign for minus."""
    return float(text.replace("−", "-"))


def _common_start(one: str, other: str) -> str:
    """What two texts begin with in common."""
    length = next((k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))
    return one[:length]
