"""A comparison as record, table, text, plots and page: what is shown, and in which order."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.jobs.compare.which_pays import sentences
from cellplan.model.report.report import CAUTION
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.plots.figure import (
    Figure,
    Item,
    Limit,
    Note,
    PlotAxis,
    PlotBox,
    PlotCurve,
    PlotPanel,
    time_axis,
    value_axis,
)
from cellplan.report.plots.palette import PAPER, ROBOTS
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Record, as_json
from cellplan.report.record.figures import KEY, SHOWN, csv_text
from cellplan.report.record.numbers import fixed, floored, seconds, small
from cellplan.report.record.rows import listed_table
from cellplan.study.trial import STATUS_TEXTS, TrialStatus

WORK: Final = tuple(f"work_{kind}_{part}" for kind in ("velocity", "acceleration") for part in ("ratio", "joint"))
LOADS: Final = ("positioner_load_s", "positioner_phase_load_s", "operator_load_s", "operator_work_load_s", "load_s")
SCHEMA: Final = "cellplan.study/1"
SINGLE: Final = (*KEY, *WORK, "mean_velocity_ratio", "energy_j", *LOADS)
MAX_SHOWN: Final = 30  # differing inputs, and letters of their values
MAX_FAILED: Final = 3  # failed checks of a variant
DASH: Final = "-"
Row = tuple[str, Callable[[Record], str]]
MAX_ROBOTS: Final = 8  # drawn: those whose joints are fastest
TOP: Final = 150.0  # [%] of a limit: what is above is cut off and its value written
PERCENT: Final = 100.0
BARS: Final = 0.8  # [-] of the place of a joint that its bars take
PLOT_TITLES: Final = {
    "joints": "range used and highest velocity of every joint; the limit is 100 %",
    "speeds": "highest joint velocity of each robot over time, as a percentage of its limit",
    "clearance": "smallest distance of all bodies over time",
}


# The record: study.json


def comparison_record(
    header: Mapping[str, Any], trials: Sequence[Record], differences: Mapping[str, Sequence[Any]]
) -> dict[str, Any]:
    """The record of a comparison: content of ``study.json``.

    Args:
        header: What it is about: of, cell, names, settings, task, inputs and versions.
        differences: Values in each cell or run, by key path.
    """
    variants: list[Any] = [{"name": name, **trial} for name, trial in zip(header["names"], trials, strict=True)]
    return {
        "schema": SCHEMA,
        "kind": "compare",
        **{key: header[key] for key in ("of", "cell", "settings", "task")},
        "sentences": sentences(variants),
        "differences": [{"key": key, "values": list(values)} for key, values in differences.items()],
        "counts": {str(status): sum(variant["status"] == status for variant in variants) for status in TrialStatus},
        "variants": variants,
        "inputs": header["inputs"],
        "versions": header["versions"],
    }


def comparison_table(record: Record) -> str:
    """The comparison as CSV: a row for each variant, with its status, its figures and the load of every robot."""
    robots = robot_names(record)
    loads_of = [f"load_s {robot}" for robot in robots]
    rows: list[list[Any]] = [["name", "status", *SINGLE, *loads_of, "not_in_program", "reason"]]
    for variant in record["variants"]:
        figures = variant["figures"]
        loads = [figures["robots"].get(robot, {}).get("load_s") if figures else None for robot in robots]
        left_out = "; ".join(figures.get("not_in_program", []))
        rows.append(
            [variant["name"], variant["status"], *map(figures.get, SINGLE), *loads, left_out, variant["reason"]]
        )
    return csv_text(rows)


def robot_names(record: Record) -> list[str]:
    """Robots of all variants with a motion, each once."""
    solved = [variant["figures"]["robots"] for variant in record["variants"] if variant["figures"]]
    return list(dict.fromkeys(name for robots in solved for name in robots))


# Text


def comparison_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a comparison."""
    variants = record["variants"]
    subject = "modes" if record["of"] == "modes" else "cells and runs"
    rows = [["", *(variant["name"] for variant in variants)], ["verdict", *map(_verdict, variants)]]
    rows += [
        [title, *(cell(variant["figures"]) if variant["figures"] else DASH for variant in variants)]
        for title, cell in ROWS
    ]
    rows += [
        [f"load of {robot}, s (share)", *(_robot(variant["figures"], robot) for variant in variants)]
        for robot in robot_names(record)
    ]
    lines = [f"{record['cell']}: {record['counts']['passed']} of {len(variants)} {subject} passed"]
    lines += [f"  {sentence}" for sentence in record["sentences"]]
    lines += list(_aligned(rows))
    lines += [
        f"  {variant['name']}: FAILED {message}"
        for variant in variants
        for message in variant["figures"].get("failed", [])[:MAX_FAILED]
    ]
    lines += _differences(record)
    return [*lines, f"report: {folder / 'study.html'}", f"table: {folder / 'study.csv'}"]


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Rows as a table, the first column to the left."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for first, *others in rows:
        cells = [cell.rjust(width) for cell, width in zip(others, widths[1:], strict=True)]
        yield f"  {first.ljust(widths[0])}  {'  '.join(cells)}".rstrip()


