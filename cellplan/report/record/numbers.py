"""Numbers as the page shows them."""

import math
from decimal import Decimal
from typing import Any, Final

from cellplan.model.units import rounded_down
from cellplan.report.record.common import Record

MIN_SHOWN: Final = 1e-6  # [mm] or [deg]
MIN_PLAIN: Final = 1e-4  # [-] of a manipulability: smaller ones are shown with a power of ten
ALL_DIGITS: Final = 1000.0  # from here on no digit before the point is rounded


def fixed(value: float | None, digits: int = 1) -> str:
    """The value with a number of decimals; a dash for None."""
    if value is None:
        return "–"
    text = f"{value:.{digits}f}"
    return f"{0.0:.{digits}f}" if float(text) == 0.0 else text.replace("-", "−")


def small(value: float | None) -> str:
    """The value with three significant digits, without an exponent; from 1000 on with all digits before the point."""
    if value is None:
        return "–"
    if value == 0.0:
        return "0"
    if abs(value) < MIN_SHOWN:
        return f"< {MIN_SHOWN:.6f}"
    text = f"{value:.0f}" if abs(value) >= ALL_DIGITS else f"{float(f'{value:.3g}'):.9f}".rstrip("0").rstrip(".")
    return text.replace("-", "−")


def stated(value: float | None) -> str:
    """A limit as it is stated: up to nine significant digits, without an exponent."""
    return "–" if value is None else _plain(value, 9)


def against(value: float | None, limit: float | None) -> str:
    """The value beside its limit: like ``small``, with more digits where these would hide which of them is larger."""
    if value is None or limit is None or value == limit or small(value) != small(limit):
        return small(value)
    is_above = value > limit
    for digits in range(3, 17):
        rounded = float(f"{value:.{digits}g}")
        if rounded != limit and (rounded > limit) is is_above:
            return _plain(value, digits)
    return _plain(value, 17)


def _plain(value: float, digits: int) -> str:
    """The value with a number of significant digits, without an exponent."""
    text = f"{Decimal(f'{value:.{digits}g}'):f}"
    return (text.rstrip("0").rstrip(".") if "." in text else text).replace("-", "−")


def power(value: float | None) -> str:
    """The value with three significant digits, small ones with a power of ten."""
    if value is None or value == 0.0 or abs(value) >= MIN_PLAIN:
        return small(value)
    digits, _, exponent = f"{value:.2e}".partition("e")
    return f"{digits} · 10^{int(exponent)}".replace("-", "−")


def seconds(value: float | None) -> str:
    """A duration to the millisecond, without zeros at its end."""
    text = fixed(value, 3)
    return text.rstrip("0").rstrip(".") if "." in text else text


def plain(text: str) -> str:
    """A number as a terminal shows it: signs in ASCII."""
    return text.replace("−", "-").replace("–", "-")


def floored(value: float | None) -> str:
    """The value with one decimal, rounded down."""
    return "–" if value is None else fixed(rounded_down(value), 1)


def percent(value: float | None, digits: int = 0) -> str:
    """A fraction as a percentage, with more digits if rounding would hide whether it exceeds 100 %."""
    if value is None:
        return "–"
    return f"{fixed(100.0 * value, 2 if value != 1.0 and abs(value - 1.0) < 0.01 else digits)} %"


def range_bar(joint: Record) -> dict[str, float] | None:
    """Limits and reached range of a joint on a bar from 0 to 100; None for an endless joint."""
    lower, upper = joint["lower"], joint["upper"]
    if lower is None or upper is None:
        return None
    left, right = min(lower, joint["min"]), max(upper, joint["max"])
    scale = 100.0 / ((right - left) or 1.0)
    places = {"lower": lower, "upper": upper, "min": joint["min"], "max": joint["max"]}
    return {name: round(scale * (value - left), 2) for name, value in places.items()}


def worst(joints: Record) -> dict[str, Any]:
    """The joint with the smallest margin as a fraction of its range, and the one closest to its speed limit.

    None stands for a robot without such a joint. A speed without a fraction is beyond all limits.
    """
    named = [{"name": name, **joint} for name, joint in joints.items()]
    bounded = [joint for joint in named if None not in (joint["margin"], joint["lower"], joint["upper"])]
    near = min(bounded, key=lambda joint: joint["margin"] / ((joint["upper"] - joint["lower"]) or 1.0), default=None)
    return {"near": near, "fast": max(named, key=_speed_share, default=None)}


def _speed_share(joint: Record) -> float:
    share = joint["velocity_ratio"]
    return math.inf if share is None else float(share)
