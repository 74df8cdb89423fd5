"""Picture of a map: the plane from above, to scale, each place in the colour of its verdict."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.report.plots.figure import Axis, Box, Figure, Item, Key, Mark, Note, Panel, line, outline
from cellplan.report.plots.palette import INK, LIMIT, PAPER, ROBOTS
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


def map_figure(record: Record) -> Figure:
    """The figure of a map.

    Args:
        record: As ``base_map`` returns it.
    """
    half = 0.5 * _step(record)
    x, y = record["x_mm"], record["y_mm"]
    panel = Panel(
        title="",
        y=Axis(low=y[0] - half, high=y[-1] + half, label="y in mm, upward", unit="mm"),
        items=[*_places(record, half), *_things(record), *_best(record)],
    )
    return Figure(
        title=f"{record['cell']}: base of {record['robot']} from above",
        x=Axis(low=x[0] - half, high=x[-1] + half, label="x in mm", unit="mm"),
        panels=[panel],
        is_plane=True,
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
    """Colour of a place."""
    if place["verdict"] != "passes":
        return COLOURS[place["verdict"]]
    return next((c for c, _, last in classes if place["figures"]["cycle_s"] <= last), classes[-1][0])


def _places(record: Record, half: float) -> Iterator[Item]:
    """Every place as a square; neighbours of one colour in a row as one rectangle."""
    classes, columns, x = cycle_classes(record), len(record["x_mm"]), record["x_mm"]
    for row, y in enumerate(record["y_mm"]):
        colours = [_colour(each, classes) for each in record["places"][row * columns : (row + 1) * columns]]
        for first, last, colour in _stretches(colours):
            yield Box((x[first] - half, x[last] + half), (y - half, y + half), colour)


def _stretches(colours: list[str]) -> Iterator[tuple[int, int, str]]:
    """First and last place of each stretch of one colour."""
    first = 0
    for place in range(1, len(colours) + 1):
        if place == len(colours) or colours[place] != colours[first]:
            yield first, place - 1, colours[first]
            first = place


def _things(record: Record) -> Iterator[Item]:
    """Robots at the start, part, surroundings, paths and the present base."""
    drawn, robot = record["drawing"], record["robot"]
    for each in drawn["outlines"]:
        colour = LIMIT if each["robot"] == robot else INK
        width = 1.1 if each["is_at_rest"] or each["kind"] == "part" else 0.45
        yield outline(each["outline_mm"], colour=colour, width=width)
    for index, each in enumerate(drawn["paths"]):
        yield line(each["points_mm"], colour=ROBOTS[index % len(ROBOTS)], width=1.6)
    for each in drawn["robots"]:
        colour = LIMIT if each["name"] == robot else INK
        yield Note(each["x_mm"], each["y_mm"], each["name"], colour, size=8.5, is_bold=True)


def _best(record: Record) -> Iterator[Item]:
    """The best places: a star and dots, white where they were verified, red where they failed."""
    for rank, each in enumerate(record["best"]):
        place = record["places"][each["place"]]
        colour = {"passed": PAPER, None: INK}.get((each["certified"] or {}).get("status"), LIMIT)
        size = 6.5 if rank == 0 else 3.5
        yield Mark(place["x_mm"], place["y_mm"], colour, size=size, edge=INK, is_star=rank == 0)


def _legend(record: Record) -> Iterator[Key]:
    """What the colours mean, with the number of places of each."""
    yield Key(f"passes: {record['counts']['passes']}", is_bold=True)
    for colour, first, last in cycle_classes(record):
        yield Key(f"cycle {first:.2f} to {last:.2f} s", colour)
    for verdict, colour in colours_of(record).items():
        yield Key(f"{TITLES[verdict]}: {record['counts'][verdict]}", colour)
    yield Key(f"red: {record['robot']} as it stands", ink=LIMIT)
    yield Key("star: best place, dots: next best")
