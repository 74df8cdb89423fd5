"""Whether a report on disk says what was found when its tables were computed again."""

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from cellplan.report.record.phases import AT, PHASE
from cellplan.runs.gate.equal_text import NOISE, is_same

Record = Mapping[str, Any]

TEXT_KEYS: Final = frozenset({"message", "pair", "axis", "joint", "sliding_joint", "busiest_joint"})
NOISE_BY_ENDING: Final[Mapping[str, float]] = {  # in printed units: differences over short times enlarge the noise
    "acceleration": 1e-5,
    "acceleration_m_s2": 1e-5,
    "jerk": 1e-2,
    "jerk_m_s3": 1e-2,
}
COMPARED_ELSEWHERE: Final = frozenset({"inputs", "versions", "digests"})
PLANNER_KEYS: Final = ("iterations", "slack", "resolution", "transfers", "moved_starts")  # of ``solver``: not in tables
PLANNER_SERIES: Final = ("iterations", "slack")  # of the series, likewise
KNOWN_TO_THE_PLANNER: Final = frozenset(
    {*(("solver", key) for key in PLANNER_KEYS), *((key,) for key in PLANNER_SERIES)}
)


def differences(got: Record, expected: Record, *, same_program: bool) -> Iterator[tuple[str, Any, Any]]:
    """Key paths at which a report, or the series of a run, differs from the recomputed one, with both values.

    Numbers are equal when they agree to seven digits, texts when the numbers in them do.

    Args:
        got: The record on disk.
        expected: The record computed from the tables.
        same_program: Whether both were made by the same version of cellplan, so that they must have the same keys and
            the same texts; between versions only the numbers of common keys are compared.
    """
    yield from _compare(got, expected, (), same_program=same_program)


def misshapen_series(got: Record, steps: int) -> Iterator[tuple[str, Any, Any]]:
    """Series that only the planner knows and that are neither null nor one number for each step."""
    for key in PLANNER_SERIES:
        series = got.get(key)
        if series is None:
            continue
        is_whole = isinstance(series, list) and len(series) == steps
        if not is_whole or any(
            isinstance(value, bool) or not isinstance(value, int | float | None) for value in series
        ):
            yield key, series, f"a list of {steps} numbers or null"


def _compare(got: Any, expected: Any, path: tuple[str, ...], *, same_program: bool) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(expected, Mapping) and isinstance(got, Mapping):
        keys = dict.fromkeys([*expected, *got]) if same_program else [key for key in expected if key in got]
        for key in keys:
            if _is_left_out(path, key) or (not same_program and _is_of_a_tie(key)):
                continue
            if key not in got or key not in expected:
                yield ".".join((*path, key)), got.get(key, "nothing"), expected.get(key, "nothing")
            else:
                yield from _compare(got[key], expected[key], (*path, key), same_program=same_program)
    elif isinstance(expected, np.ndarray):
        yield from _compare_series(got, expected, ".".join(path))
    elif isinstance(expected, list) and isinstance(got, list) and len(expected) == len(got):
        for index, (left, right) in enumerate(zip(got, expected, strict=True)):
            yield from _compare(left, right, (*path[:-1], f"{path[-1]}[{index}]"), same_program=same_program)
    elif not is_same(got, expected, noise=_noise(path)):
        yield ".".join(path), got, expected


def _is_left_out(path: tuple[str, ...], key: str) -> bool:
    """Whether a key is not compared here."""
    return (not path and key in COMPARED_ELSEWHERE) or (*path, key) in KNOWN_TO_THE_PLANNER


def _is_of_a_tie(key: str) -> bool:
    """Whether a key says when or where an extreme is: another version may choose another one of two that are alike."""
    return key.endswith((AT, PHASE)) or key in TEXT_KEYS


def _noise(path: tuple[str, ...]) -> float:
    """Noise of a figure in its printed unit, by the ending of its key."""
    key = path[-1] if path else ""
    return max((noise for ending, noise in NOISE_BY_ENDING.items() if key.endswith(ending)), default=NOISE)


def _compare_series(got: Any, expected: np.ndarray[Any, Any], key: str) -> Iterator[tuple[str, Any, Any]]:
    """The first value at which a list of numbers is not an array up to its digits; null is what is not finite."""
    if not isinstance(got, list) or len(got) != len(expected):
        yield key, got, f"a list of {len(expected)}"
        return
    values = [value if math.isfinite(value) else None for value in expected.tolist()]
    other = (i for i, pair in enumerate(zip(got, values, strict=True)) if not is_same(*pair))
    first = next(other, None)
    if first is not None:
        yield f"{key}[{first}]", got[first], values[first]
