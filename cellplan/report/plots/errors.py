"""Panels of an error over time: its length on a logarithmic scale below its tolerance, and its three components."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.plots.figure import Item, LegendKey, Limit, PlotAxis, PlotCurve, PlotMark, PlotPanel, value_axis
from cellplan.report.plots.palette import AXES, INK, LIMIT
from cellplan.report.record.numbers import small

MIN_IN_UNIT: Final = 0.5  # [-] of an error in its unit: a larger unit is not chosen below
DECADES: Final = 9  # [-] most below the upper end of a logarithmic scale
FAR_BELOW: Final = 1e-4  # [-] of the largest error: smaller ones need not be seen
NOISE: Final = 1e-3  # [-] of the tolerance
HEADROOM: Final = 3.0  # [-] times the largest value: upper end of a logarithmic scale


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorKind:
    """How an error is shown: its name, units from large to small as (name, factor from SI), and axis names."""

    name: str
    units: tuple[tuple[str, float], ...]
    axes: tuple[str, str, str]


POSITION: Final = ErrorKind(name="position error", units=(("mm", 1e3), ("µm", 1e6), ("nm", 1e9)), axes=("x", "y", "z"))
ORIENTATION: Final = ErrorKind(
    name="orientation error",
    units=(("deg", math.degrees(1.0)), ("10⁻³ deg", math.degrees(1e3)), ("10⁻⁶ deg", math.degrees(1e6))),
    axes=("rx", "ry", "rz"),
)


def error_panels(times: Array, error: Array, *, allowed: float, kind: ErrorKind) -> list[PlotPanel]:
    """The length of an error with its tolerance, and the error by axis.

    Args:
        times: Times of the samples in [s], shape (N,).
        error: In SI units, shape (N, 3).
        allowed: Its tolerance in SI units.
    """
    total = np.linalg.norm(error, axis=1)
    unit, scale = kind.units[0]
    worst = int(total.argmax())
    largest = float(total[worst])
    items: list[Item] = [Limit(scale * allowed, f"tolerance {scale * allowed:.6g} {unit}")]
    items.append(PlotCurve(kind.name, times, scale * total))
    colour = LIMIT if largest > allowed else INK
    items.append(PlotMark(float(times[worst]), scale * largest, colour))
    length = PlotPanel(
        title=f"{kind.name}, total, in {unit}",
        note=_largest_text(largest, allowed, scale, float(times[worst])),
        y=error_axis([scale * total], scale * allowed, unit=unit),
        items=items,
    )
    return [length, _by_axis(times, error, kind)]


def _largest_text(largest: float, allowed: float, scale: float, at_s: float) -> str:
    """The largest error and its time, unless it is small enough to be rounding, which no two processors share."""
    if largest < NOISE * allowed:
        return "below a thousandth of the tolerance"
    return f"largest {small(scale * largest)} at {at_s:.3f} s"


def _by_axis(times: Array, error: Array, kind: ErrorKind) -> PlotPanel:
    """The three components; ripples below the smallest unit are not blown up to fill the picture."""
    largest = float(np.abs(error).max())
    unit, scale = readable_unit(largest, kind.units)
    reach = max(scale * largest, 1.0 if scale * largest < MIN_IN_UNIT else 0.0)
    named = list(zip(kind.axes, AXES, strict=True))
    return PlotPanel(
        title=f"{kind.name} by axis, in {unit}",
        keys=[LegendKey(axis, colour) for axis, colour in named],
        y=value_axis(-reach, reach, unit=unit),
        items=[PlotCurve(axis, times, scale * error[:, i], colour, 1.1) for i, (axis, colour) in enumerate(named)],
    )


def error_axis(curves: Sequence[Array], allowed: float, *, unit: str) -> PlotAxis:
    """A logarithmic axis that shows errors and their tolerance.

    It reaches from the decade of the smallest errors, or from four decades below the largest, to above both.

    Args:
        curves: Errors, not negative, shape (K,) each.
    """
    largest = max(float(curve.max()) for curve in curves)
    positive = [float(curve[curve > 0.0].min()) for curve in curves if curve.max() > 0.0]
    top = max(allowed, largest) or 1.0
    smallest = max(min(positive), FAR_BELOW * largest) if positive else 1e-3 * top
    decade = math.floor(math.log10(min(smallest, 0.1 * top)))
    low = max(decade, math.floor(math.log10(top)) - DECADES)
    return PlotAxis(low=10.0**low, high=HEADROOM * top, unit=unit, is_log=True)


def readable_unit(largest: float, units: tuple[tuple[str, float], ...]) -> tuple[str, float]:
    """The largest unit in which the value is at least one half, or the smallest of all; the first one for zero."""
    return units[0] if largest == 0.0 else next((unit for unit in units if largest * unit[1] >= MIN_IN_UNIT), units[-1])
