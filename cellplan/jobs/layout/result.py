"""A layout search as text, plots, page, tables and files: what is shown, and in which order."""

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.jobs.layout.record import CandidateRecord, ChoiceRecord, DroppedRecord, LayoutRecord, ProgressRecord
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.limits import LimitRecord
from cellplan.jobs.layout.variable_records import VariableRecord
from cellplan.model.report.report import CAUTION
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.plots.figure import (
    Figure,
    Item,
    LegendKey,
    Limit,
    Note,
    PlotAxis,
    PlotBox,
    PlotCurve,
    PlotMark,
    PlotPanel,
    line,
    outline,
    value_axis,
)
from cellplan.report.plots.palette import GREY, INK, LIMIT, PAPER, ROBOTS
from cellplan.report.plots.svg import inline_svg, svg_text
from cellplan.report.record.common import Entries, Record, as_json
from cellplan.report.record.numbers import floored, plain, seconds
from cellplan.report.record.rows import Tables, listed_table

MOST: Final = 6  # [-] lines of what binds, of what the given layout breaks, and of reasons
SAME: Final = 1e-3  # [mm] or [deg] by which a variable may differ and count as unchanged
BORDER: Final = 150.0  # [mm] about what is drawn
CIRCLE: Final = np.linspace(0.0, 2.0 * np.pi, 73)
HALF, ROW = 6.2, 3.0  # [inch] width and height of a figure with one curve
CYCLE: Final = "shortest cycle in s"


# Text


