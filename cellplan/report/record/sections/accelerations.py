"""Accelerations in the world in the record of a run, and the line about accelerations in the header of a table."""

from typing import Annotated, Final, TypedDict

from cellplan.model.cell.acceleration import MotionAccelerations, PartAcceleration, PointAcceleration
from cellplan.report.record.common import Number, number

REST: Final = "all robots stand still before the first row and after the last one"


class PointRecord(TypedDict):
    """Acceleration of a point in the world."""

    peak_acceleration_m_s2: Annotated[Number, "largest acceleration"]
    peak_acceleration_at_s: Annotated[Number, "its time"]
    peak_jerk_m_s3: Annotated[Number, "largest change of acceleration over `jerk_window_ms`, divided by it"]
    peak_jerk_at_s: Annotated[Number, "its time"]
    jerk_window_ms: Annotated[Number, "cycle time of the controller"]


class PartRecord(TypedDict):
    """Acceleration of the part."""

    centre: Annotated[PointRecord, "centre of its bounding box"]
    corner: Annotated[PointRecord, "the corner of that box with the largest acceleration"]


class NotJudgedRecord(TypedDict):
    """An acceleration that was not judged."""

    robot: Annotated[str | None, "robot; null for the whole cell"]
    what: Annotated[str, "the quantity"]
    reason: Annotated[str, "the reason"]


class AccelerationsRecord(TypedDict):
    """Accelerations in the world; those of the joints are under `joints`."""

    assumption: Annotated[str, "state assumed before the first row and after the last one"]
    tools: Annotated[dict[str, PointRecord], "by robot: the tool tip"]
    part: Annotated[PartRecord | None, "the part; null if no robot holds it"]
    not_judged: Annotated[list[NotJudgedRecord], "quantities without a limit"]


def accelerations_record(accelerations: MotionAccelerations) -> AccelerationsRecord:
    """Accelerations of tool tips and part, and what was not judged."""
    return {
        "assumption": REST,
        "tools": {robot: _point_record(point) for robot, point in accelerations.tools.items()},
        "part": None if accelerations.part is None else _part_record(accelerations.part),
        "not_judged": [
            {"robot": left.robot or None, "what": left.what, "reason": left.reason} for left in accelerations.not_judged
        ],
    }


def _point_record(point: PointAcceleration) -> PointRecord:
    return {
        "peak_acceleration_m_s2": number(point.peak),
        "peak_acceleration_at_s": number(point.peak_at_s),
        "peak_jerk_m_s3": number(point.peak_jerk),
        "peak_jerk_at_s": number(point.peak_jerk_at_s),
        "jerk_window_ms": number(1e3 * point.window),
    }


def _part_record(part: PartAcceleration) -> PartRecord:
    """The centre of the bounding box, and the corner of it with the largest acceleration."""
    return {"centre": _point_record(part.centre), "corner": _point_record(part.corner)}


def table_line(accelerations: MotionAccelerations, robot: str) -> str:
    """Header line of a robot's table: its largest acceleration and jerk, as fractions of known limits."""
    uses = [use for use in accelerations.joints if use.robot == robot]
    most = max(uses, key=lambda use: (use.ratio is not None, use.peak if use.ratio is None else use.ratio))
    unit, scale = most.display_unit
    against = "not judged" if most.ratio is None else f"{100.0 * most.ratio:.3g} % of its {most.source} limit"
    hardest = max(uses, key=lambda use: (use.is_revolute, use.peak_jerk))
    jerk_unit, jerk_scale = hardest.display_unit
    return (
        f"at most {scale * most.peak:.4g} {unit}/s2 at {most.peak_at_s:.3f} s ({most.joint}, {against}), "
        f"jerk {jerk_scale * hardest.peak_jerk:.4g} {jerk_unit}/s3 over {1e3 * hardest.window:g} ms "
        f"at {hardest.peak_jerk_at_s:.3f} s ({hardest.joint})"
    )
