"""Plots of the production curve: a small picture for each figure over the cycle time, a curve for each law."""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from cellplan.report.plots.palette import GREY, INK, LIMIT, ROBOTS
from cellplan.report.plots.sheet import Panel, Sheet
from cellplan.report.record.common import Record

NARROW: Final = 4.6  # [inch] of a picture: readable on a telephone too
REDUCED: Final = 250.0  # [mm/s]
COLOURS: Final = {
    "time_laws": ROBOTS[0],
    "common_speed": ROBOTS[1],
    "as_written": INK,
    "reduced_speed": ROBOTS[3],
    "demand": ROBOTS[2],
}


class Shown(NamedTuple):
    """A figure: its title, its scale, and a limit with its name."""

    title: str
    scale: float = 1.0
    limit: float | None = None
    limit_name: str = ""


SHOWN: Final[Mapping[str, Shown]] = {
    "max_velocity_ratio": Shown("highest joint velocity, in % of its limit", 100.0, 100.0),
    "max_acceleration_ratio": Shown("highest joint acceleration, in % of its limit", 100.0, 100.0),
    "max_tool_speed_mm_s": Shown("fastest tool tip in the world, in mm/s", 1.0, REDUCED, "reduced speed"),
    "energy_proxy_s": Shown("energy proxy, in s"),
    "min_margin_deg": Shown("smallest joint margin, in deg"),
    "parts_per_h": Shown("parts per hour"),
}


def curve_sheets(record: Record) -> dict[str, Sheet]:
    """A sheet for each figure; none where there is no calmer cycle.

    Args:
        record: As ``fastest_record`` returns it.
    """
    curves = curves_of(record)
    if max(map(len, curves.values()), default=0) < 2:
        return {}
    singles = single_programs(record)
    cycles = [point["cycle_time_s"] for points in curves.values() for point in points]
    if "demand" in singles:
        cycles.append(singles["demand"]["cycle_time_s"])
    span = np.array([min(cycles), max(cycles)])
    seen = {name: one for name, one in singles.items() if span[0] <= one["cycle_time_s"] <= span[1]}
    every = [*(point for points in curves.values() for point in points), *seen.values()]
    sheets = {}
    for name, shown in SHOWN.items():
        values = [shown.scale * point[name] for point in every if point[name] is not None]
        if values:
            sheet = Sheet(shown.title, rows=1, columns=1, times=span, across="cycle time in s", width=NARROW)
            panel = sheet.panel(0, "", span=(min(0.0, *values), max(*values, shown.limit or 0.0)), is_floored=True)
            _draw(sheet, panel, name, curves, seen)
            sheets[name] = sheet
    return sheets


def curves_of(record: Record) -> dict[str, list[Record]]:
    """Figures of the points of the production curve that have a program, by law."""
    found: dict[str, list[Record]] = {}
    for point in record["curve"]:
        if point["figures"]:
            found.setdefault(point["law"], []).append(point["figures"])
    return found


def single_programs(record: Record) -> dict[str, Record]:
    """Figures of the programs beside the curve: as written, at reduced speed, and that of the demand."""
    found = {"as_written": record["as_written"]}
    reduced = record["cycles"].get("reduced_speed")
    if reduced and reduced["law"] == "reduced_speed":
        found["reduced_speed"] = reduced["figures"]
    if record["demand"]:
        found["demand"] = record["demand"]["program"]["figures"]
    return found


def _draw(
    sheet: Sheet, panel: Panel, name: str, curves: Mapping[str, list[Record]], singles: Mapping[str, Record]
) -> None:
    """Limit, curves and single programs of one figure."""
    shown = SHOWN[name]
    if shown.limit is not None:
        across = np.array([panel.first, panel.last])
        sheet.curve(panel, across, np.full(2, shown.limit), colour=LIMIT, width=0.9)
        at = float(panel.y(np.array([shown.limit]))[0])
        sheet.write(panel.left + panel.width, at - 0.04, shown.limit_name, size=7, color=GREY, ha="right", va="top")
    for law, points in curves.items():
        found = [(point["cycle_time_s"], shown.scale * point[name]) for point in points if point[name] is not None]
        if found:
            at_s, values = np.array(found).T
            sheet.curve(panel, at_s, values, colour=COLOURS[law])
        for at_one, value in found:
            sheet.dot(panel, at_one, value, colour=COLOURS[law])
    for law, point in singles.items():
        if point[name] is not None:
            sheet.dot(panel, point["cycle_time_s"], shown.scale * point[name], colour=COLOURS[law])