def layout_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a layout search."""
    lines = [f"{record['cell']}: {verdict_line(record)}", f"  {_given(record)}"]
    lines += [f"    {violation['text']}" for violation in record["given"]["violations"][:MOST]]
    if record["best"] is not None:
        changes = list(_changes(record))
        lines.append("  what changed" if changes else "  nothing changed")
        lines += [f"    {line}" for line in changes]
        if record["binding"]:
            lines.append("  what holds it back")
            lines += [f"    {binding['text']}" for binding in record["binding"][:MOST]]
    else:
        rejected = [candidate for candidate in record["top"] if candidate["status"] == "rejected"]
        lines += [f"  rejected by solve: {candidate['reason']}" for candidate in rejected[:MOST]]
        lines += [f"  {reason['reason']} ({_trials(reason['count'])})" for reason in record["dropped"][:MOST]]
    lines += [f"  {line}" for line in map(_choice, record["choices"])]
    lines += [f"  {line}" for line in _misplaced(record)]
    lines += [f"  {remark}" for remark in record["remarks"]]
    rounds = "1 round" if record["rounds"] == 1 else f"{record['rounds']} rounds"
    lines.append(f"  {_trials(record['trials'])} in {rounds}, {record['solves']} solved in full")
    if record["best"] is not None:
        lines.append(solve_best_line(folder))
    return [*lines, f"report: {folder / 'study.html'}"]


def solve_best_line(folder: Path) -> str:
    """The line to type for the best cell of a folder; its run does not replace that of the given cell."""
    words = ["cellplan", "solve", str(folder / "best.yaml"), "-o", f"{folder}-run"]
    return f"next: {shlex.join(words)}"


def verdict_line(record: Record) -> str:
    """What came of the search, in one line."""
    best = record["best"]
    if best is None and record["status"] == "no_start":
        return "NO START: no layout was found in which all tools reach the starts of their paths"
    if best is None:
        return "NO LAYOUT CERTIFIED"
    return f"CERTIFIED: {figures_text(best['cycle_s'], best['margin_deg'], best['clearance_mm'])}"


def figures_text(cycle: float, margin: float | None, clearance: float | None) -> str:
    """Cycle in [s], smallest margin in [deg] and smallest clearance in [mm], in words; None where there is none."""
    figures = [f"cycle {seconds(cycle)} s"]
    if margin is not None:
        figures.append(f"smallest margin {plain(floored(margin))} deg")
    if clearance is not None:
        figures.append(f"smallest clearance {floored(clearance)} mm")
    return ", ".join(figures)


def changed_variables(record: Record) -> Entries:
    """Variables whose value in the best layout is another one than in the given one."""
    return [
        dict(variable)
        for variable in record["variables"]
        if None not in (variable["given"], variable["best"]) and abs(variable["best"] - variable["given"]) > SAME
    ]


def _misplaced(record: Record) -> Iterator[str]:
    """What was sampled with displaced bases."""
    record_ = record["misplacement"]
    if record_ is None:
        return
    by = f"{record_['position_mm']:g} mm and {record_['orientation_deg']:g} deg"
    yield f"with every base off by {by}, sampled, motion planned anew, within {record_['cycle_s']:g} s:"
    yield (
        f"  {record_['seeded_kept']} of {record_['seeded']} seeded corners, {record_['by_derivatives_kept']} of "
        f"{record_['by_derivatives']} worst corners by derivatives, {record_['ends_kept']} of {record_['ends']} single "
        f"displacements passed every check"
    )


def head_of(record: LayoutRecord, request: LayoutRequest) -> str:
    """Comment above a resulting cell file."""
    return (
        f"Layout of {request.cell.name} found by cellplan layout, objective {request.objective}, seed {request.seed}, "
        f"{record['trials']} trials.\n{verdict_line(record)}.\nChanged values say what they were; solve this file as "
        "any other."
    )


def _given(record: Record) -> str:
    """The given layout in one line."""
    given = record["given"]
    if given["reason"]:
        return f"as given: no motion: {given['reason']}"
    state = "conforms" if given["status"] == "conforming" else "does not conform"
    cycle = "" if given["cycle_s"] is None else f"; shortest cycle of its motion {seconds(given['cycle_s'])} s"
    return f"as given: {state}{cycle}"


def _changes(record: Record) -> Iterator[str]:
    """Changed variables, those of one entry of the cell file on one line."""
    groups: dict[str, list[str]] = {}
    for variable in changed_variables(record):
        entry, _, name = variable["name"].removeprefix("robots.").rpartition(".")
        unit = f" {variable['unit']}" if variable["unit"] else ""
        groups.setdefault(entry, []).append(
            f"{name.removesuffix('_mm').removesuffix('_deg')} {variable['given']:.5g} -> {variable['best']:.5g}{unit}"
        )
    yield from (f"{entry}: {', '.join(texts)}" for entry, texts in groups.items())
    if record["path"] is not None:
        yield path_text(record["path"])


def path_text(path: Record) -> str:
    """A joint path in one line, and how far it is from the given motion."""
    parts = ((path["departure_deg"], "deg"), (path["departure_mm"], "mm"))
    departures = " and ".join(f"{value:.3g} {unit}" for value, unit in parts if value is not None)
    given = "path" if path["is_given"] else "motion"
    name = f"{path['robot']}.path" if path["robot"] else "null_space"
    return f"{name}: {path['coefficients']} coefficients a joint, largest departure {departures} from the given {given}"


def _choice(variable: Record) -> str:
    """A combination of discrete choices in one line."""
    cycle = "" if variable["cycle_s"] is None else f", cycle {seconds(variable['cycle_s'])} s"
    reason = f": {variable['reason']}" if variable["reason"] else ""
    return (
        f"{variable['choice']}: {variable['status'].replace('_', ' ')} ({_trials(variable['trials'])}{cycle}){reason}"
    )


def _trials(count: int) -> str:
    """A number of trials in words."""
    return f"{count} trial" if count == 1 else f"{count} trials"


# Plots and page


def floor_plan(record: Record) -> Figure | None:
    """The given and the best layout from above, to scale; None where nothing is drawn."""
    drawing = record["drawing"]
    if not drawing:
        return None
    low, high = _extent(drawing)
    panel = PlotPanel(
        title="",
        y=PlotAxis(low=float(low[1]), high=float(high[1]), label="y in mm, upward", unit="mm"),
        items=[*_sweep(drawing), *_reach(drawing), *_outlines(drawing), *_bases(drawing)],
    )
    return Figure(
        title=f"{record['cell']} from above",
        x=PlotAxis(low=float(low[0]), high=float(high[0]), label="x in mm", unit="mm"),
        panels=[panel],
        is_plane=True,
        legend=list(_legend(drawing)),
    )


def front_figure(record: Record) -> Figure | None:
    """Cycle against clearance of all conforming layouts, those that no other one beats joined; None without any."""
    candidates = [
        candidate
        for candidate in _shown(record)
        if candidate["cycle_s"] is not None and candidate["clearance_mm"] is not None
    ]
    if not candidates:
        return None
    demanded = float(record["required_clearance_mm"] or 0.0)
    clearances = [demanded, *(float(candidate["clearance_mm"]) for candidate in candidates)]
    spread = max(clearances) - min(clearances) or 1.0
    low, high = min(clearances) - 0.08 * spread, max(clearances) + 0.08 * spread
    items: list[Item] = [Limit(demanded, "demanded", is_vertical=True)]
    front = sorted((float(candidate["clearance_mm"]), float(candidate["cycle_s"])) for candidate in record["front"])
    if len(front) > 1:
        items.append(line(front, colour=ROBOTS[0], width=1.2))
    for candidate in candidates:
        colour = {"certified": ROBOTS[2], "rejected": LIMIT}.get(candidate["status"], GREY)
        items.append(PlotMark(float(candidate["clearance_mm"]), float(candidate["cycle_s"]), colour))
    axis = _cycle_axis([float(candidate["cycle_s"]) for candidate in candidates])
    return Figure(
        title="cycle against clearance",
        x=PlotAxis(low=low, high=high, label="clearance in mm", unit="mm"),
        panels=[PlotPanel(title=CYCLE, y=axis, items=items)],
        width=HALF,
        row=ROW,
    )


def convergence_figure(record: Record) -> Figure | None:
    """Cycle of every conforming trial and the best so far, trial after trial; None without any."""
    steps = [step for step in record["convergence"] if step["best_s"] is not None]
    if not steps:
        return None
    last = max(step["trial"] for step in record["convergence"])
    shown = [float(step[key]) for step in steps for key in ("cycle_s", "best_s") if step[key] is not None]
    tried = [step for step in steps if step["cycle_s"] is not None]
    items: list[Item] = [PlotMark(float(trial["trial"]), float(trial["cycle_s"]), GREY) for trial in tried]
    at = np.array([value for step in steps for value in (step["trial"] - 0.5, step["trial"] + 0.5)], dtype=float)
    items.append(PlotCurve("best so far", at, np.repeat([float(step["best_s"]) for step in steps], 2), ROBOTS[0]))
    return Figure(
        title="each trial (dots) and the best so far (line)",
        x=PlotAxis(low=-0.5, high=max(last, 1) + 0.5, label="trial"),
        panels=[PlotPanel(title=CYCLE, y=_cycle_axis(shown), items=items)],
        width=HALF,
        row=ROW,
    )


def _cycle_axis(cycles: list[float]) -> PlotAxis:
    """The axis of cycles; one cycle alone has room about it too."""
    if min(cycles) < max(cycles):
        return value_axis(min(cycles), max(cycles), unit="s")
    return PlotAxis(low=0.9 * cycles[0], high=1.1 * cycles[0], unit="s")


def _shown(record: Record) -> Entries:
    """Layouts of the figure, each once."""
    listed: dict[int, Any] = {}
    for candidate in (*record["front"], *record["top"]):
        listed.setdefault(candidate["trial"], candidate)
    return [candidate for candidate in listed.values() if candidate["status"] != "violating"]


def _extent(drawing: Record) -> tuple[Any, Any]:
    """Lowest and highest corner of the plan in [mm]."""
    points = [
        point for item in (*drawing["given"]["outlines"], *drawing["best"]["outlines"]) for point in item["outline_mm"]
    ]
    points += [[robot["x_mm"], robot["y_mm"]] for robot in (*drawing["given"]["robots"], *drawing["best"]["robots"])]
    swept = drawing["swept"]
    points += [[x, row[0]] for rows in swept["robots"].values() for row in rows for x in (row[1], row[2])]
    corners = np.array(points, dtype=float)
    return corners.min(axis=0) - BORDER, corners.max(axis=0) + BORDER


def _sweep(drawing: Record) -> Iterator[Item]:
    """What the links of each robot cover, in its colour."""
    half = 0.5 * drawing["swept"]["square_mm"]
    for index, rows in enumerate(drawing["swept"]["robots"].values()):
        for y, first, last in rows:
            yield PlotBox((first - half, last + half), (y - half, y + half), _colour(index), opacity=0.16)


def _reach(drawing: Record) -> Iterator[Item]:
    """The reach of each robot from its new base."""
    for index, robot in enumerate(drawing["best"]["robots"]):
        reach = drawing["reach_mm"][robot["name"]]
        circle = np.stack([robot["x_mm"] + reach * np.cos(CIRCLE), robot["y_mm"] + reach * np.sin(CIRCLE)], axis=1)
        yield line(circle, colour=_colour(index), width=0.6, is_dashed=True)


def _outlines(drawing: Record) -> Iterator[Item]:
    """Bodies of the best layout at the start, what stands of the given one, and the paths."""
    names = list(drawing["swept"]["robots"])
    for name, box in drawing["keep_out"].items():
        yield outline(box, colour=LIMIT, width=0.8, is_dashed=True)
        x, y = np.mean(box, axis=0).tolist()
        yield Note(x, y, name, LIMIT, size=7.0)
    for item in drawing["given"]["outlines"]:
        if item["is_at_rest"] and item["robot"]:
            yield outline(item["outline_mm"], colour=GREY, width=0.9, is_dashed=True)
    for item in drawing["best"]["outlines"]:
        colour = _colour(names.index(item["robot"])) if item["robot"] in names else INK
        width = 1.1 if item["is_at_rest"] or item["kind"] == "part" else 0.5
        yield outline(item["outline_mm"], colour=colour, width=width)
    for path in drawing["best"]["paths"]:
        yield line(path["points_mm"], colour=LIMIT, width=1.2)


def _bases(drawing: Record) -> Iterator[Item]:
    """Old and new bases with the move between them."""
    old = {robot["name"]: robot for robot in drawing["given"]["robots"]}
    for index, robot in enumerate(drawing["best"]["robots"]):
        colour, x, y, was = _colour(index), robot["x_mm"], robot["y_mm"], old[robot["name"]]
        yield line([[was["x_mm"], was["y_mm"]], [x, y]], colour=colour, width=1.4)
        yield PlotMark(was["x_mm"], was["y_mm"], PAPER, size=6.5, edge=colour)
        yield PlotMark(x, y, colour, size=6.5, edge=colour)
        yield Note(x, y, robot["name"], colour, size=8.5, is_bold=True, anchor="start", moved=(6.5, 9.0))


def _legend(drawing: Record) -> Iterator[LegendKey]:
    """What the colours and lines mean."""
    for index, robot in enumerate(drawing["best"]["robots"]):
        yield LegendKey(robot["name"], _colour(index))
    for text in (
        "filled dot: base of the best layout",
        "open dot: base as given",
        "shaded: swept by links and tools",
        "dashed circle: reach of the arm",
        "grey dashes: feet as given",
        "red: paths on the part at the start",
    ):
        yield LegendKey(text, ink=GREY)


def _colour(index: int) -> str:
    """Colour of a robot by its place in the cell."""
    return ROBOTS[index % len(ROBOTS)]


def layout_page(record: Record) -> str:
    """The page of a layout search."""
    figures = {"plan": floor_plan(record), "front": front_figure(record), "convergence": convergence_figure(record)}
    plots = {name: inline_svg(svg_text(figure)) for name, figure in figures.items() if figure is not None}
    return template("jobs/layout/layout.html").render(
        r=record,
        plots=plots,
        verdict=verdict_line(record),
        changed=changed_variables(record),
        path="" if record["path"] is None else path_text(record["path"]),
        caution=CAUTION,
    )


# Tables and files


def layout_files(record: Record) -> dict[str, bytes]:
    """Content of the files of a layout search by name."""
    return {"study.json": as_json(record).encode(), "study.html": layout_page(record).encode()}


def layout_tables(record: Record) -> Tables:
    """The tables of frames and notebooks."""
    forms = {
        "top": CandidateRecord,
        "front": CandidateRecord,
        "variables": VariableRecord,
        "binding": LimitRecord,
        "convergence": ProgressRecord,
        "choices": ChoiceRecord,
        "dropped": DroppedRecord,
    }
    return {name: listed_table(record, name, form) for name, form in forms.items()}


LAYOUT: Final = ResultKind(
    name="layout",
    title="Layout search",
    tables=layout_tables,
    shown={
        "top": ("trial", "status", "cycle_s", "margin_deg", "clearance_mm", "change"),
        "variables": ("name", "unit", "given", "best", "lower", "upper"),
    },
    pictures=lambda record: {
        "floor plan": floor_plan(record),
        "front": front_figure(record) if len(record["front"]) > 1 else None,
    },
    good=("certified",),
)
