"""Arcs of G-code as points: from start and end with a centre or a radius, within a chord."""

import math
from dataclasses import dataclass
from typing import Final

from cellplan.errors import InputError
from cellplan.files.cell.paths.csv_table import MOST_POINTS

OFF_CIRCLE_MM: Final = 0.01  # difference of the distances of both ends from a centre written with three decimals
SAME_MM: Final = 1e-6  # start and end nearer than this are one point
WIDEST_STEP: Final = math.radians(10.0)  # [rad] from point to point, so that no corner of an arc is a stop


@dataclass(frozen=True, slots=True, kw_only=True)
class Arc:
    """An arc in a plane, in [mm]."""

    start: tuple[float, float]
    end: tuple[float, float]
    offsets: tuple[float, float] | None  # of its centre from its start
    radius: float | None  # negative for more than half of the circle
    is_clockwise: bool


def arc_points(arc: Arc, chord: float) -> list[tuple[float, float, float]]:
    """Points behind the start of an arc up to its end: share of the way, and both coordinates in [mm].

    The sides between them are within ``chord``, in [m], of the arc.

    Raises:
        InputError: Ends, centre and radius fit no circle.
    """
    u, v = _centre(arc)
    first, last = (math.hypot(point[0] - u, point[1] - v) for point in (arc.start, arc.end))
    if abs(first - last) > OFF_CIRCLE_MM:
        text = f"expected both ends of an arc at one distance from its centre, got {first:.6g} and {last:.6g} mm"
        raise InputError(text)
    begin, end = (math.atan2(point[1] - v, point[0] - u) for point in (arc.start, arc.end))
    sweep = (begin - end if arc.is_clockwise else end - begin) % (2.0 * math.pi)
    if math.dist(arc.start, arc.end) < SAME_MM:
        sweep = 2.0 * math.pi
    step = min(WIDEST_STEP, 2.0 * math.acos(max(0.0, 1.0 - 1e3 * chord / max(first, last))))
    count = math.ceil(sweep / step)
    if count > MOST_POINTS:
        raise InputError(f"expected an arc of at most {MOST_POINTS} points within the chord, got {count}")
    turned = -sweep if arc.is_clockwise else sweep
    points = []
    for k in range(1, count):
        share = k / count
        r, angle = first + share * (last - first), begin + share * turned
        points.append((share, u + r * math.cos(angle), v + r * math.sin(angle)))
    return [*points, (1.0, *arc.end)]


def _centre(arc: Arc) -> tuple[float, float]:
    """The centre of an arc in [mm]."""
    if (arc.offsets is None) == (arc.radius is None):
        got = "neither" if arc.radius is None else "both"
        raise InputError(f"expected a centre or a radius R for an arc, got {got}")
    if arc.offsets is not None:
        if math.hypot(*arc.offsets) < SAME_MM:
            raise InputError("expected a centre off the start of an arc, got it there")
        return arc.start[0] + arc.offsets[0], arc.start[1] + arc.offsets[1]
    radius, distance = arc.radius or 0.0, math.dist(arc.start, arc.end)
    if distance < SAME_MM:
        raise InputError("expected I, J or K for a full circle, got a radius")
    if abs(radius) < 0.5 * distance - 0.5 * OFF_CIRCLE_MM:
        least = 0.5 * distance
        raise InputError(
            f"expected a radius of at least {least:.6g} mm, half of the distance of both ends, got {radius:g}"
        )
    height = math.sqrt(max(0.0, radius * radius - 0.25 * distance * distance))
    side = height * (1.0 if arc.is_clockwise == (radius < 0.0) else -1.0)
    dx, dy = (arc.end[0] - arc.start[0]) / distance, (arc.end[1] - arc.start[1]) / distance
    return 0.5 * (arc.start[0] + arc.end[0]) - side * dy, 0.5 * (arc.start[1] + arc.end[1]) + side * dx
