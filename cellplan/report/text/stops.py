"""Stops of one robot as text: rows of a summary."""

from collections.abc import Iterator

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import small
from cellplan.report.text.columns import Row


def stop_rows(record: Record) -> Iterator[Row]:
    """The deepest tool and the nearest robots when one robot stops; none where no controller says how others go on."""
    if "stops" not in record:
        return
    depths = record["stops"]["depths"]
    if depths:
        task = max(depths, key=lambda name: float(depths[name]["depth_mm"]))
        yield "depth at a stop", f"{small(depths[task]['depth_mm'])} mm", f"task {task}{_when(depths[task]['worst'])}"
    apart = [distance for distance in record["stops"]["distances"] if distance["distance_mm"] is not None]
    if apart:
        nearest = min(apart, key=lambda distance: float(distance["distance_mm"]))
        bodies = "" if nearest["bodies"] is None else " - ".join(nearest["bodies"])
        yield "clearance at a stop", f"{small(nearest['distance_mm'])} mm", f"{bodies}{_when(nearest['worst'])}"
    for robot, grip in record["stops"]["grips"].items():
        yield "grip at a stop", f"{small(grip['distance_mm'])} mm", f"{robot} from its grasp{_when(grip['worst'])}"


def _when(worst: Record | None) -> str:
    """Who stops when, and how far the other one has gone."""
    if worst is None:
        return ""
    return f", {worst['stopped']} stops at {worst['at_s']:.3f} s, {worst['going']} {worst['goes_on_ms']:.0f} ms farther"
