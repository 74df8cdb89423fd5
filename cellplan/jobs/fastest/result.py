"""The shortest cycles of a cell as record, text, page, plots and tables: what is shown, and in which order."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.files.cell.changes import plain_values
from cellplan.files.cell.write import render_cell
from cellplan.files.run.folder import RunFolder
from cellplan.files.yaml.writer import flow_text
from cellplan.jobs.fastest.demand import MetDemand
from cellplan.jobs.fastest.shortest import ShortestCycles
from cellplan.jobs.fastest.timed_program import BINDS, TimedProgram
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import CAUTION
from cellplan.report.page.figures import figure
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.plots.figure import Figure, Item, Limit, PlotAxis, PlotCurve, PlotMark, PlotPanel, value_axis
from cellplan.report.plots.palette import INK, ROBOTS
from cellplan.report.plots.svg import inline_svg, svg_text
from cellplan.report.record.common import Number, Record, as_json, number
from cellplan.report.record.figures import (
    LOAD,
    SHOWN,
    UNKNOWN,
    Figures,
    csv_text,
    page_cells,
    page_headings,
    terminal_table,
)
from cellplan.report.record.rows import by_name, columns_of, flat
from cellplan.report.record.sections.tasks import greatest_feed_record
from cellplan.report.text.run import feed_rows
from cellplan.runs.write_run import versions, write_run

SCHEMA: Final = "cellplan.fastest/1"
TITLES: Final = {
    "as_written": "as written",
    "time_laws": "by its time laws",
    "common_speed": "by the best common speed",
    "reduced_speed": "with no tool faster than 250 mm/s",
    "demand": "for the demand",
}
COLOURS: Final = dict(zip(TITLES, (INK, ROBOTS[0], ROBOTS[1], ROBOTS[3], ROBOTS[2]), strict=True))
SAVED: Final = {
    "max_velocity_ratio": "joint velocity",
    "max_acceleration_ratio": "joint acceleration",
    "max_tool_speed_mm_s": "tool speed",
    "energy_proxy_s": "energy proxy",
    "energy_j": "work",
}  # what a demand saves
# fmt: off
ON_TERMINAL: Final = (
    "cycle_time_s", "parts_per_h", "max_velocity_ratio", "max_acceleration_ratio", "max_tool_speed_mm_s",
    "energy_proxy_s", "min_margin_deg",
)
ON_PAGE: Final = (
    "cycle_time_s", "parts_per_h", "max_velocity_ratio", "max_velocity_joint", "max_acceleration_ratio",
    "max_acceleration_joint", "max_tool_speed_mm_s", "energy_proxy_s", "energy_j", "min_margin_deg", "min_margin_joint",
)
# fmt: on
PLOTTED: Final = (*SAVED, "min_margin_deg", "parts_per_h")
NARROW: Final = 4.6  # [inch] of a plot: readable on a telephone too


# The record: fastest.json


def fastest_record(cycles: ShortestCycles) -> dict[str, Any]:
    """The shortest cycles in printed units: content of ``fastest.json``."""
    cell, written = cycles.by_time_laws.solution.cell, cycles.as_written.cycle
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "status": "passed" if cycles.passed else "failed",
        "written_s": number(written),
        "as_written": cycles.as_written.figures.record(LOAD),
        "cycles": {name: _program(program, written) for name, program in cycles.programs.items() if name != "demand"},
        "remark": cycles.remark,
        "curve": [
            {
                "law": str(point.law),
                "settings": plain_values(point.values),
                "figures": dict(point.figures),
                "reason": point.reason,
            }
            for point in cycles.curve
        ],
        "demand": None if cycles.demand is None else _demand(cycles, cycles.demand),
        "inputs": dict(cell.inputs),
        "versions": versions(),
    }


def _program(program: TimedProgram, written: float) -> dict[str, Any]:
    """One program: its cycle in [s], what binds, its load, and its verdict."""
    settings, figures = plain_values(program.values), program.figures
    failed = [check.message for run in program.solution.runs for check in run.report.checks if not check.passed]
    return {
        "law": str(program.law),
        "cycle_s": number(program.cycle),
        "share_of_written": number(program.cycle / written),
        "settings": settings,
        "options": [f"{address}={flow_text(value)}" for address, value in settings.items()],
        "binding": [
            {
                "phase": binding.phase,
                "robot": binding.robot,
                "joint": binding.joint,
                "limit": binding.kind,
                "percent": number(100.0 * binding.share),
                "time_percent": number(100.0 * binding.time_share),
                "text": binding.text,
            }
            for binding in program.bindings
        ],
        "greatest_feeds": {
            feed.task: greatest_feed_record(feed) for run in program.solution.runs for feed in run.report.greatest_feeds
        },
        "figures": figures.record(LOAD),
        "status": "failed" if failed else "passed",
        "robots": _robots(figures),
        "largest_position_error_mm": figures.recorded("max_position_error_mm"),
        "largest_orientation_error_deg": figures.recorded("max_orientation_error_deg"),
        "smallest_clearance_mm": figures.recorded("min_clearance_mm"),
        "failed": failed,
    }


def _robots(figures: Figures) -> dict[str, dict[str, Any]]:
    """Speeds of each robot in the world: of its tool tip, and of the fastest point on an axis of a joint."""
    axes = figures.of("max_axis_speed_mm_s")
    robots = {}
    for robot, tip in figures.of("max_tool_speed_mm_s").items():
        fastest = max((axis for axis in axes if axis.startswith(f"{robot}/")), key=axes.__getitem__)
        robots[robot] = {
            "tool_peak_mm_s": number(1e3 * tip),
            "share_above_250_mm_s": number(figures.of("share_above_250_mm_s")[robot]),
            "axis_peak_mm_s": number(1e3 * axes[fastest]),
            "axis": fastest.partition("/")[2],
        }
    return robots


def _demand(cycles: ShortestCycles, demand: MetDemand) -> dict[str, Any]:
    """The demand, its program and the shares that it saves of others."""
    program = demand.program
    shortest = min(cycles.by_time_laws, cycles.by_common_speed, key=lambda other: other.cycle)
    return {
        "parts_per_h": number(demand.per_hour),
        "allowed_cycle_s": number(demand.allowed),
        "idle_s": number(max(0.0, round(demand.allowed - program.cycle, 9))),
        "program": _program(program, cycles.as_written.cycle),
        "saving_against_shortest": _savings(program.figures, shortest.figures),
        "saving_against_written": _savings(program.figures, cycles.as_written.figures),
    }


def _savings(figures: Figures, other: Figures) -> dict[str, Number]:
    """Shares by which a load is below another one; None where there is none."""
    pairs = {key: (figures.recorded(key), other.recorded(key)) for key in SAVED}
    return {
        key: number(1.0 - now / before) if before and now is not None else None for key, (now, before) in pairs.items()
    }


# What is taken out of it


def _curves(record: Record) -> dict[str, list[Record]]:
    """Figures of the points of the production curve that have a program, by law."""
    curves: dict[str, list[Record]] = {}
    for point in record["curve"]:
        if point["figures"]:
            curves.setdefault(point["law"], []).append(point["figures"])
    return curves


def _marked(record: Record, *, is_plotted: bool = False) -> dict[str, Record]:
    """Figures of the programs beside the curve: as written, at reduced speed, and that of the demand.

    A plot leaves one at reduced speed out that is the one of another law.
    """
    marked = {"as_written": record["as_written"]}
    reduced = record["cycles"].get("reduced_speed")
    if reduced and (reduced["law"] == "reduced_speed" or not is_plotted):
        marked["reduced_speed"] = record["cycles"]["reduced_speed"]["figures"]
    if record["demand"]:
        marked["demand"] = record["demand"]["program"]["figures"]
    return marked


def _saving_text(record: Record) -> str:
    """What a demand saves or costs, such as ``joint velocity 50 % less``."""
    known = [(title, record[key]) for key, title in SAVED.items() if record[key] is not None]
    return ", ".join(f"{title} {abs(100.0 * it):.3g} % {'less' if it >= 0.0 else 'more'}" for title, it in known)


def _binding_lines(program: Record) -> list[str]:
    """What binds each phase of a program or comes nearest to it, or how near its joints come where nothing does."""
    binding, figures = program["binding"], program["figures"]
    if max(joint["percent"] for joint in binding) >= 100.0 * BINDS:
        return [joint["text"] if len(binding) == 1 else f"phase {joint['phase']}: {joint['text']}" for joint in binding]
    shares = ((figures[f"max_{it}_ratio"], figures[f"max_{it}_joint"], it) for it in ("velocity", "acceleration"))
    reached = [f"{100.0 * share:.3g} % of a limit of {kind} ({joint})" for share, joint, kind in shares if share]
    return [f"nothing binds: joints reach {', '.join(reached)}"]


# Text


def fastest_lines(record: Record) -> list[str]:
    """All lines on the terminal."""
    lines = [f"{record['cell']}: {record['status']}", f"  as written: {record['written_s']:g} s"]
    for name, program in record["cycles"].items():
        lines += _program_lines(TITLES[name], program)
        if name == "time_laws" and max(joint["percent"] for joint in program["binding"]) < 100.0 * BINDS:
            lines.append(
                "    none is shorter: a step less (motion.step_s) breaks a limit, or leaves a task too few steps"
            )
    if record["remark"]:
        lines.append(f"  {TITLES['reduced_speed']}: no program: {record['remark']}")
    if record["demand"]:
        lines += _demand_lines(record["demand"])
    return [*lines, *_curve_lines(record)]


def _program_lines(title: str, program: Record) -> Iterator[str]:
    """One program: its cycle, what binds, speeds, errors, clearance and failed checks."""
    yield f"  {title}: {program['cycle_s']:g} s, {100.0 * program['share_of_written']:.3g} % of the written time"
    yield from (f"    {line}" for line in _binding_lines(program))
    yield from (f"    {label} {value}, {where}" for label, value, where in feed_rows(program["greatest_feeds"]))
    figures, clearance = program["figures"], program["smallest_clearance_mm"]
    distance = "nothing to keep clear of" if clearance is None else f"smallest clearance {clearance:.4g} mm"
    yield (
        f"    largest tool error {program['largest_position_error_mm']:.2g} mm, "
        f"{program['largest_orientation_error_deg']:.2g} deg; {distance}"
    )
    above = figures["share_above_250_mm_s"]
    share = f"for {100.0 * above:.3g} % of the time ({figures['share_above_250_robot']})" if above else "never"
    yield (
        f"    tools up to {figures['max_tool_speed_mm_s']:.4g} mm/s ({figures['max_tool_speed_robot']}), "
        f"above 250 mm/s {share}; "
        f"axes up to {figures['max_axis_speed_mm_s']:.4g} mm/s ({figures['max_axis_speed_joint']})"
    )
    work = figures["energy_j"]
    yield f"    work of the drives {UNKNOWN if work is None else f'{work:.4g} J'}"
    yield from (f"    FAILED {message}" for message in program["failed"])


def _demand_lines(demand: Record) -> Iterator[str]:
    """The calmest program that meets the demand."""
    program = demand["program"]
    yield f"  demand {demand['parts_per_h']:g}/h, a part in {demand['allowed_cycle_s']:g} s at most; calmest program:"
    yield from (f"  {line}" for line in _program_lines(TITLES[program["law"]], program))
    if demand["idle_s"]:
        yield (
            f"    the robots wait for {demand['idle_s']:g} s of each cycle: a longer motion would save next to nothing"
        )
    options = " ".join(f"--set '{option}'" for option in program["options"])
    yield f"    gives it: cellplan solve {options}"
    yield f"    against the shortest cycle: {_saving_text(demand['saving_against_shortest'])}"
    yield f"    against the program as written: {_saving_text(demand['saving_against_written'])}"


def _curve_lines(record: Record) -> Iterator[str]:
    """The production curve as a table for each law; nothing where it has no calmer cycle."""
    points, laws = record["curve"], dict.fromkeys(point["law"] for point in record["curve"])
    if len(points) <= len(laws):
        return
    for law in laws:
        yield f"  production curve {TITLES[law]}"
        listed = [point for point in points if point["law"] == law]
        yield from terminal_table(ON_TERMINAL, (point["figures"] for point in listed if point["figures"]), "    ")
        yield from (f"    {point['reason']}" for point in listed if point["reason"])


# Plots and page


def curve_figures(record: Record) -> dict[str, Figure]:
    """A plot over the cycle time for each quantity; none where there is no calmer cycle."""
    curves, marked = _curves(record), _marked(record, is_plotted=True)
    cycles = [point["cycle_time_s"] for points in curves.values() for point in points]
    if len(set(cycles)) < 2:
        return {}
    if "demand" in marked:
        cycles.append(marked["demand"]["cycle_time_s"])
    x = PlotAxis(low=min(cycles), high=max(cycles), label="cycle time in s", unit="s")
    seen = {name: one for name, one in marked.items() if x.low <= one["cycle_time_s"] <= x.high}
    panels = {key: _panel(key, curves, seen) for key in PLOTTED}
    return {key: Figure(title="", x=x, panels=[it], width=NARROW) for key, it in panels.items() if it is not None}


def _panel(key: str, curves: Mapping[str, list[Record]], marked: Mapping[str, Record]) -> PlotPanel | None:
    """Limit, curves and single programs of one quantity; None where no program has it."""
    shown = SHOWN[key]
    items: list[Item] = [] if shown.limit is None else [Limit(shown.limit, shown.limit_name, is_shaded=False)]
    values = []
    for law, points in [*curves.items(), *((law, [point]) for law, point in marked.items())]:
        pairs = [(point["cycle_time_s"], shown.percent * point[key]) for point in points if point[key] is not None]
        if law in curves and pairs:
            at_s, heights = np.array(pairs).T
            items.append(PlotCurve(law, at_s, heights, COLOURS[law]))
        items += [PlotMark(at_one, value, COLOURS[law]) for at_one, value in pairs]
        values += [value for _, value in pairs]
    if not values:
        return None
    axis = value_axis(min(0.0, *values), max(*values, shown.limit or 0.0), is_floored=True)
    return PlotPanel(title=shown.plot, y=axis, items=items)


def fastest_page(record: Record) -> str:
    """The page of the shortest cycles."""
    figures = curve_figures(record)
    programs = dict(record["cycles"])
    if record["demand"]:
        programs["demand"] = record["demand"]["program"]
    return template("jobs/fastest/fastest.html").render(
        r=record,
        figures=[_cycle_figure(TITLES[name], program) for name, program in programs.items()],
        programs=programs,
        titles=TITLES,
        colours=COLOURS,
        plots=[(SHOWN[key].plot, inline_svg(svg_text(one))) for key, one in figures.items()],
        legend=[*_curves(record), *_marked(record, is_plotted=True)] if figures else [],
        saving=_saving_text,
        binding=_binding_lines,
        headings=page_headings(ON_PAGE),
        cells=lambda figures: page_cells(ON_PAGE, figures),
        caution=CAUTION,
    )


def _cycle_figure(title: str, program: Record) -> dict[str, Any]:
    """A cycle time at the top of the page."""
    per_hour, binding = f"{program['figures']['parts_per_h']:.1f} parts per hour", _binding_lines(program)
    note = f"{per_hour}; {binding[0]}" if len(binding) == 1 else per_hour
    return figure(title, f"{program['cycle_s']:g}", "s", note=note, is_bad=program["status"] != "passed")


# Files


def curve_table(record: Record) -> str:
    """The production curve as CSV: a row for each cycle, those as written, at reduced speed and of the demand too."""
    marked = _marked(record)
    rows = [("as_written", marked.pop("as_written"))]
    rows += [(law, figures) for law, points in _curves(record).items() for figures in points]
    return csv_text([["law", *LOAD], *([law, *map(figures.get, LOAD)] for law, figures in [*rows, *marked.items()])])


def write_fastest(cycles: ShortestCycles, folder: Path, *, progress: Progress = silent) -> Record:
    """Write the shortest cycles into a folder, which appears whole or not at all.

    It holds ``fastest.json``, ``fastest.html``, ``curve.csv``, a run folder for every program by its name, and for a
    demand ``demand.yaml``: the cell of which ``cellplan solve`` gives that program. It names files as the cell does, so
    it loads from the folder of that cell.

    Args:
        cycles: As ``fastest`` returns it.
        folder: The folder; an earlier one is replaced.
        progress: Called with the stage and the fraction done.

    Returns:
        The record in ``fastest.json``.

    Raises:
        InputError: The folder cannot be written, or holds something that cellplan did not write.
    """
    record = fastest_record(cycles)
    with RunFolder(folder) as target:
        target.write_text("fastest.json", as_json(record))
        target.write_text("fastest.html", fastest_page(record))
        target.write_text("curve.csv", curve_table(record))
        if cycles.demand is not None:
            target.write_text("demand.yaml", render_cell(cycles.demand.program.solution.cell))
        for name, program in cycles.programs.items():
            write_run(program.solution, target.within(name), progress=progress)
    return record


FASTEST: Final = ResultKind(
    name="fastest",
    title="Shortest cycles",
    file="fastest.json",
    made_of=ShortestCycles,
    record=fastest_record,
    tables=lambda record: {
        "curve": lambda: columns_of(map(flat, record["curve"]), ["law"]),
        "cycles": lambda: columns_of(by_name(record["cycles"], "name")),
    },
    shown={"cycles": ("name", "status", "cycle_s", "share_of_written", "smallest_clearance_mm")},
    pictures=lambda record: {key: it for key, it in curve_figures(record).items() if key == "max_velocity_ratio"},
)
