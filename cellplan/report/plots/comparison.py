"""Plots of a comparison: use of the joints, their speed over time and the clearance over time, a colour a variant."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from cellplan.report.plots.figure import (
    Axis,
    Box,
    Curve,
    Figure,
    Item,
    Limit,
    Note,
    Panel,
    time_axis,
    value_axis,
)
from cellplan.report.plots.palette import PAPER, ROBOTS
from cellplan.report.record.common import Record
from cellplan.report.record.comparison import robot_names

MAX_ROBOTS: Final = 8  # drawn: those whose joints are fastest
TOP: Final = 150.0  # [%] of a limit: what is above is cut off and its value written
PERCENT: Final = 100.0
BARS: Final = 0.8  # [-] of the place of a joint that its bars take


def comparison_figures(record: Record, curves: Sequence[Record | None]) -> dict[str, Figure]:
    """The figures of a comparison by name; none where nothing was solved.

    Args:
        record: As ``comparison_record`` returns it.
        curves: Curves of each variant; None for one without a motion.
    """
    found = [{**each["figures"], "curves": its} for each, its in zip(record["variants"], curves, strict=True) if its]
    solved: dict[str, Any] = dict(zip(ROBOTS, found, strict=False))
    robots = drawn_robots(record)
    if not solved or not robots:
        return {}
    figures = {"joints": _joints(solved, robots), "speeds": _speeds(solved, robots)}
    if any(each["curves"]["clearance_mm"] for each in solved.values()):
        figures["clearance"] = _clearance(solved)
    return figures


def drawn_robots(record: Record) -> list[str]:
    """Robots that are drawn, in their order."""
    names = robot_names(record)
    hardest = sorted(names, key=lambda name: -_peak(record, name))[:MAX_ROBOTS]
    return [name for name in names if name in hardest]


def _peak(record: Record, robot: str) -> float:
    """Highest joint speed of a robot in any variant, as a fraction of its limit."""
    uses = [each["figures"]["robots"].get(robot) for each in record["variants"] if each["figures"]]
    return max((joint["velocity_ratio"] or 0.0 for use in uses if use for joint in use["joints"].values()), default=0.0)


def _joints(solved: Mapping[str, Any], robots: Sequence[str]) -> Figure:
    """Bars of every joint: range used and highest speed."""
    uses = {robot: {colour: each["robots"].get(robot) for colour, each in solved.items()} for robot in robots}
    count = max(len(use["joints"]) for found in uses.values() for use in found.values() if use)
    panels = [
        _bars(f"{robot}: {text}", {colour: _percent(use, key) for colour, use in found.items()})
        for robot, found in uses.items()
        for key, text in (
            ("range_ratio", "range used, in % of the limit"),
            ("velocity_ratio", "highest velocity, in % of its limit"),
        )
    ]
    x = Axis(low=0.4, high=count + 0.6, label="joint, counted from the base")
    return Figure(title="use of the joints", x=x, panels=panels, columns=2)


def _percent(use: Record | None, key: str) -> list[float]:
    """A ratio of each joint, in [%]."""
    return [PERCENT * (joint[key] or 0.0) for joint in use["joints"].values()] if use else []


def _bars(title: str, values: Mapping[str, Sequence[float]]) -> Panel:
    """Bars side by side at each joint; the value of one that is cut off stands on it."""
    top = min(TOP, max(105.0, *(max(own, default=0.0) for own in values.values())))
    axis, width = value_axis(0.0, top, unit="%", is_floored=True), BARS / len(values)
    items: list[Item] = [Limit(PERCENT)]
    for place, (colour, own) in enumerate(values.items()):
        for joint, value in enumerate(own, start=1):
            left = joint - 0.5 * BARS + place * width
            items.append(Box((left, left + width), (0.0, min(value, top)), colour))
            if value > top:
                items.append(Note(left + 0.5 * width, top, f"{value:.0f}", PAPER, size=6.0, moved=(0.0, -6.0)))
    return Panel(title=title, y=axis, items=items)


def _speeds(solved: Mapping[str, Any], robots: Sequence[str]) -> Figure:
    """Highest joint speed of every robot over time."""
    end = max(each["cycle_time_s"] for each in solved.values())
    title = "highest joint velocity of each robot over time, in % of the limit"
    panels = [_speed_panel(solved, robot) for robot in robots]
    return Figure(title=title, x=time_axis(np.array([0.0, end])), panels=panels, columns=2)


def _speed_panel(solved: Mapping[str, Any], robot: str) -> Panel:
    """Highest joint speed of one robot in every variant."""
    curves = {
        colour: (each["curves"]["times_s"], PERCENT * np.array(each["curves"]["velocity_ratio"][robot]))
        for colour, each in solved.items()
        if robot in each["curves"]["velocity_ratio"]
    }
    highest = max(float(values.max()) for _, values in curves.values())
    top = min(TOP, highest)
    items: list[Item] = [Limit(PERCENT)] if top > PERCENT else []
    items += [Curve("", np.array(times), np.minimum(values, top), pen) for pen, (times, values) in curves.items()]
    note = f"up to {highest:.0f} %" if highest > TOP else ""
    return Panel(title=robot, note=note, y=value_axis(0.0, top, unit="%", is_floored=True), items=items)


def _clearance(solved: Mapping[str, Any]) -> Figure:
    """Smallest distance of all bodies over time."""
    curves = {
        colour: (np.array(each["curves"]["clearance_times_s"]), np.array(each["curves"]["clearance_mm"]))
        for colour, each in solved.items()
        if each["curves"]["clearance_mm"]
    }
    end = max(each["cycle_time_s"] for each in solved.values())
    required = {each["required_clearance_mm"] for each in solved.values()}
    highest = max(float(values.max()) for _, values in curves.values())
    items: list[Item] = []
    if len(required) == 1:
        items.append(Limit(max(required), f"required: {max(required):g} mm", is_upper=False))
    items += [Curve("", times, values, colour) for colour, (times, values) in curves.items()]
    axis = value_axis(0.0, max(highest, *required), unit="mm", is_floored=True)
    title = "smallest distance of all bodies over time, certified between the rows"
    panel = Panel(title="distance, in mm", y=axis, items=items)
    return Figure(title=title, x=time_axis(np.array([0.0, end])), panels=[panel])
