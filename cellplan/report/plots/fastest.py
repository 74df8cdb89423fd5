"""Plots of the production curve: a small picture for each figure over the cycle time, a curve for each law."""

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from cellplan.report.plots.figure import Axis, Curve, Figure, Item, Limit, Mark, Panel, value_axis
from cellplan.report.plots.palette import INK, ROBOTS
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


def curve_figures(record: Record) -> dict[str, Figure]:
    """A figure for each quantity; none where there is no calmer cycle.

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
    x = Axis(low=min(cycles), high=max(cycles), label="cycle time in s", unit="s")
    seen = {name: one for name, one in singles.items() if x.low <= one["cycle_time_s"] <= x.high}
    panels = {name: _panel(name, curves, seen) for name in SHOWN}
    return {
        name: Figure(title="", x=x, panels=[panel], width=NARROW) for name, panel in panels.items() if panel is not None
    }


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


def _panel(name: str, curves: Mapping[str, list[Record]], singles: Mapping[str, Record]) -> Panel | None:
    """Limit, curves and single programs of one quantity; None where no program has it."""
    shown = SHOWN[name]
    items: list[Item] = []
    if shown.limit is not None:
        items.append(Limit(shown.limit, shown.limit_name, is_shaded=False))
    values = []
    for law, points in [*curves.items(), *((law, [point]) for law, point in singles.items())]:
        found = [(point["cycle_time_s"], shown.scale * point[name]) for point in points if point[name] is not None]
        if law in curves and found:
            at_s, heights = np.array(found).T
            items.append(Curve(law, at_s, heights, COLOURS[law]))
        items += [Mark(at_one, value, COLOURS[law]) for at_one, value in found]
        values += [value for _, value in found]
    if not values:
        return None
    axis = value_axis(min(0.0, *values), max(*values, shown.limit or 0.0), is_floored=True)
    return Panel(title=shown.title, y=axis, items=items)
