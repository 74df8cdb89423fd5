"""Variants of a cell: values at addresses of its file, every combination of several lists."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from itertools import product
from math import prod
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.changes import plain_values, read_setting
from cellplan.files.input.findings import shown
from cellplan.study.trial import Variant

MAX_VARIANTS: Final = 100_000  # more would take weeks
NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
RANGE: Final = re.compile(rf"({NUMBER}):({NUMBER}):({NUMBER})")
USAGE: Final = "KEY=FROM:TO:STEP or KEY=VALUE,VALUE,…, such as motion.duration_s=2:6:0.5"


@dataclass(frozen=True, slots=True)
class Axis:
    """Values that one key of a cell file takes in turn.

    Attributes:
        address: Address of the key, such as ``motion.duration_s``.
        values: The values, as they are read from a cell file.
    """

    address: str
    values: tuple[object, ...]


def read_axis(text: str) -> Axis:
    """The axis of ``KEY=FROM:TO:STEP``, both ends included, or of ``KEY=VALUE,VALUE,…``."""
    address, sign, values = (part.strip() for part in text.partition("="))
    if not sign or not address or not values:
        raise InputError(f"--vary: expected {USAGE}, got {shown(text)}")
    numbers = RANGE.fullmatch(values)
    if numbers is not None:
        return Axis(address, _range(text, *map(Decimal, numbers.groups())))
    _, read = read_setting(f"{address}=[{values}]")
    listed = tuple(read) if isinstance(read, tuple | list) else (read,)
    if len({repr(value) for value in listed}) < len(listed):
        raise InputError(f"--vary {address}: expected every value once, got {shown(values)}")
    return Axis(address, listed)


def combinations(axes: Sequence[Axis]) -> tuple[Variant, ...]:
    """All combinations of the values of the axes, at least one, the last axis first to change; too many are refused."""
    if not axes:
        raise InputError(f"--vary: expected at least one key, {USAGE}")
    addresses = [axis.address for axis in axes]
    for address in addresses:
        if addresses.count(address) > 1:
            raise InputError(f"--vary: expected every key once, got '{address}' again")
    count = prod(len(axis.values) for axis in axes)
    if count > MAX_VARIANTS:
        raise InputError(f"--vary: expected at most {MAX_VARIANTS} combinations, got {count}")
    rows = product(*(axis.values for axis in axes))
    return tuple(
        Variant(number, plain_values(dict(zip(addresses, row, strict=True)))) for number, row in enumerate(rows)
    )


def _range(text: str, first: Decimal, last: Decimal, step: Decimal) -> tuple[object, ...]:
    """Numbers from the first to the last one, exact in their decimals; whole numbers stay whole."""
    if step == 0 or (last - first) / step < 0:
        raise InputError(f"--vary: expected a step that leads from {first} to {last}, got {step} in {shown(text)}")
    count = (last - first) / step
    if count >= MAX_VARIANTS:
        raise InputError(f"--vary: expected at most {MAX_VARIANTS} values, got {count:.0f} in {shown(text)}")
    is_whole = all(value == value.to_integral_value() for value in (first, step))
    values = [first + k * step for k in range(int(count) + 1)]
    return tuple(int(value) if is_whole else float(value) for value in values)
