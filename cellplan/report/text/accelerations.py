"""Accelerations as text: the joint closest to its limit, jerk, tool and part, and what was not judged."""

from collections.abc import Iterator

from cellplan.report.record.common import Record
from cellplan.report.record.numbers import fixed, percent, small
from cellplan.report.record.phases import instant_text
from cellplan.report.text.columns import Row


def acceleration_rows(record: Record) -> Iterator[Row]:
    """Rows about the accelerations of a run; none for a record without them."""
    accelerations = record.get("accelerations")
    if accelerations is not None:
        yield from _joint_rows(record["joints"])
        yield from _world_rows(accelerations)


def not_judged_lines(record: Record) -> Iterator[str]:
    """One line for each quantity that was not judged, with its robots and the reason."""
    robots: dict[tuple[str, str], list[str]] = {}
    for left in (record.get("accelerations") or {"not_judged": []})["not_judged"]:
        robots.setdefault((left["what"], left["reason"]), []).extend([left["robot"]] if left["robot"] else [])
    for (what, reason), names in robots.items():
        of = f" of {', '.join(names)}" if names else ""
        yield f"  not judged: {what}{of} ({reason})"


def _joint_rows(joints: Record) -> Iterator[Row]:
    """The joint with the largest fraction of its limit, or else the largest acceleration; the largest jerk."""
    uses = [(f"{robot} {name}", use) for robot, named in joints.items() for name, use in named.items()]
    known = [use for use in uses if use[1].get("peak_acceleration") is not None]
    limited = [entry for entry in known if entry[1]["acceleration_ratio"] is not None]
    if limited:
        joint, use = max(limited, key=lambda entry: float(entry[1]["acceleration_ratio"]))
        source = "assumed" if use["acceleration_limit_source"] == "assumed" else "stated"
        figure = f"{percent(use['acceleration_ratio'], 1)} of its {source} limit"
        yield "largest joint acceleration", figure, f"{joint} {instant_text(use, 'peak_acceleration_at_s')}"
    elif known:
        joint, use = max(known, key=lambda entry: (entry[1]["unit"] == "deg", entry[1]["peak_acceleration"]))
        figure = f"{fixed(use['peak_acceleration'])} {use['unit']}/s2, not limited"
        yield "largest joint acceleration", figure, f"{joint} {instant_text(use, 'peak_acceleration_at_s')}"
    if known:
        joint, use = max(known, key=lambda entry: (entry[1]["unit"] == "deg", entry[1]["peak_jerk"]))
        figure = f"{fixed(use['peak_jerk'], 0)} {use['unit']}/s3 over {use['jerk_window_ms']:g} ms"
        yield "largest joint jerk", figure, f"{joint} {instant_text(use, 'peak_jerk_at_s')}"


def _world_rows(accelerations: Record) -> Iterator[Row]:
    """The tool tip and the part with the largest acceleration."""
    if accelerations["tools"]:
        robot, tool = max(accelerations["tools"].items(), key=lambda it: it[1]["peak_acceleration_m_s2"])
        yield "largest tool acceleration", *_figure(tool, f"tool tip of {robot}")
    if accelerations["part"] is not None:
        yield "largest part acceleration", *_figure(accelerations["part"]["corner"], "part")


def _figure(point: Record, what: str) -> tuple[str, str]:
    """Figure of a point, and when it is reached."""
    return f"{small(point['peak_acceleration_m_s2'])} m/s2", f"{what} {instant_text(point, 'peak_acceleration_at_s')}"
