"""Whether a report on disk says what was found when its tables were computed again."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

Record = Mapping[str, Any]

RELATIVE: Final = 1e-6  # [-] figures have seven digits at least
ABSOLUTE: Final = 1e-7  # [-] in printed units; below it stands the noise of the arithmetic
ABSOLUTE_BY_ENDING: Final[Mapping[str, float]] = {  # differences of positions over short times enlarge that noise
    "acceleration": 1e-5,
    "acceleration_m_s2": 1e-5,
    "jerk": 1e-2,
    "jerk_m_s3": 1e-2,
}
COMPARED_ELSEWHERE: Final = frozenset({"inputs", "versions", "digests"})
KNOWN_TO_THE_PLANNER: Final = frozenset(  # what the planner's steps and nodes took cannot be seen in the tables
    {
        ("solver", "iterations"),
        ("solver", "slack"),
        ("solver", "resolution"),
        ("series", "iterations"),
        ("series", "slack"),
    }
)
INSTANT: Final = "at_s"  # ends the names of instants; of two extremes that are alike, the noise picks one
WORDS: Final = frozenset({"message", "pair", "axis", "joint", "sliding_joint", "busiest_joint"})  # likewise of words


def differences(said: Record, found: Record, *, same_program: bool) -> Iterator[tuple[str, Any, Any]]:
    """Key paths at which a report differs from what was found, with both values.

    Figures are the same when they agree to seven digits. Instants, and words that go with them, are not compared.

    Args:
        said: The report on disk.
        found: What was computed from the tables.
        same_program: Whether both were made by the same version of cellplan, so that they must have the same keys.
    """
    yield from _compare(said, found, (), same_program=same_program)


def _compare(said: Any, found: Any, path: tuple[str, ...], *, same_program: bool) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(found, Mapping) and isinstance(said, Mapping):
        keys = dict.fromkeys([*found, *said]) if same_program else [key for key in found if key in said]
        for key in keys:
            if _is_left_out(path, key):
                continue
            if key not in said or key not in found:
                yield ".".join((*path, key)), said.get(key, "nothing"), found.get(key, "nothing")
            else:
                yield from _compare(said[key], found[key], (*path, key), same_program=same_program)
    elif isinstance(found, np.ndarray):
        yield from _compare_series(said, found, ".".join(path))
    elif isinstance(found, list) and isinstance(said, list) and len(found) == len(said):
        for index, (left, right) in enumerate(zip(said, found, strict=True)):
            yield from _compare(left, right, (*path[:-1], f"{path[-1]}[{index}]"), same_program=same_program)
    elif not _is_same(said, found, room=_room(path)):
        yield ".".join(path), said, found


def _is_left_out(path: tuple[str, ...], key: str) -> bool:
    """Whether a key is not compared here."""
    if not path and key in COMPARED_ELSEWHERE:
        return True
    return (*path, key) in KNOWN_TO_THE_PLANNER or key.endswith(INSTANT) or key in WORDS


def _room(path: tuple[str, ...]) -> float:
    """Noise of a figure in its printed unit, by the ending of its key."""
    key = path[-1] if path else ""
    return max((room for ending, room in ABSOLUTE_BY_ENDING.items() if key.endswith(ending)), default=ABSOLUTE)


def _is_same(said: Any, found: Any, *, room: float = ABSOLUTE) -> bool:
    """Whether two single values are the same up to rounding; a number is never the same as a word."""
    are_numbers = all(isinstance(value, int | float) and not isinstance(value, bool) for value in (said, found))
    if are_numbers:
        return math.isclose(said, found, rel_tol=RELATIVE, abs_tol=room)
    return type(said) is type(found) and bool(said == found)


def _compare_series(said: Any, found: np.ndarray[Any, Any], key: str) -> Iterator[tuple[str, Any, Any]]:
    """The first value at which a list of numbers is not an array up to its digits; null is what is not finite."""
    if not isinstance(said, list) or len(said) != len(found):
        yield key, said, f"a list of {len(found)}"
        return
    expected = [value if math.isfinite(value) else None for value in found.tolist()]
    other = (i for i, pair in enumerate(zip(said, expected, strict=True)) if not _is_same(*pair))
    first = next(other, None)
    if first is not None:
        yield f"{key}[{first}]", said[first], expected[first]
