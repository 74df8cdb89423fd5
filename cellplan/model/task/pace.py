"""Pace: how fast a tool goes along each stretch of a path whose file states feeds, and where its process is on."""

from dataclasses import dataclass

from cellplan.geometry.arrays import Array, Flags, Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pace:
    """Stretches of a path between changes of the feed, stops and rests, in their order."""

    pieces: Indices  # piece of the toolpath that each lies in, shape (S,)
    tops: Array  # greatest speed on each in [m/s], 0 in rests, shape (S,)
    drops: Array  # shares of that speed that are missing at begin and end of each, 1 at rest, shape (S, 2)
    ramps: Array  # share of its time that a ramp takes, shape (S,)
    is_on: Flags  # whether the process is on, shape (S,)
    is_at_feed: Flags  # whether the greatest speed is a demanded feed, shape (S,): other stretches are too short for it
