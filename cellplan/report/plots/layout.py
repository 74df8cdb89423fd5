"""Pictures of a layout search: the floor plan to scale, cycle against clearance, and how the search went on."""

from typing import Any, Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.report.plots.palette import GREY, INK, LIMIT, ROBOTS
from cellplan.report.plots.plane import draw_axes, draw_line
from cellplan.report.plots.sheet import Line, Panel, Rectangle, Sheet
from cellplan.report.record.common import Entries, Record

LONGEST: Final = 7.4  # [inch] of the longer side of the plan
LEFT, TOP, FOOT, LEGEND = 0.75, 0.45, 0.6, 2.3  # [inch]
BORDER: Final = 150.0  # [mm] about what is drawn
CIRCLE: Final = np.linspace(0.0, 2.0 * np.pi, 73)
HALF: Final = 6.2  # [inch] width of a sheet with one curve
DOWN: Final = 2.6  # [inch]


def floor_plan(record: Record) -> Sheet | None:
    """The given and the best layout from above, to scale; None where nothing is drawn.

    Args:
        record: As ``layout_record`` returns it.
    """
    drawn = record["drawing"]
    if not drawn:
        return None
    low, high = _extent(drawn)
    scale = LONGEST / float(max(high - low))
    sheet = Sheet("", rows=1, columns=1, times=np.array([0.0, 1.0]), width=LEFT + scale * (high - low)[0] + LEGEND)
    sheet.height = TOP + scale * float((high - low)[1]) + FOOT
    title = f"{record['cell']} from above"
    sheet.write(0.12, sheet.height - 0.24, title, size=10.5, weight="bold", va="center")
    panel = Panel(
        left=LEFT,
        bottom=FOOT,
        width=scale * float((high - low)[0]),
        height=scale * float((high - low)[1]),
        first=float(low[0]),
        last=float(high[0]),
        low=float(low[1]),
        high=float(high[1]),
    )
    _sweep(sheet, panel, drawn)
    _outlines(sheet, panel, drawn)
    _bases(sheet, panel, drawn)
    draw_axes(sheet, panel)
    _legend(sheet, panel, drawn)
    return sheet


def front_sheet(record: Record) -> Sheet | None:
    """Cycle against clearance of all conforming layouts, those that no other one beats joined; None without any."""
    found = [each for each in _shown(record) if each["cycle_s"] is not None and each["clearance_mm"] is not None]
    if not found:
        return None
    xs = [float(each["clearance_mm"]) for each in found] + [float(record["required_clearance_mm"] or 0.0)]
    spread = max(xs) - min(xs) or 1.0
    across = np.array([min(xs) - 0.08 * spread, max(xs) + 0.08 * spread])
    cycles = [float(each["cycle_s"]) for each in found]
    sheet, panel = _graph("cycle against clearance", across, (min(cycles), max(cycles)), along="clearance in mm")
    _demand(sheet, panel, float(record["required_clearance_mm"] or 0.0))
    front = sorted((float(e["clearance_mm"]), float(e["cycle_s"])) for e in record["front"])
    if len(front) > 1:
        points = np.array(front)
        sheet.curve(panel, points[:, 0], points[:, 1], colour=ROBOTS[0], width=1.2)
    for each in found:
        colour = {"certified": ROBOTS[2], "rejected": LIMIT}.get(each["status"], GREY)
        sheet.dot(panel, float(each["clearance_mm"]), float(each["cycle_s"]), colour=colour)
    return sheet


def convergence_sheet(record: Record) -> Sheet | None:
    """Cycle of every conforming trial and the best so far, trial after trial; None without any."""
    steps = [each for each in record["convergence"] if each["best_s"] is not None]
    if not steps:
        return None
    last = max(each["trial"] for each in record["convergence"])
    shown = [float(each[key]) for each in steps for key in ("cycle_s", "best_s") if each[key] is not None]
    trials = np.array([-0.5, max(last, 1) + 0.5])
    title = "each trial (dots) and the best so far (line)"
    sheet, panel = _graph(title, trials, (min(shown), max(shown)), along="trial")
    for each in steps:
        if each["cycle_s"] is not None:
            sheet.dot(panel, float(each["trial"]), float(each["cycle_s"]), colour=GREY)
    at = np.array([value for each in steps for value in (each["trial"] - 0.5, each["trial"] + 0.5)], dtype=float)
    best = np.repeat([float(each["best_s"]) for each in steps], 2)
    sheet.curve(panel, at, best, colour=ROBOTS[0])
    return sheet


def _shown(record: Record) -> Entries:
    """Layouts of the figure, each once."""
    listed: dict[int, Any] = {}
    for each in (*record["front"], *record["top"]):
        listed.setdefault(each["trial"], each)
    return [each for each in listed.values() if each["status"] != "violating"]


def _graph(title: str, across: Array, span: tuple[float, float], *, along: str) -> tuple[Sheet, Panel]:
    """A sheet with one empty panel for cycles."""
    sheet = Sheet("", rows=1, columns=1, times=across, width=HALF)
    sheet.height = TOP + DOWN + FOOT
    sheet.write(0.12, sheet.height - 0.24, title, size=10.5, weight="bold", va="center")
    padding = 0.08 * (span[1] - span[0]) or 0.1 * span[0]
    panel = Panel(
        left=LEFT,
        bottom=FOOT,
        width=HALF - LEFT - 0.15,
        height=DOWN,
        first=float(across[0]),
        last=float(across[-1]),
        low=span[0] - padding,
        high=span[1] + padding,
    )
    draw_axes(sheet, panel, across=along, upward="shortest cycle in s")
    return sheet, panel


