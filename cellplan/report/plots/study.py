"""Plots of a study: key figures over the first varied number, one curve for each combination of the other values."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from cellplan.report.plots.palette import LIMIT, ROBOTS
from cellplan.report.plots.sheet import Panel, Sheet
from cellplan.report.record.common import Entries, Record

SHOWN: Final[Mapping[str, tuple[str, float, float | None]]] = {
    "max_velocity_ratio": ("highest joint velocity, in % of its limit", 100.0, 100.0),
    "max_acceleration_ratio": ("highest joint acceleration, in % of its limit", 100.0, 100.0),
    "min_margin_deg": ("smallest joint margin, in deg", 1.0, None),
    "min_clearance_mm": ("smallest certified clearance, in mm", 1.0, None),
}  # title, scale and limit of each figure
MAX_CURVES: Final = len(ROBOTS)


def study_sheets(record: Record) -> dict[str, Sheet]:
    """The sheet of a study; none where no number is varied or nothing was solved.

    Args:
        record: As ``study_record`` returns it.
    """
    address = varied_number(record)
    curves = dict(_curves(record, address)) if address else {}
    x = np.array([trial["values"][address] for trials in curves.values() for trial in trials], dtype=float)
    if not len(x) or len(curves) > MAX_CURVES or np.ptp(x) == 0.0:
        return {}
    solved = [trial["figures"] for trials in curves.values() for trial in trials]
    shown = [name for name in SHOWN if any(figures[name] is not None for figures in solved)]
    title = f"{record['cell']}: key figures over {address}; failed variants in red"
    span = np.array([x.min(), x.max()])
    sheet = Sheet(title, rows=(len(shown) + 1) // 2, columns=2, times=span, across=str(address))
    for place, name in enumerate(shown):
        label, scale, limit = SHOWN[name]
        found = [scale * figures[name] for figures in solved if figures[name] is not None]
        panel = sheet.panel(place, label, span=(min(found), max(*found, limit or max(found))))
        if limit is not None and min(found) < limit:
            sheet.limit(panel, limit)
        for colour, trials in zip(ROBOTS, curves.values(), strict=False):
            points = [
                (float(trial["values"][address]), scale * trial["figures"][name], trial["status"] == "passed")
                for trial in trials
                if trial["figures"][name] is not None
            ]
            _draw_curve(sheet, panel, points, colour)
    return {"study": sheet}


def _draw_curve(sheet: Sheet, panel: Panel, points: Sequence[tuple[float, float, bool]], colour: str) -> None:
    """One curve: a dot for each variant, red if it failed."""
    if points:
        at, values, _ = zip(*points, strict=True)
        sheet.curve(panel, np.array(at), np.array(values), colour=colour)
    for one_at, value, passed in points:
        sheet.dot(panel, one_at, value, colour=colour if passed else LIMIT)


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
