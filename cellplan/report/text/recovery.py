"""A recovery as lines for a terminal: what happens in which order, the smallest clearance and the duration."""

from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

LONGEST: Final = 3  # ways that were not taken that are shown


def recovery_lines(record: Mapping[str, Any]) -> list[str]:
    """The lines of a record in ``recovery.json``."""
    at = record["state"]["at_s"]
    if record["status"] != "found":
        return [f"{record['cell']}: no recovery from {at:g} s was found", f"  {record['reason']}"]
    lines = [f"{record['cell']}: recovery from {at:g} s, {record['duration_s']:.3f} s"]
    lines += _state_lines(record)
    for number, phase in enumerate(record["phases"], start=1):
        lines.append(f"  {number}. {phase['begin_s']:.3f} to {phase['end_s']:.3f} s  {phase['kind']}: {phase['what']}")
    nearest = record["clearance"]
    if nearest is not None:
        lines.append(
            f"  smallest clearance {_down(nearest['distance_mm'])} mm ({' to '.join(nearest['pair'])} at "
            f"{nearest['at_s']:.3f} s), required {nearest['demand_mm']:.1f} mm"
        )
    lines += [f"  not taken: {words}" for words in record["not_taken"][:LONGEST]]
    return lines


def _state_lines(record: Mapping[str, Any]) -> Iterator[str]:
    """Where robots stand at other times, and what begins too near."""
    at = record["state"]["at_s"]
    for name, robot in record["state"]["robots"].items():
        if robot["at_s"] != at:
            yield f"  {name} stands where it is at {robot['at_s']:g} s"
        if robot["keeps"]:
            yield f"  {name} stands still"
    for pair in record["begins_too_near"]:
        first, second = pair["pair"]
        held = f"{pair['depth_mm']:.2f} mm deep in" if pair["depth_mm"] > 0.0 else f"{pair['distance_mm']:.2f} mm from"
        kept = f"from {pair['kept_from_s']:.3f} s on {pair['demand_mm']:g} mm apart"
        yield f"  begins with {first} {held} {second}; {kept}"


def _down(distance: float) -> str:
    """A distance rounded down: never more than there is."""
    return f"{np.floor(10.0 * distance) / 10.0:.1f}"
