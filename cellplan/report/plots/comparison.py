"""Plots of a comparison: use of the joints, their speed over time and the clearance over time, a colour a variant."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from cellplan.report.plots.palette import ROBOTS
from cellplan.report.plots.sheet import Panel, Sheet
from cellplan.report.record.common import Record
from cellplan.report.record.comparison import robot_names

MAX_ROBOTS: Final = 8  # drawn: those whose joints are fastest
TOP: Final = 150.0  # [%] of a limit: what is above is cut off and its value written
BARS: Final = 0.8  # [-] of the place of a joint that its bars take


def comparison_sheets(record: Record, curves: Sequence[Record | None]) -> dict[str, Sheet]:
    """The sheets of a comparison by name; none where nothing was solved.

    Args:
        record: As ``comparison_record`` returns it.
        curves: Curves of each variant; None for one without a motion.
    """
    found = [{**each["figures"], "curves": its} for each, its in zip(record["variants"], curves, strict=True) if its]
    solved: dict[str, Any] = dict(zip(ROBOTS, found, strict=False))
    robots = drawn_robots(record)
    if not solved or not robots:
        return {}
    sheets = {"joints": _joints(solved, robots), "speeds": _speeds(solved, robots)}
    if any(figures["curves"]["clearance_mm"] for figures in solved.values()):
        sheets["clearance"] = _clearance(solved)
    return sheets


def drawn_robots(record: Record) -> list[str]:
    """Robots that are drawn, in their order."""
    names = robot_names(record)
    hardest = sorted(names, key=lambda name: -_peak(record, name))[:MAX_ROBOTS]
    return [name for name in names if name in hardest]


def _peak(record: Record, robot: str) -> float:
    """Highest joint speed of a robot in any variant, as a fraction of its limit."""
    uses = [each["figures"]["robots"].get(robot) for each in record["variants"] if each["figures"]]
    return max((joint["velocity_ratio"] or 0.0 for use in uses if use for joint in use["joints"].values()), default=0.0)


def _joints(solved: Mapping[str, Any], robots: Sequence[str]) -> Sheet:
    """Bars of every joint: range used and highest speed."""
    uses = {robot: {colour: each["robots"].get(robot) for colour, each in solved.items()} for robot in robots}
    count = max(len(use["joints"]) for found in uses.values() for use in found.values() if use)
    across = np.array([0.4, count + 0.6])
    title = "use of the joints"
    sheet = Sheet(title, rows=len(robots), columns=2, times=across, across="joint, counted from the base")
    for row, (robot, found) in enumerate(uses.items()):
        for column, (key, text) in enumerate(
            (
                ("range_ratio", "range used, in % of the limit"),
                ("velocity_ratio", "highest velocity, in % of its limit"),
            )
        ):
            own = {
                colour: [100.0 * (joint[key] or 0.0) for joint in use["joints"].values()] if use else []
                for colour, use in found.items()
            }
            top = min(TOP, max(105.0, *(max(values, default=0.0) for values in own.values())))
            panel = sheet.panel(2 * row + column, f"{robot}: {text}", span=(0.0, top), is_floored=True)
            sheet.limit(panel, 100.0)
            _bars(sheet, panel, own, top)
    return sheet


def _bars(sheet: Sheet, panel: Panel, values: Mapping[str, Sequence[float]], top: float) -> None:
    """Bars side by side at each joint; the value of one that is cut off stands on it."""
    width = BARS / len(values)
    for place, (colour, own) in enumerate(values.items()):
        for joint, value in enumerate(own, start=1):
            left = joint - 0.5 * BARS + place * width
            sheet.bar(panel, (left, left + width), min(value, top), colour=colour)
            if value > top:
                at = float(panel.x(np.array([left + 0.5 * width]))[0])
                high = panel.bottom + panel.height
                sheet.write(at, high - 0.04, f"{value:.0f}", size=6, color="white", ha="center", va="top")


def _speeds(solved: Mapping[str, Any], robots: Sequence[str]) -> Sheet:
    """Highest joint speed of every robot over time."""
    end = max(each["cycle_time_s"] for each in solved.values())
    title = "highest joint velocity of each robot over time, in % of the limit"
    sheet = Sheet(title, rows=(len(robots) + 1) // 2, columns=2, times=np.array([0.0, end]))
    for place, robot in enumerate(robots):
        curves = {
            colour: (np.array(each["curves"]["times_s"]), 100.0 * np.array(each["curves"]["velocity_ratio"][robot]))
            for colour, each in solved.items()
            if robot in each["curves"]["velocity_ratio"]
        }
        highest = max(float(values.max()) for _, values in curves.values())
        top = min(TOP, highest)
        note = f"up to {highest:.0f} %" if highest > TOP else ""
        panel = sheet.panel(place, robot, note=note, span=(0.0, top), is_floored=True)
        if top > 100.0:
            sheet.limit(panel, 100.0)
        for colour, (times, values) in curves.items():
            sheet.curve(panel, times, np.minimum(values, top), colour=colour)
    return sheet


def _clearance(solved: Mapping[str, Any]) -> Sheet:
    """Smallest distance of all bodies over time."""
    curves = {
        colour: (np.array(each["curves"]["clearance_times_s"]), np.array(each["curves"]["clearance_mm"]))
        for colour, each in solved.items()
        if each["curves"]["clearance_mm"]
    }
    end = max(each["cycle_time_s"] for each in solved.values())
    required = max(each["required_clearance_mm"] for each in solved.values())
    title = "smallest distance of all bodies over time, certified between the rows"
    sheet = Sheet(title, rows=1, columns=1, times=np.array([0.0, end]))
    highest = max(float(values.max()) for _, values in curves.values())
    panel = sheet.panel(0, "distance, in mm", span=(0.0, max(highest, required)), is_floored=True)
    if len({each["required_clearance_mm"] for each in solved.values()}) == 1:
        sheet.limit(panel, required, label=f"required: {required:g} mm", is_upper=False)
    for colour, (times, values) in curves.items():
        sheet.curve(panel, times, values, colour=colour)
    return sheet