def _verdict(variant: Record) -> str:
    """The verdict in a word or two."""
    if variant["status"] == "failed":
        return f"FAILED ({variant['figures']['failed_checks']})"
    return str(variant["status"]).replace("_", " ")


def _differences(record: Record) -> list[str]:
    differences = record["differences"]
    if record["of"] == "modes":
        return []
    rows = [[difference["key"], *map(short_value, difference["values"])] for difference in differences[:MAX_SHOWN]]
    lines = [f"  {line.strip()}" for line in _aligned(rows)] if rows else ["  none"]
    more = [f"    and {len(differences) - MAX_SHOWN} more in study.json"] if len(differences) > MAX_SHOWN else []
    return ["  inputs that differ:", *(f"  {line}" for line in lines), *more]


def short_value(value: Any) -> str:
    """An input, cut off where it is long; a dash for none."""
    text = DASH if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= MAX_SHOWN else f"{text[: MAX_SHOWN - 1]}…"


def _robot(figures: Record, robot: str) -> str:
    """Load and share of a robot."""
    robot_figures = figures["robots"].get(robot) if figures else None
    return f"{robot_figures['load_s']:.3g} ({100.0 * robot_figures['motion_share']:.0f} %)" if robot_figures else DASH


def _of_joint(key: str, scale: float, *, form: Callable[[float], str] = "{:.1f}".format) -> Callable[[Record], str]:
    """A figure and its joint."""
    joint = key.replace("_ratio", "_joint").replace("_deg", "_joint")
    return lambda figures: (
        DASH if figures[key] is None else f"{form(scale * figures[key])} {figures[joint].replace('/', ' ')}"
    )


def _plain(key: str, form: Callable[[float], str]) -> Callable[[Record], str]:
    """A figure by itself."""
    return lambda figures: DASH if figures[key] is None else form(figures[key])


def _clearance(figures: Record) -> str:
    """The smallest clearance, and whether it is proved."""
    value = figures["min_clearance_mm"]
    return (
        DASH if value is None else f"{floored(value)}{'' if figures['min_clearance_certified'] else ' not certified'}"
    )


ROWS: Final[Sequence[Row]] = (
    ("cycle time, s", _plain("cycle_time_s", seconds)),
    ("moves not in the program", lambda figures: "left out" if figures["not_in_program"] else "none"),
    ("smallest margin, deg", _of_joint("min_margin_deg", 1.0, form=floored)),
    ("highest velocity, % of limit", _of_joint("max_velocity_ratio", 100.0)),
    ("highest acceleration, % of limit", _of_joint("max_acceleration_ratio", 100.0)),
    ("the same at work, velocity", _of_joint("work_velocity_ratio", 100.0)),
    ("the same at work, acceleration", _of_joint("work_acceleration_ratio", 100.0)),
    ("smallest clearance, mm", _clearance),
    ("largest position error, mm", _plain("max_position_error_mm", small)),
    ("largest orientation error, deg", _plain("max_orientation_error_deg", small)),
    ("highest tool speed, mm/s", _plain("max_tool_speed_mm_s", "{:.0f}".format)),
    ("work of the drives, J", lambda figures: SHOWN["energy_j"].page(figures.get("energy_j"))),
    ("mean velocity, % of limit", _plain("mean_velocity_ratio", lambda ratio: f"{100.0 * ratio:.2g}")),
    ("load of all robots, s", _plain("load_s", "{:.3g}".format)),
    ("positioner in its hardest phase, s", _plain("positioner_phase_load_s", "{:.3g}".format)),
    ("operators at work, s", _plain("operator_work_load_s", "{:.3g}".format)),
)


