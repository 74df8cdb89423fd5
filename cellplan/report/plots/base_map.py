"""Picture of a map: the plane from above, to scale, each place in the colour of its verdict."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.report.plots.palette import INK, LIMIT, ROBOTS
from cellplan.report.plots.plane import draw_axes, draw_line
from cellplan.report.plots.sheet import Label, Line, Panel, Rectangle, Sheet
from cellplan.report.record.common import Record

COLOURS: Final = {
    "collision": "#e6a7a0",
    "speed": "#eccb85",
    "limit": "#b9c0ca",
    "out_of_reach": "#f1f3f6",
    "not_judged": "#8a6fb0",
}
SHADES: Final = ("#12492f", "#1e6b45", "#2f8d5d", "#55ad7c", "#86c9a1", "#b6e0c5")  # of places that pass, fastest first
TITLES: Final = {
    "passes": "passes",
    "collision": "collision or too near",
    "speed": "too fast",
    "limit": "beyond a joint limit",
    "out_of_reach": "out of reach",
    "not_judged": "not judged",
}
LONGEST: Final = 6.6  # [inch] of the longer side of the plane
LEFT, TOP, FOOT, LEGEND = 0.75, 0.5, 0.65, 2.2  # [inch]


def map_sheet(record: Record) -> Sheet:
    """The sheet of a map.

    Args:
        record: As ``base_map`` returns it.
    """
    x, y, step = np.array(record["x_mm"]), np.array(record["y_mm"]), _step(record)
    spans = (float(np.ptp(x)) + step, float(np.ptp(y)) + step)
    scale = LONGEST / max(spans)
    sheet = Sheet("", rows=1, columns=1, times=np.array([0.0, 1.0]), width=LEFT + scale * spans[0] + LEGEND)
    sheet.height = TOP + scale * spans[1] + FOOT
    title = f"{record['cell']}: base of {record['robot']} from above"
    sheet.write(0.12, sheet.height - 0.24, title, size=10.5, weight="bold", va="center")
    panel = Panel(
        left=LEFT,
        bottom=FOOT,
        width=scale * spans[0],
        height=scale * spans[1],
        first=float(x[0]) - 0.5 * step,
        last=float(x[-1]) + 0.5 * step,
        low=float(y[0]) - 0.5 * step,
        high=float(y[-1]) + 0.5 * step,
    )
    _fill(sheet, panel, record, step)
    _draw_things(sheet, panel, record)
    draw_axes(sheet, panel)
    _draw_legend(sheet, panel, record)
    return sheet


def cycle_classes(record: Record) -> list[tuple[str, float, float]]:
    """Colour, shortest and longest cycle in [s] of each class of places that pass, fastest first."""
    cycles = [place["figures"]["cycle_s"] for place in record["places"] if place["verdict"] == "passes"]
    if not cycles:
        return []
    edges = np.linspace(min(cycles), max(cycles), len(SHADES) + 1).tolist()
    if edges[0] == edges[-1]:
        return [(SHADES[0], edges[0], edges[0])]
    return [(colour, edges[i], edges[i + 1]) for i, colour in enumerate(SHADES)]


def colours_of(record: Record) -> dict[str, str]:
    """Colours of the verdicts that a map has, but for places that pass."""
    return {verdict: colour for verdict, colour in COLOURS.items() if verdict in record["counts"]}


def _step(record: Record) -> float:
    """Distance of neighbouring places in [mm]."""
    gaps = [values[1] - values[0] for values in (record["x_mm"], record["y_mm"]) if len(values) > 1]
    return float(gaps[0]) if gaps else 100.0


def _colour(place: Record, classes: list[tuple[str, float, float]]) -> str:
    """Colour of a place."""
    if place["verdict"] != "passes":
        return COLOURS[place["verdict"]]
    return next((c for c, _, last in classes if place["figures"]["cycle_s"] <= last), classes[-1][0])


def _fill(sheet: Sheet, panel: Panel, record: Record, step: float) -> None:
    """Every place as a square; neighbours of one colour in a row as one rectangle."""
    classes, columns = cycle_classes(record), len(record["x_mm"])
    for row, y in enumerate(record["y_mm"]):
        colours = [_colour(each, classes) for each in record["places"][row * columns : (row + 1) * columns]]
        for first, last, colour in _stretches(colours):
            left, right = panel.x(np.array([record["x_mm"][first] - 0.5 * step, record["x_mm"][last] + 0.5 * step]))
            low, high = panel.y(np.array([y - 0.5 * step, y + 0.5 * step]))
            style = {"color": colour, "linewidth": 0, "zorder": 0.5, "antialiased": False}
            size = (float(right - left), float(high - low))
            sheet.marks.append(Rectangle((float(left), float(low)), *size, style))


def _stretches(colours: list[str]) -> Iterator[tuple[int, int, str]]:
    """First and last place of each stretch of one colour."""
    first = 0
    for place in range(1, len(colours) + 1):
        if place == len(colours) or colours[place] != colours[first]:
            yield first, place - 1, colours[first]
            first = place


def _draw_things(sheet: Sheet, panel: Panel, record: Record) -> None:
    """Robots at the start, part, surroundings, paths, the present base and the best places."""
    drawn = record["drawing"]
    for each in drawn["outlines"]:
        is_own = each["robot"] == record["robot"]
        colour = LIMIT if is_own else INK
        width = 1.1 if each["is_at_rest"] or each["kind"] == "part" else 0.45
        draw_line(sheet, panel, each["outline_mm"], is_closed=True, color=colour, linewidth=width, zorder=2.0)
    for index, each in enumerate(drawn["paths"]):
        draw_line(sheet, panel, each["points_mm"], color=ROBOTS[index % len(ROBOTS)], linewidth=1.6, zorder=2.5)
    for each in drawn["robots"]:
        if panel.first < each["x_mm"] < panel.last and panel.low < each["y_mm"] < panel.high:
            is_own = each["name"] == record["robot"]
            style = {"color": LIMIT if is_own else INK, "ha": "center", "va": "center", "size": 8.5, "zorder": 4.0}
            at = (float(panel.x(np.array(each["x_mm"]))), float(panel.y(np.array(each["y_mm"]))))
            sheet.marks.append(Label(*at, each["name"], {**style, "weight": "bold"}))
    for rank, each in enumerate(record["best"]):
        place = record["places"][each["place"]]
        x, y = panel.x(np.array([place["x_mm"]])), panel.y(np.array([place["y_mm"]]))
        passed = (each["certified"] or {}).get("status")
        colour = {"passed": "#ffffff", None: INK}.get(passed, LIMIT)
        size = 6.5 if rank == 0 else 3.5
        style = {"marker": "*" if rank == 0 else "o", "markersize": size, "linestyle": "none", "color": colour}
        sheet.marks.append(Line(x, y, {**style, "markeredgecolor": INK, "markeredgewidth": 0.6, "zorder": 5.0}))


def _draw_legend(sheet: Sheet, panel: Panel, record: Record) -> None:
    """What the colours mean, with the number of places of each."""
    left, y = panel.left + panel.width + 0.2, panel.bottom + panel.height - 0.15
    classes = cycle_classes(record)
    entries = [(colour, f"cycle {first:.2f} to {last:.2f} s") for colour, first, last in classes]
    lines = [(None, f"passes: {record['counts']['passes']}"), *entries]
    lines += [
        (colour, f"{TITLES[verdict]}: {record['counts'][verdict]}") for verdict, colour in colours_of(record).items()
    ]
    for colour, text in lines:
        if colour is None:
            sheet.write(left, y, text, va="center", weight="bold")
        else:
            style = {"color": colour, "linewidth": 0, "zorder": 2.0}
            sheet.marks.append(Rectangle((left, y - 0.06), 0.18, 0.12, style))
            sheet.write(left + 0.26, y, text, va="center")
        y -= 0.2
    sheet.write(left, y - 0.1, f"red: {record['robot']} as it stands", color=LIMIT, va="center")
    sheet.write(left, y - 0.3, "star: best place, dots: next best", va="center")
