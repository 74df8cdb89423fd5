"""Lengths, angles and times with their units, as options of the command line have them."""

import math
import re
from collections.abc import Mapping
from typing import Final

from cellplan.errors import InputError
from cellplan.files.input.findings import shown

QUANTITY: Final = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)\s*")
LENGTHS: Final[Mapping[str, float]] = {"mm": 1.0, "cm": 10.0, "m": 1000.0}  # [mm]
ANGLES: Final[Mapping[str, float]] = {"deg": 1.0, "rad": 180.0 / math.pi}  # [deg]
TIMES: Final[Mapping[str, float]] = {"s": 1.0, "min": 60.0, "h": 3600.0}  # [s]


def read_length(option: str, text: str) -> float:
    """A length in [mm] of a text such as ``10mm``; a plain number is in millimetres."""
    return _read(option, text, LENGTHS, "a length such as 10mm")


def read_angle(option: str, text: str) -> float:
    """An angle in [deg] of a text such as ``15deg``; a plain number is in degrees."""
    return _read(option, text, ANGLES, "an angle such as 15deg")


def read_misplacement(option: str, text: str) -> tuple[float, float]:
    """A length in [mm] and an angle in [deg] of a text such as ``10mm,1deg``."""
    length, comma, angle = text.partition(",")
    if not comma:
        raise InputError(f"{option}: expected a length and an angle such as 10mm,1deg, got {shown(text)}")
    misplacement = read_length(option, length), read_angle(option, angle)
    if not min(misplacement) > 0.0:
        raise InputError(f"{option}: expected a length and an angle above 0 such as 10mm,1deg, got {shown(text)}")
    return misplacement


def read_time(option: str, text: str) -> float:
    """A time in [s] of a text such as ``60s`` or ``10min``; a plain number is in seconds."""
    seconds = _read(option, text, TIMES, "a time such as 60s or 10min")
    if not seconds > 0.0:
        raise InputError(f"{option}: expected a time above 0 such as 60s or 10min, got {shown(text)}")
    return seconds


def _read(option: str, text: str, units: Mapping[str, float], expected: str) -> float:
    """A number of at least 0 in the first of the units."""
    match = QUANTITY.fullmatch(text)
    unit = match[2] or next(iter(units)) if match else ""
    value = float(match[1]) * units.get(unit, math.nan) if match else math.nan
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{option}: expected {expected} ({', '.join(units)}), got {shown(text)}")
    return value