# Plots and page


def comparison_figures(record: Record, curves: Sequence[Record | None]) -> dict[str, Figure]:
    """The figures of a comparison by name from the curves of each variant, None for one without a motion."""
    solved_variants = [
        {**variant["figures"], "name": variant["name"], "curves": its}
        for variant, its in zip(record["variants"], curves, strict=True)
        if its
    ]
    solved: dict[str, Any] = dict(zip(ROBOTS, solved_variants, strict=False))
    robots = plotted_robots(record)
    if not solved or not robots:
        return {}
    figures = {"joints": _joints(solved, robots), "speeds": _speed_figure(solved, robots)}
    if any(variant["curves"]["clearance_mm"] for variant in solved.values()):
        figures["clearance"] = _distances(solved)
    return figures


def plotted_robots(record: Record) -> list[str]:
    """Robots that are drawn, in their order."""
    names = robot_names(record)
    hardest = sorted(names, key=lambda name: -_peak(record, name))[:MAX_ROBOTS]
    return [name for name in names if name in hardest]


def _peak(record: Record, robot: str) -> float:
    """Highest joint speed of a robot in any variant, as a fraction of its limit."""
    uses = [variant["figures"]["robots"].get(robot) for variant in record["variants"] if variant["figures"]]
    return max((joint["velocity_ratio"] or 0.0 for use in uses if use for joint in use["joints"].values()), default=0.0)


def _joints(solved: Mapping[str, Any], robots: Sequence[str]) -> Figure:
    """Bars of every joint: range used and highest speed."""
    uses = {robot: {colour: variant["robots"].get(robot) for colour, variant in solved.items()} for robot in robots}
    count = max(len(use["joints"]) for joint_uses in uses.values() for use in joint_uses.values() if use)
    panels = [
        _bars(f"{robot}: {text}", {colour: _percent(use, key) for colour, use in joint_uses.items()})
        for robot, joint_uses in uses.items()
        for key, text in (
            ("range_ratio", "range used, in % of the limit"),
            ("velocity_ratio", "highest velocity, in % of its limit"),
        )
    ]
    x = PlotAxis(low=0.4, high=count + 0.6, label="joint, counted from the base")
    return Figure(title="use of the joints", x=x, panels=panels, columns=2)


def _percent(use: Record | None, key: str) -> list[float]:
    """A ratio of each joint, in [%]."""
    return [PERCENT * (joint[key] or 0.0) for joint in use["joints"].values()] if use else []


def _bars(title: str, values: Mapping[str, Sequence[float]]) -> PlotPanel:
    """Bars side by side at each joint; the value of one that is cut off stands on it."""
    top = min(TOP, max(105.0, *(max(bars, default=0.0) for bars in values.values())))
    axis, width = value_axis(0.0, top, unit="%", is_floored=True), BARS / len(values)
    items: list[Item] = [Limit(PERCENT)]
    for place, (colour, bars) in enumerate(values.items()):
        for joint, value in enumerate(bars, start=1):
            left = joint - 0.5 * BARS + place * width
            items.append(PlotBox((left, left + width), (0.0, min(value, top)), colour))
            if value > top:
                items.append(Note(left + 0.5 * width, top, f"{value:.0f}", PAPER, size=6.0, moved=(0.0, -6.0)))
    return PlotPanel(title=title, y=axis, items=items)


def _speed_figure(solved: Mapping[str, Any], robots: Sequence[str]) -> Figure:
    """Highest joint speed of every robot over time."""
    end = max(variant["cycle_time_s"] for variant in solved.values())
    title = "highest joint velocity of each robot over time, in % of the limit"
    panels = [_speed_panel(solved, robot) for robot in robots]
    return Figure(title=title, x=time_axis(np.array([0.0, end])), panels=panels, columns=2)


