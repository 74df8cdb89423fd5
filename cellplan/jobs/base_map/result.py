"""The map of a base as record, text, picture and page: what is shown, and in which order."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import numpy as np

from cellplan.files.cell.changes import plain_values
from cellplan.files.yaml.writer import flow_text
from cellplan.model.report.report import CAUTION
from cellplan.model.units import DEG, MM, joint_unit
from cellplan.report.page.kind import ResultKind
from cellplan.report.page.render import template
from cellplan.report.plots.figure import (
    Figure,
    Item,
    LegendKey,
    Note,
    PlotAxis,
    PlotBox,
    PlotMark,
    PlotPanel,
    line,
    outline,
)
from cellplan.report.plots.palette import INK, LIMIT, PAPER, ROBOTS
from cellplan.report.plots.rendering import pictures
from cellplan.report.plots.svg import inline_svg
from cellplan.report.record.common import Record, as_json, number
from cellplan.report.record.rows import listed_table
from cellplan.search.base_map.verdicts import MapJob, PlaceVerdict, Verdict, counts

SCHEMA: Final = "cellplan.map/1"
FINE: Final = 6  # decimals of figures: far below what 65 nodes are good for, far above rounding
START: Final = 9  # decimals of start postures: far below the tolerance of any task
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


# The record: map.json


def map_record(
    jobs: Sequence[MapJob],
    verdicts: Sequence[PlaceVerdict],
    *,
    best: Sequence[tuple[int, Mapping[str, Any]]],
    certified: Sequence[Mapping[str, Any]],
    drawing: Mapping[str, Any],
    versions: Mapping[str, str],
) -> Record:
    """The map in printed units.

    Args:
        best: The best places with their settings, best first.
        certified: What came of the first of them when they were solved.
    """
    job = jobs[0]
    cell, places = job.scene.cell, job.places
    base = cell.robot(job.robot).X_WB
    listed = []
    for rank, (place, settings) in enumerate(best):
        options = [f"{address}={flow_text(value)}" for address, value in plain_values(settings).items()]
        outcome = certified[rank] if rank < len(certified) else None
        listed.append({"place": place, "settings": plain_values(settings), "options": options, "certified": outcome})
    return {
        "schema": SCHEMA,
        "cell": cell.name,
        "robot": job.robot,
        "phases": [phase.name for phase in jobs if phase.name],
        "duration_s": number(sum(float(phase.job.times[-1]) for phase in jobs)),
        "present": {
            "x_mm": number(MM * base[0, 3]),
            "y_mm": number(MM * base[1, 3]),
            "z_mm": number(MM * base[2, 3]),
            "yaw_deg": number(DEG * float(np.arctan2(base[1, 0], base[0, 0]))),
        },
        "x_mm": [number(x) for x in places.x.tolist()],
        "y_mm": [number(y) for y in places.y.tolist()],
        "counts": {str(verdict): count for verdict, count in counts(verdicts).items()},
        "best": listed,
        "places": [_place(jobs, verdict, place) for place, verdict in enumerate(verdicts)],
        "drawing": dict(drawing),
        "inputs": dict(cell.inputs),
        "versions": dict(versions),
    }


def _place(jobs: Sequence[MapJob], verdict: PlaceVerdict, place: int) -> dict[str, Any]:
    job, places = jobs[verdict.phase], jobs[0].places
    reason = _reason(job, verdict)
    return {
        "x_mm": number(MM * places.X_WB[place, 0, 3]),
        "y_mm": number(MM * places.X_WB[place, 1, 3]),
        "yaw_deg": number(round(DEG * places.yaw[place], FINE)),
        "verdict": str(verdict.verdict),
        "reason": f"{job.name}: {reason}" if job.name and reason else reason,
        "start": _start(jobs, verdict),
        "figures": _figures(job, verdict),
    }


def _start(jobs: Sequence[MapJob], verdict: PlaceVerdict) -> list[float] | None:
    """Start posture of the robot in [deg], of sliding joints in [mm]; None where there is none."""
    first = next(phase for phase, job in enumerate(jobs) if job.works)
    start = verdict.starts[first] if verdict.starts else verdict.start
    if start is None:
        return None
    job = jobs[0]
    joints = job.scene.cell.robot(job.robot).model.joints
    scales = [joint_unit(is_revolute=joint.is_revolute).scale for joint in joints]
    return [round(scale * value, START) + 0.0 for scale, value in zip(scales, start.tolist(), strict=True)]


def _figures(job: MapJob, verdict: PlaceVerdict) -> dict[str, Any]:
    """Figures of a place; none where there is no motion."""
    if verdict.cycle is None or verdict.speed is None or verdict.acceleration is None or verdict.fast is None:
        return {}
    value, unit = (None, "") if verdict.joint is None else _margin(job, verdict)
    return {
        "cycle_s": round(verdict.cycle, FINE),
        "margin": None if value is None else round(value, FINE),
        "margin_unit": unit,
        "margin_joint": "/".join(verdict.joint or ()),
        "max_velocity_ratio": round(verdict.speed, FINE),
        "max_acceleration_ratio": round(verdict.acceleration, FINE),
        "fastest_joint": "/".join(verdict.fast),
    }


def _margin(job: MapJob, verdict: PlaceVerdict) -> tuple[float, str]:
    """Smallest distance of the joint that leaves least from its limits, and its unit."""
    robot, name = verdict.joint or ("", "")
    joint = next(joint for joint in job.scene.cell.robot(robot).model.joints if joint.name == name)
    unit = joint_unit(is_revolute=joint.is_revolute)
    return unit.scale * (verdict.margin or 0.0), unit.name


def _reason(job: MapJob, verdict: PlaceVerdict) -> str:
    """Why a place does not pass; empty where it does."""
    if verdict.verdict is Verdict.OUT_OF_REACH:
        if verdict.start is None:
            return "no start posture reaches the path"
        return f"a tool loses its path at {verdict.lost_at:.3g} s"
    if verdict.verdict is Verdict.LIMIT:
        value, unit = _margin(job, verdict)
        where = " at the start" if verdict.cycle is None else ""
        return f"{'/'.join(verdict.joint or ())} is {-value:.3g} {unit} beyond its limit{where}"
    if verdict.verdict is Verdict.SPEED:
        speed, rate = verdict.speed or 0.0, verdict.acceleration or 0.0
        what = "speed" if speed >= np.sqrt(rate) else "acceleration"
        share = 100.0 * (speed if what == "speed" else rate)
        return f"{'/'.join(verdict.fast or ())} at {share:.4g} % of its {what} limit"
    if verdict.verdict is Verdict.COLLISION and verdict.pair is not None:
        distance = MM * (verdict.distance or 0.0)
        how = f"{distance:.3g} mm apart" if distance > 0.0 else f"{-distance:.3g} mm into each other"
        return f"{verdict.pair[0]} and {verdict.pair[1]} {how} at {verdict.at or 0.0:.3g} s"
    return verdict.reason


# Text


def map_lines(record: Record, folder: Path) -> list[str]:
    """All lines about a map."""
    counts = record["counts"]
    others = ", ".join(
        f"{count} {verdict.replace('_', ' ')}" for verdict, count in counts.items() if verdict != "passes"
    )
    lines = [
        f"{record['cell']}, {record['robot']}: {counts['passes']} of {len(record['places'])} places pass; {others}"
    ]
    if record["phases"]:
        lines.append(
            f"  in {len(record['phases'])} phases of work; transfers and homes are judged where a place is solved: "
            "--certify N"
        )
    for place_of_base in record["best"][:1]:
        place = record["places"][place_of_base["place"]]
        figures, options = place["figures"], " ".join(f"--set '{option}'" for option in place_of_base["options"])
        margin = "no joint with limits"
        if figures["margin"] is not None:
            margin = f"margin {figures['margin']:.1f} {figures['margin_unit']} ({figures['margin_joint']})"
        lines += [
            f"  best: x {place['x_mm']:g} mm, y {place['y_mm']:g} mm: cycle {figures['cycle_s']:.3f} s, {margin}",
            f"  to solve it: {options}",
        ]
    outcomes = [best["certified"] for best in record["best"] if best["certified"] is not None]
    for best, outcome in zip(record["best"], outcomes, strict=False):
        place = record["places"][best["place"]]
        why = f": {outcome['reason']}" if outcome["reason"] else ""
        lines.append(f"  solved at x {place['x_mm']:g} mm, y {place['y_mm']:g} mm: {outcome['status']}{why}")
    return [*lines, f"map: {folder / 'map.html'}"]


# Picture and page


def map_figure(record: Record) -> Figure:
    """The figure of a map."""
    half = 0.5 * _step(record)
    x, y = record["x_mm"], record["y_mm"]
    panel = PlotPanel(
        title="",
        y=PlotAxis(low=y[0] - half, high=y[-1] + half, label="y in mm, upward", unit="mm"),
        items=[*_places(record, half), *_things(record), *_best(record)],
    )
    return Figure(
        title=f"{record['cell']}: base of {record['robot']} from above",
        x=PlotAxis(low=x[0] - half, high=x[-1] + half, label="x in mm", unit="mm"),
        panels=[panel],
        is_plane=True,
        is_exact=True,
        legend=list(_legend(record)),
    )


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
    if place["verdict"] != "passes":
        return COLOURS[place["verdict"]]
    return next((c for c, _, last in classes if place["figures"]["cycle_s"] <= last), classes[-1][0])


def _places(record: Record, half: float) -> Iterator[Item]:
    """Every place as a square; neighbours of one colour in a row as one rectangle."""
    classes, columns, x = cycle_classes(record), len(record["x_mm"]), record["x_mm"]
    for row, y in enumerate(record["y_mm"]):
        colours = [_colour(place, classes) for place in record["places"][row * columns : (row + 1) * columns]]
        first = 0
        for colour, places in groupby(colours):
            last = first + len(list(places)) - 1
            yield PlotBox((x[first] - half, x[last] + half), (y - half, y + half), colour)
            first = last + 1


def _things(record: Record) -> Iterator[Item]:
    """Robots at the start, part, surroundings, paths and the present base."""
    drawing, robot = record["drawing"], record["robot"]
    for other in drawing["outlines"]:
        colour = LIMIT if other["robot"] == robot else INK
        width = 1.1 if other["is_at_rest"] or other["kind"] == "part" else 0.45
        yield outline(other["outline_mm"], colour=colour, width=width)
    for index, other in enumerate(drawing["paths"]):
        yield line(other["points_mm"], colour=ROBOTS[index % len(ROBOTS)], width=1.6)
    for other in drawing["robots"]:
        colour = LIMIT if other["name"] == robot else INK
        yield Note(other["x_mm"], other["y_mm"], other["name"], colour, size=8.5, is_bold=True)


def _best(record: Record) -> Iterator[Item]:
    """The best places: a star and dots, white where they were verified, red where they failed."""
    for rank, best in enumerate(record["best"]):
        place = record["places"][best["place"]]
        colour = {"passed": PAPER, None: INK}.get((best["certified"] or {}).get("status"), LIMIT)
        size, edge = 6.5 if rank == 0 else 3.5, INK if colour == PAPER else PAPER
        yield PlotMark(place["x_mm"], place["y_mm"], colour, size=size, edge=edge, is_star=rank == 0)


def _legend(record: Record) -> Iterator[LegendKey]:
    """What the colours mean, with the number of places of each."""
    yield LegendKey(f"passes: {record['counts']['passes']}", is_bold=True)
    for colour, first, last in cycle_classes(record):
        yield LegendKey(f"cycle {first:.2f} to {last:.2f} s", colour)
    for verdict, colour in colours_of(record).items():
        yield LegendKey(f"{TITLES[verdict]}: {record['counts'][verdict]}", colour)
    yield LegendKey(f"red: {record['robot']} as it stands", ink=LIMIT)
    yield LegendKey("star: best place, dots: next best")


def map_page(record: Record, plot: bytes) -> str:
    """The page of a map with its picture as SVG."""
    colours = colours_of(record)
    best: list[dict[str, Any]] = [{**place, **record["places"][place["place"]]} for place in record["best"]]
    examples = {
        verdict: next((place["reason"] for place in record["places"] if place["verdict"] == verdict), "")
        for verdict in colours
    }
    return template("jobs/base_map/base_map.html").render(
        r=record,
        best=best,
        plot=inline_svg(plot.decode()),
        classes=cycle_classes(record),
        colours=colours,
        titles=TITLES,
        examples=examples,
        caution=CAUTION,
    )


# Files


def map_files(record: Record, formats: Collection[str] = ()) -> dict[str, bytes]:
    """Content of the files of a map by name, its picture as SVG and in ``formats``."""
    plots = pictures({"map": map_figure(record)}, formats)
    return {"map.json": as_json(record).encode(), **plots, "map.html": map_page(record, plots["map.svg"]).encode()}


MAP: Final = ResultKind(
    name="map",
    title="Map of a base",
    file="map.json",
    tables=lambda record: {name: listed_table(record, name) for name in ("places", "best")},
    shown={"places": ("x_mm", "y_mm", "yaw_deg", "verdict", "cycle_s", "reason")},
    pictures=lambda record: {"map": map_figure(record)},
)
