"""Joints in the record of a run: positions, velocities, accelerations, drift over cycles, joints that fail."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Annotated, Any, TypedDict

from cellplan.model.cell.acceleration import JointAcceleration
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import JointUse, Report
from cellplan.model.robot.repeatability import Repeatability
from cellplan.model.units import MM
from cellplan.report.record.common import Number, Record, number
from cellplan.report.record.phases import AT, PHASE

if TYPE_CHECKING:
    from cellplan.model.robot.robot import Joint


class JointAccelerationRecord(TypedDict, total=False):
    """Acceleration and jerk of a joint, at rest before the first row and after the last one."""

    peak_acceleration: Annotated[Number, "largest acceleration"]
    peak_acceleration_at_s: Annotated[Number, "its time"]
    acceleration_limit: Annotated[Number, "admissible acceleration; null if it is not judged"]
    acceleration_limit_source: Annotated[str, "`stated`, `assumed`, `unlimited` or `not_stated`"]
    acceleration_ratio: Annotated[Number, "largest acceleration as a fraction of its limit; null if it is not judged"]
    peak_jerk: Annotated[Number, "largest change of acceleration over `jerk_window_ms`, divided by it"]
    peak_jerk_at_s: Annotated[Number, "its time"]
    jerk_limit: Annotated[Number, "admissible jerk; null if none is stated"]
    jerk_window_ms: Annotated[Number, "cycle time of the controller"]


def velocity_ratio(use: JointUse) -> float:
    """Largest speed as a fraction of its limit; infinite if a joint moves whose limit is zero."""
    if use.velocity_limit > 0.0:
        return use.peak_velocity / use.velocity_limit
    return 0.0 if use.peak_velocity == 0.0 else math.inf


class JointRecord(JointAccelerationRecord):
    """Use of a joint, in `unit`; velocities in that unit per second."""

    unit: Annotated[str, "`deg` for a revolute joint, `mm` for a prismatic one"]
    min: Annotated[Number, "smallest position reached"]
    max: Annotated[Number, "largest position reached"]
    lower: Annotated[Number, "lower limit; null for an endless joint"]
    upper: Annotated[Number, "upper limit; null for an endless joint"]
    margin: Annotated[Number, "smallest distance to the nearer limit, negative beyond it"]
    margin_at_s: Annotated[Number, "its time"]
    peak_velocity: Annotated[Number, "largest speed between two samples"]
    velocity_limit: Annotated[Number, "admissible speed"]
    velocity_ratio: Annotated[
        Number, "largest speed as a fraction of its limit; null if a joint moves whose limit is zero"
    ]
    peak_velocity_at_s: Annotated[Number, "end of the step with the largest speed"]
    worst_at_s: Annotated[Number, "time of the margin or of the largest speed, whichever is nearer to its limit"]
    travel: Annotated[Number, "sum of all distances travelled"]


class JointDriftRecord(TypedDict):
    """Drift of a joint, in `unit`."""

    unit: Annotated[str, "`deg` or `mm`"]
    worst: Annotated[Number, "largest drift of a cycle"]
    at_cycle: Annotated[int, "the cycle, counted from 1"]
    drift: Annotated[list[Number], "position at the end minus position at the start of each cycle"]


class _WorstDriftRecord(TypedDict, total=False):
    worst_drift_deg: Annotated[Number, "largest drift of a revolute joint in one cycle"]
    joint: Annotated[str, "that joint"]
    at_cycle: Annotated[int, "that cycle"]
    worst_drift_mm: Annotated[Number, "largest drift of a prismatic joint in one cycle"]
    sliding_joint: Annotated[str, "that joint"]
    sliding_at_cycle: Annotated[int, "that cycle"]


class RepeatabilityRecord(_WorstDriftRecord):
    """Drift of the joints over the cycles of a closed path."""

    cycles: Annotated[int, "number of cycles"]
    period_s: Annotated[Number, "duration of a cycle; null if the cycles differ"]
    ends_s: Annotated[list[Number], "end of each cycle"]
    closes: Annotated[bool, "whether every joint returns within 0.001 deg or 0.001 mm in every cycle"]
    per_joint: Annotated[dict[str, dict[str, JointDriftRecord]], "drift by robot and joint"]


class LockedJointRecord(TypedDict):
    """A joint that fails during the motion."""

    robot: Annotated[str, "robot"]
    joint: Annotated[str, "joint"]
    from_s: Annotated[Number, "time from which it is locked"]
    position: Annotated[Number, "position at which it is locked"]
    unit: Annotated[str, "`deg` or `mm`"]
    tasks_kept: Annotated[bool, "whether every task is within its tolerance nevertheless"]


def joints_record(
    joints: Iterable[JointUse], accelerations: Iterable[JointAcceleration]
) -> dict[str, dict[str, JointRecord]]:
    """Use of each joint, by robot and joint."""
    by_joint = {(use.robot, use.joint): use for use in accelerations}
    record: dict[str, dict[str, JointRecord]] = {}
    for use in joints:
        record.setdefault(use.robot, {})[use.joint] = _joint_record(use, by_joint.get((use.robot, use.joint)))
    return record


def _joint_record(use: JointUse, acceleration: JointAcceleration | None) -> JointRecord:
    unit, scale = use.display_unit
    record: JointRecord = {
        "unit": unit,
        "min": number(scale * use.min),
        "max": number(scale * use.max),
        "lower": number(scale * use.lower),
        "upper": number(scale * use.upper),
        "margin": number(scale * use.margin),
        "margin_at_s": number(use.margin_at_s),
        "peak_velocity": number(scale * use.peak_velocity),
        "velocity_limit": number(scale * use.velocity_limit),
        "velocity_ratio": number(velocity_ratio(use)),
        "peak_velocity_at_s": number(use.peak_velocity_at_s),
        "worst_at_s": None,
        "travel": number(scale * use.travel),
        **_acceleration_record(acceleration),
    }
    return with_worst_time(record)


def _acceleration_record(use: JointAcceleration | None) -> JointAccelerationRecord:
    """Acceleration and jerk of a joint; empty if they were not evaluated."""
    if use is None:
        return {}
    scale = use.display_unit.scale
    return {
        "peak_acceleration": number(scale * use.peak),
        "peak_acceleration_at_s": number(use.peak_at_s),
        "acceleration_limit": number(use.limit, scale),
        "acceleration_limit_source": str(use.source),
        "acceleration_ratio": number(use.ratio),
        "peak_jerk": number(scale * use.peak_jerk),
        "peak_jerk_at_s": number(use.peak_jerk_at_s),
        "jerk_limit": number(use.jerk_limit, scale),
        "jerk_window_ms": number(1e3 * use.window),
    }


def with_worst_time(record: Any) -> Any:
    """A joint with the time, and the phase if it has one, at which it is nearest to a limit of its own."""
    source = "margin" if _is_position_worse(record) else "peak_velocity"
    times = {f"worst_{key}": record[f"{source}_{key}"] for key in (AT, PHASE) if f"{source}_{key}" in record}
    return {**record, **times}


def _is_position_worse(record: Record) -> bool:
    """Whether a joint is closer to its position limit than to its speed limit, each as a fraction of the limit."""
    if record["lower"] is None or record["upper"] is None:
        return False
    half_range = 0.5 * (record["upper"] - record["lower"])
    ratio = math.inf if record["velocity_ratio"] is None else record["velocity_ratio"]
    return bool(record["margin"] <= half_range * (1.0 - ratio)) if half_range > 0.0 else True


def repeatability_record(report: Report) -> dict[str, RepeatabilityRecord]:
    """Drift of the joints over the cycles, by the task, or under ``all`` for several tasks."""
    repeatability = report.repeatability
    if repeatability is None:
        return {}
    record: RepeatabilityRecord = {
        "cycles": repeatability.cycles,
        "period_s": number(repeatability.period),
        "ends_s": [number(float(time)) for time in repeatability.cycle_times[1:]],
        **_worst_drift(repeatability),
        "closes": repeatability.closes,
        "per_joint": _drifts_by_joint(repeatability),
    }
    return {report.tasks[0] if len(report.tasks) == 1 else "all": record}


def _worst_drift(drifts: Repeatability) -> _WorstDriftRecord:
    """The joint of each kind that drifts most in a cycle."""
    record: _WorstDriftRecord = {}
    revolute = [drift for drift in drifts.drifts if drift.is_revolute]
    if revolute:
        worst = max(revolute, key=lambda drift: drift.worst)
        record["worst_drift_deg"] = number(worst.display_unit.scale * worst.worst)
        record["joint"], record["at_cycle"] = f"{worst.robot} {worst.joint}", worst.at_cycle
    prismatic = [drift for drift in drifts.drifts if not drift.is_revolute]
    if prismatic:
        worst = max(prismatic, key=lambda drift: drift.worst)
        record["worst_drift_mm"] = number(MM * worst.worst)
        record["sliding_joint"], record["sliding_at_cycle"] = f"{worst.robot} {worst.joint}", worst.at_cycle
    return record


def _drifts_by_joint(drifts: Repeatability) -> dict[str, dict[str, JointDriftRecord]]:
    """Drift of each cycle, by robot and joint."""
    record: dict[str, dict[str, JointDriftRecord]] = {}
    for drift in drifts.drifts:
        unit, scale = drift.display_unit
        record.setdefault(drift.robot, {})[drift.joint] = {
            "unit": unit,
            "worst": number(scale * drift.worst),
            "at_cycle": drift.at_cycle,
            "drift": [number(scale * float(value)) for value in drift.drift],
        }
    return record


def locked_joints_record(report: Report, cell: Cell) -> list[LockedJointRecord]:
    """Joints that fail: when, at which position, and whether all tasks stay within their tolerances."""
    accuracy = ("position_error", "orientation_error")
    are_tasks_met = all(check.passed for check in report.checks if check.name in accuracy)
    records: list[LockedJointRecord] = []
    for lock in cell.motion.locked:
        model = cell.robot(lock.robot).model
        index = model.joint_names.index(lock.joint)
        unit, scale = model.joints[index].display_unit
        positions = report.q[lock.robot][report.times >= lock.from_s, index]
        records.append(
            {
                "robot": lock.robot,
                "joint": lock.joint,
                "from_s": number(lock.from_s),
                "position": number(scale * positions[0]) if len(positions) else None,
                "unit": unit,
                "tasks_kept": are_tasks_met,
            }
        )
    return records


def joint_record(joint: Joint) -> dict[str, Any]:
    """Name, type, limits and speed of one joint, with the unit in the keys."""
    unit, scale = joint.display_unit
    return {
        "name": joint.name,
        "type": str(joint.kind),
        f"lower_{unit}": _figure(scale * joint.lower),
        f"upper_{unit}": _figure(scale * joint.upper),
        f"velocity_{unit}_s": _figure(scale * joint.velocity),
    }


def limits_text(record: dict[str, Any]) -> tuple[str, str]:
    """Range and largest speed of one joint as text."""
    unit = "deg" if "lower_deg" in record else "mm"
    lower, upper = record[f"lower_{unit}"], record[f"upper_{unit}"]
    limits = "endless" if lower is None or upper is None else f"{lower:g} … {upper:g} {unit}"
    return limits, f"{record[f'velocity_{unit}_s']:g} {unit}/s"


def _figure(value: float) -> float | None:
    """The value of the data sheet; None for an endless joint."""
    return float(f"{value:.9g}") if math.isfinite(value) else None