def _demand(sheet: Sheet, panel: Panel, value: float) -> None:
    """The demanded clearance as a line."""
    if panel.first <= value <= panel.last:
        sheet.curve(panel, np.array([value, value]), np.array([panel.low, panel.high]), colour=LIMIT, width=0.9)
        at = float(panel.x(np.array(value)))
        top = panel.bottom + panel.height
        sheet.write(at + 0.04, top - 0.04, "demanded", size=7, color=LIMIT, va="top")


def _extent(drawn: Record) -> tuple[Any, Any]:
    """Lowest and highest corner of the plan in [mm]."""
    points = [
        point for each in (*drawn["given"]["outlines"], *drawn["best"]["outlines"]) for point in each["outline_mm"]
    ]
    points += [[each["x_mm"], each["y_mm"]] for each in (*drawn["given"]["robots"], *drawn["best"]["robots"])]
    swept = drawn["swept"]
    points += [[x, row[0]] for rows in swept["robots"].values() for row in rows for x in (row[1], row[2])]
    found = np.array(points, dtype=float)
    return found.min(axis=0) - BORDER, found.max(axis=0) + BORDER


def _sweep(sheet: Sheet, panel: Panel, drawn: Record) -> None:
    """What the links of each robot cover, in its colour."""
    half = 0.5 * drawn["swept"]["square_mm"]
    for index, rows in enumerate(drawn["swept"]["robots"].values()):
        style = {"color": _colour(index), "linewidth": 0, "zorder": 0.4, "alpha": 0.16}
        for y, first, last in rows:
            left, right = panel.x(np.array([first - half, last + half]))
            low, high = panel.y(np.array([y - half, y + half]))
            size = (float(right - left), float(high - low))
            sheet.marks.append(Rectangle((float(left), float(low)), *size, style))


def _outlines(sheet: Sheet, panel: Panel, drawn: Record) -> None:
    """Bodies of the best layout at the start, what stands of the given one, and the paths."""
    names = list(drawn["swept"]["robots"])
    for each in drawn["given"]["outlines"]:
        if each["is_at_rest"] and each["robot"]:
            style = {"color": GREY, "linewidth": 0.9, "linestyle": "--", "zorder": 1.5}
            draw_line(sheet, panel, each["outline_mm"], is_closed=True, **style)
    for each in drawn["best"]["outlines"]:
        colour = _colour(names.index(each["robot"])) if each["robot"] in names else INK
        width = 1.1 if each["is_at_rest"] or each["kind"] == "part" else 0.5
        draw_line(sheet, panel, each["outline_mm"], is_closed=True, color=colour, linewidth=width, zorder=2.0)
    for each in drawn["best"]["paths"]:
        draw_line(sheet, panel, each["points_mm"], color=LIMIT, linewidth=1.2, zorder=2.5)
    for name, box in drawn["keep_out"].items():
        draw_line(sheet, panel, box, is_closed=True, color=LIMIT, linewidth=0.8, linestyle="--", zorder=1.4)
        sheet.write(*_at(panel, *np.mean(box, axis=0)), name, size=7, color=LIMIT, ha="center", va="center")


def _bases(sheet: Sheet, panel: Panel, drawn: Record) -> None:
    """Old and new bases with the move between them, and the reach of each robot."""
    old = {each["name"]: each for each in drawn["given"]["robots"]}
    for index, each in enumerate(drawn["best"]["robots"]):
        colour, x, y = _colour(index), each["x_mm"], each["y_mm"]
        reach = drawn["reach_mm"][each["name"]]
        circle = np.stack([x + reach * np.cos(CIRCLE), y + reach * np.sin(CIRCLE)], axis=1)
        draw_line(sheet, panel, circle, color=colour, linewidth=0.6, linestyle="--", zorder=1.0)
        was = old[each["name"]]
        draw_line(sheet, panel, [[was["x_mm"], was["y_mm"]], [x, y]], color=colour, linewidth=1.4, zorder=3.0)
        sheet.marks.append(_dot(panel, was["x_mm"], was["y_mm"], "#ffffff", colour))
        sheet.marks.append(_dot(panel, x, y, colour, colour))
        at = _at(panel, x, y)
        sheet.write(at[0] + 0.09, at[1] + 0.09, each["name"], color=colour, size=8.5, weight="bold", zorder=4.0)


def _dot(panel: Panel, x: float, y: float, colour: str, edge: str) -> Any:
    """A base."""
    style = {"marker": "o", "markersize": 6.5, "linestyle": "none", "color": colour, "zorder": 3.5}
    at = _at(panel, x, y)
    return Line(np.array([at[0]]), np.array([at[1]]), {**style, "markeredgecolor": edge, "markeredgewidth": 1.2})


def _at(panel: Panel, x: float, y: float) -> tuple[float, float]:
    """A place on the sheet in inches."""
    return float(panel.x(np.array(x))), float(panel.y(np.array(y)))


def _legend(sheet: Sheet, panel: Panel, drawn: Record) -> None:
    """What the colours and lines mean."""
    left, y = panel.left + panel.width + 0.2, panel.bottom + panel.height - 0.1
    for index, each in enumerate(drawn["best"]["robots"]):
        style = {"color": _colour(index), "linewidth": 0, "zorder": 2.0}
        sheet.marks.append(Rectangle((left, y - 0.06), 0.18, 0.12, style))
        sheet.write(left + 0.26, y, each["name"], va="center")
        y -= 0.2
    for text in (
        "filled dot: base of the best layout",
        "open dot: base as given",
        "shaded: swept by links and tools",
        "dashed circle: reach of the arm",
        "grey dashes: feet as given",
        "red: paths on the part at the start",
    ):
        sheet.write(left, y - 0.08, text, size=7.5, color=GREY, va="center")
        y -= 0.18


def _colour(index: int) -> str:
    """Colour of a robot by its place in the cell."""
    return ROBOTS[index % len(ROBOTS)]