def _speed_panel(solved: Mapping[str, Any], robot: str) -> PlotPanel:
    """Highest joint speed of one robot in every variant."""
    curves = {
        colour: (
            variant["name"],
            variant["curves"]["times_s"],
            PERCENT * np.array(variant["curves"]["velocity_ratio"][robot]),
        )
        for colour, variant in solved.items()
        if robot in variant["curves"]["velocity_ratio"]
    }
    highest = max(float(values.max()) for _, _, values in curves.values())
    top = min(TOP, highest)
    items: list[Item] = [Limit(PERCENT)] if top > PERCENT else []
    items += [
        PlotCurve(name, np.array(times), np.minimum(values, top), colour)
        for colour, (name, times, values) in curves.items()
    ]
    note = f"up to {highest:.0f} %" if highest > TOP else ""
    return PlotPanel(title=robot, note=note, y=value_axis(0.0, top, unit="%", is_floored=True), items=items)


def _distances(solved: Mapping[str, Any]) -> Figure:
    """Smallest distance of all bodies over time."""
    curves = {
        colour: (
            variant["name"],
            np.array(variant["curves"]["clearance_times_s"]),
            np.array(variant["curves"]["clearance_mm"]),
        )
        for colour, variant in solved.items()
        if variant["curves"]["clearance_mm"]
    }
    end = max(variant["cycle_time_s"] for variant in solved.values())
    required = {variant["required_clearance_mm"] for variant in solved.values()}
    highest = max(float(values.max()) for _, _, values in curves.values())
    items: list[Item] = []
    if len(required) == 1:
        items.append(Limit(max(required), f"required: {max(required):g} mm", is_upper=False))
    items += [PlotCurve(name, times, values, colour) for colour, (name, times, values) in curves.items()]
    axis = value_axis(0.0, max(highest, *required), unit="mm", is_floored=True)
    title = "smallest distance of all bodies over time, certified between the rows"
    panel = PlotPanel(title="distance, in mm", y=axis, items=items)
    return Figure(title=title, x=time_axis(np.array([0.0, end])), panels=[panel])


def comparison_page(record: Record, plots: Mapping[str, str]) -> str:
    """The page of a comparison with its plots as SVG, by name."""
    solved = [variant["name"] for variant in record["variants"] if variant["figures"]]
    robots = robot_names(record)
    return template("jobs/compare/comparison.html").render(
        r=record,
        robots=robots,
        tasks=list(
            dict.fromkeys(name for variant in record["variants"] for name in variant["figures"].get("tasks", {}))
        ),
        plots={name: inline_svg(text) for name, text in plots.items()},
        titles=PLOT_TITLES,
        legend=list(zip(ROBOTS, solved, strict=False)) if plots else [],
        drawn=plotted_robots(record) if len(robots) > MAX_ROBOTS else [],
        statuses=STATUS_TEXTS,
        short=short_value,
        fixed=fixed,
        floored=floored,
        small=small,
        caution=CAUTION,
    )


# Files


def comparison_files(
    record: Record, curves: Sequence[Record | None], formats: Collection[str] = ()
) -> dict[str, bytes]:
    """Content of the files of a comparison by name; the curves are None for a variant without a motion."""
    plots = {f"study-{name}": data for name, data in pictures(comparison_figures(record, curves), formats).items()}
    drawings = {
        name.removeprefix("study-").removesuffix(".svg"): data.decode()
        for name, data in plots.items()
        if name.endswith(".svg")
    }
    return {
        "study.json": as_json(record).encode(),
        "study.csv": comparison_table(record).encode(),
        **plots,
        "study.html": comparison_page(record, drawings).encode(),
    }


COMPARISON: Final = ResultKind(
    name="comparison",
    title="Comparison",
    tables=lambda record: {
        "variants": listed_table(record, "variants", names=("name", "trial", "status", *KEY)),
        "differences": listed_table(record, "differences", names=("key", "values")),
    },
    shown={"variants": ("name", "status", "cycle_time_s", "min_margin_deg", "min_clearance_mm", "load_s")},
)
