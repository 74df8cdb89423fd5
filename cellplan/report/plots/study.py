"""Plots of a study: key figures over the first varied number, one curve for each combination of the other values."""

import math
from collections.abc import Iterator, Mapping
from typing import Final

import numpy as np

from cellplan.report.plots.figure import Axis, Curve, Figure, Item, Limit, Mark, Panel, value_axis
from cellplan.report.plots.palette import LIMIT, ROBOTS
from cellplan.report.record.common import Entries, Record

SHOWN: Final[Mapping[str, tuple[str, float, float | None]]] = {
    "max_velocity_ratio": ("highest joint velocity, in % of its limit", 100.0, 100.0),
    "max_acceleration_ratio": ("highest joint acceleration, in % of its limit", 100.0, 100.0),
    "min_margin_deg": ("smallest joint margin, in deg", 1.0, None),
    "min_clearance_mm": ("smallest certified clearance, in mm", 1.0, None),
}  # title, scale and limit of each figure
MAX_CURVES: Final = len(ROBOTS)


def study_figures(record: Record) -> dict[str, Figure]:
    """The figure of a study; none where no number is varied or nothing was solved.

    Args:
        record: As ``study_record`` returns it.
    """
    address = varied_number(record)
    curves = dict(_curves(record, address)) if address else {}
    x = [float(trial["values"][address]) for trials in curves.values() for trial in trials]
    if address is None or not x or len(curves) > MAX_CURVES or min(x) == max(x):
        return {}
    solved = [trial["figures"] for trials in curves.values() for trial in trials]
    shown = [name for name in SHOWN if any(figures[name] is not None for figures in solved)]
    figure = Figure(
        title=f"{record['cell']}: key figures over {address}; failed variants in red",
        x=Axis(low=min(x), high=max(x), label=address),
        panels=[_panel(name, curves, address) for name in shown],
        columns=2,
    )
    return {"study": figure}


def _panel(name: str, curves: Mapping[str, Entries], address: str) -> Panel:
    """One key figure: a curve for each combination of the other values, a dot for each variant, red if it failed."""
    label, scale, limit = SHOWN[name]
    known = {
        others: [each for each in trials if each["figures"][name] is not None] for others, trials in curves.items()
    }
    found = [scale * trial["figures"][name] for trials in known.values() for trial in trials]
    items: list[Item] = [Limit(limit)] if limit is not None and min(found) < limit else []
    for colour, (others, trials) in zip(ROBOTS, known.items(), strict=False):
        at = [float(trial["values"][address]) for trial in trials]
        values = [scale * trial["figures"][name] for trial in trials]
        items.append(Curve(others, np.array(at), np.array(values), colour))
        pens = [colour if trial["status"] == "passed" else LIMIT for trial in trials]
        items += [Mark(*point) for point in zip(at, values, pens, strict=True)]
    return Panel(title=label, y=value_axis(min(found), max(*found, limit or max(found))), items=items)


def varied_number(record: Record) -> str | None:
    """Address of the first varied key whose values are all numbers; None if there is none."""
    for address, values in record["vary"].items():
        if len(values) > 1 and all(_is_number(value) for value in values):
            return str(address)
    return None


def curve_legend(record: Record) -> list[tuple[str, str]]:
    """Colour and values of each curve; empty if there is only one."""
    curves = dict(_curves(record, varied_number(record)))
    return list(zip(ROBOTS, curves, strict=False)) if 1 < len(curves) <= MAX_CURVES else []


def _curves(record: Record, address: str | None) -> Iterator[tuple[str, Entries]]:
    """Trials with a motion, by the values of all keys but one, in the order of that key."""
    curves: dict[str, Entries] = {}
    for trial in record["trials"]:
        others = ", ".join(f"{key} = {value}" for key, value in trial["values"].items() if key != address)
        if trial["figures"]:
            curves.setdefault(others, []).append(trial)
    for others, trials in curves.items():
        yield others, sorted(trials, key=lambda trial: trial["values"][address]) if address else trials


def _is_number(value: object) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
