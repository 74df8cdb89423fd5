"""Merging of the records of several runs: of every figure the worst of them, with its time and its phase."""

from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any, Final, NamedTuple

from cellplan.report.record.common import Record, number
from cellplan.report.record.figures import Fold
from cellplan.report.record.joints import with_worst_time
from cellplan.report.record.phases import AT, phase_key


class Figure(NamedTuple):
    """A figure of a record, and what of the same run goes with it."""

    key: str  # of the figure
    worst: Fold  # max or min
    at: str  # key of its time; empty without one
    further: tuple[str, ...] = ()  # keys of what else belongs to it


LOAD: Final = ("mass_kg", "tool_mass_kg", "part_mass_kg", "part_shared", "centre_in_flange_mm")
LIMIT: Final = ("acceleration_limit", "acceleration_limit_source", "acceleration_ratio")
# fmt: off
FIGURES: Final = (
    Figure("min", min, ""),
    Figure("max", max, ""),
    Figure("margin", min, "margin_at_s"),
    Figure("peak_velocity", max, "peak_velocity_at_s", ("velocity_ratio",)),
    Figure("peak_acceleration", max, "peak_acceleration_at_s", LIMIT),
    Figure("peak_jerk", max, "peak_jerk_at_s"),
    Figure("peak_acceleration_m_s2", max, "peak_acceleration_at_s"),
    Figure("peak_jerk_m_s3", max, "peak_jerk_at_s"),
    Figure("minimum_mm", min, AT, ("pair", "exact", "points_mm", "accuracies_mm")),
    Figure("max_position_error_mm", max, AT),
    Figure("max_orientation_error_deg", max, "max_orientation_error_at_s"),
    Figure("max_position_error_between_rows_mm", max, "max_position_error_between_rows_at_s"),
    Figure("max_orientation_error_between_rows_deg", max, "max_orientation_error_between_rows_at_s"),
    Figure("felt_mass_kg", max, "felt_at_s", LOAD),
    Figure("static_moment_nm", max, "static_moment_at_s"),
    Figure("moment_nm", max, "moment_at_s"),
    Figure("inertia_kg_m2", max, "inertia_at_s"),
)
# fmt: on


def worst_of(records: Sequence[Record]) -> Any:
    """One record of several of the same form: of each figure the worst, the first one of those that are alike.

    Joints travel the sum of all runs; a distance is certified if that of every run is. What is no figure is that of
    the first run that has it.

    Args:
        records: Records by name, or of one subject, of each run.
    """
    merged: dict[str, Any] = {}
    for key in dict.fromkeys(chain.from_iterable(records)):
        values = [record[key] for record in records if record.get(key) is not None] or [None]
        merged[key] = worst_of(values) if isinstance(values[0], Mapping) else values[0]
    for figure in FIGURES:
        known = [record for record in records if record.get(figure.key) is not None]
        if known:
            worst = figure.worst(known, key=lambda record: record[figure.key])
            keys = (figure.key, figure.at, phase_key(figure.at), *figure.further)
            merged |= {key: worst[key] for key in keys if key in worst}
    if "travel" in merged:
        merged["travel"] = number(sum(record["travel"] for record in records))
        merged = with_worst_time(merged)
    if "certified" in merged and merged["minimum_mm"] is not None:
        merged["certified"] = all(record["certified"] for record in records if record["minimum_mm"] is not None)
        merged["exact"] = merged["certified"] and merged["exact"]
    return merged
