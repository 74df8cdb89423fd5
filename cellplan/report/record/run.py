"""The record of a run: a report in printed units (deg, mm, s) under the names that users and their scripts rely on."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.report import (
    CAUTION,
    REDUCED_SPEED,
    Check,
    ClearanceClass,
    ClearanceMinimum,
    ClearanceReport,
    Conditioning,
    JointUse,
    Repeatability,
    Report,
    RobotSpeed,
    TaskAccuracy,
)
from cellplan.report.record.clock import clock_from
from cellplan.report.record.idle import idle_record

Record = dict[str, Any]

SCHEMA = "cellplan.report/1"
SIGNIFICANT = 12  # [-] digits: hides the noise of unit conversion (-185.00000000000003) and nothing else
ROUNDING = 1e-9  # [-] of a tenth: lets 37.0 that is stored as 36.99999999999 stay 37.0
AXES = ("x", "y", "z", "rx", "ry", "rz")


@dataclass(frozen=True, slots=True, kw_only=True)
class Provenance:
    """Where a result comes from.

    Attributes:
        versions: Version by package, cellplan's own first.
        digests: SHA-256 by what was written (``program``, or a file of the run).
    """

    versions: Mapping[str, str]
    digests: Mapping[str, str]


def report_record(report: Report, *, cell: Cell, provenance: Provenance) -> Record:
    """Everything that is known about one run."""
    return {
        "schema": SCHEMA,
        "cell": report.cell,
        "status": status(report),
        "mode": report.mode,
        "cycle_time_s": number(report.cycle_time),
        "clock_from": clock_from(cell),
        "samples": len(report.times),
        "step_s": number(report.cycle_time / (len(report.times) - 1)),
        "tasks": tasks_record(report, cell),
        "joints": joints_record(report.joints),
        "repeatability": repeatability_record(report),
        "locked_joints": _locked_record(report, cell),
        "clearance": clearance_record(report.clearance.minima),
        "required_clearance_mm": number(1e3 * cell.checks.clearance),
        "pair_count": report.clearance.pair_count,
        "contacts": contacts_record(report.clearance),
        "exclusions": exclusions_record(report.clearance),
        "singularity": _singularity_record(report.conditioning, report.times),
        "motion_share": _motion_share_record(report, cell),
        "speeds": {robot: _speed_record(speed) for robot, speed in report.speeds.items()},
        "checks": [check_record(check) for check in report.checks],
        **idle_record(cell, report.tasks),
        **origin_record(cell, provenance),
        "caution": CAUTION,
    }


def number(value: float | None) -> float | None:
    """The value as it is printed: ``SIGNIFICANT`` digits, no -0; None where there is no finite value."""
    if value is None or not math.isfinite(value):
        return None
    return float(f"{value:.{SIGNIFICANT}g}") + 0.0


def rounded_down(value: float) -> float:
    """The value with one decimal, rounded down: never more clearance or margin than there is."""
    return math.floor(10.0 * value + ROUNDING) / 10.0


def status(report: Report) -> str:
    """``passed`` or ``failed``."""
    return "passed" if report.passed else "failed"


def origin_record(cell: Cell, provenance: Provenance) -> Record:
    """What went in and what it was computed with."""
    return {
        "inputs": dict(cell.inputs),
        "digests": dict(provenance.digests),
        "versions": dict(provenance.versions),
        "seed": cell.solver.seed,
    }


def check_record(check: Check) -> Record:
    """One verified statement."""
    return {
        "name": check.name,
        "subject": check.subject,
        "passed": check.passed,
        "value": number(check.value),
        "limit": number(check.limit),
        "unit": check.unit,
        "at_s": number(check.at_s),
        "message": check.message,
    }


def tasks_record(report: Report, cell: Cell) -> Record:
    """Tool errors by task: largest, mean and per axis over all samples that are judged."""
    return {accuracy.task: _task_record(accuracy, report, cell) for accuracy in report.accuracy}


def _task_record(accuracy: TaskAccuracy, report: Report, cell: Cell) -> Record:
    task = cell.task(accuracy.task)
    tolerance = {
        "position_mm": number(1e3 * task.tolerance.position),
        "orientation_deg": number(math.degrees(task.tolerance.orientation)),
    }
    first = task.first_judged(report.times)
    times, position = report.times[first:], 1e3 * accuracy.position_error
    orientation = np.rad2deg(accuracy.orientation_error)
    return {
        "robot": accuracy.robot,
        "relative_to": str(task.relative_to),
        **_error_record("position_error", "mm", position[first:], times=times, axes=AXES[:3]),
        "max_position_error_with_settling_mm": number(_longest(position)),
        **_error_record("orientation_error", "deg", orientation[first:], times=times, axes=AXES[3:]),
        "max_orientation_error_with_settling_deg": number(_longest(orientation)),
        "settle_s": number(task.settle),
        "judged_from_s": number(task.judged_from),
        "tolerance": tolerance,
        "axes": [AXES[index] for index in task.axes],
        "path_length_mm": number(1e3 * accuracy.path_length),
        "cycles": task.repeat,
        "start_s": number(task.start),
        "end_s": number(accuracy.end_s),
    }


def _longest(error: Array) -> float:
    """Largest length of all vectors, shape (N, 3)."""
    return float(np.linalg.norm(error, axis=1).max())


def _error_record(name: str, unit: str, error: Array, *, times: Array, axes: Sequence[str]) -> Record:
    """Largest length, its instant, mean length, and the largest share of each axis."""
    length = np.linalg.norm(error, axis=1)
    worst = int(np.argmax(length))
    by_axis = np.abs(error).max(axis=0)
    return {
        f"max_{name}_{unit}": number(length[worst]),
        f"max_{name}_at_s": number(times[worst]),
        f"mean_{name}_{unit}": number(length.mean()),
        f"max_{name}_by_axis_{unit}": {axis: number(value) for axis, value in zip(axes, by_axis, strict=True)},
    }


def repeatability_record(report: Report) -> Record:
    """How far the joints are after each cycle from where they were, by the task, or ``all`` tasks together."""
    found = report.repeatability
    if found is None:
        return {}
    name = report.tasks[0] if len(report.tasks) == 1 else "all"
    return {
        name: {
            "cycles": found.cycles,
            "period_s": number(found.period),
            "ends_s": [number(float(instant)) for instant in found.instants[1:]],
            **_worst_drift(found, is_revolute=True),
            **_worst_drift(found, is_revolute=False),
            "closes": found.closes,
            "per_joint": _drifts_by_joint(found),
        }
    }


def _worst_drift(found: Repeatability, *, is_revolute: bool) -> Record:
    """The joint that drifts most in a cycle, of those that turn (deg) or slide (mm); nothing when there is none."""
    drifts = [drift for drift in found.drifts if drift.is_revolute == is_revolute]
    if not drifts:
        return {}
    worst = max(drifts, key=lambda drift: drift.worst)
    unit, scale, key = ("deg", math.degrees(1.0), "joint") if is_revolute else ("mm", 1e3, "sliding_joint")
    return {
        f"worst_drift_{unit}": number(scale * worst.worst),
        key: f"{worst.robot} {worst.joint}",
        "at_cycle" if is_revolute else "sliding_at_cycle": worst.at_cycle,
    }


def _drifts_by_joint(found: Repeatability) -> Record:
    """Position at the end less position at the start of each cycle, in deg or mm, by robot and joint."""
    record: Record = {}
    for drift in found.drifts:
        scale = math.degrees(1.0) if drift.is_revolute else 1e3
        record.setdefault(drift.robot, {})[drift.joint] = {
            "unit": "deg" if drift.is_revolute else "mm",
            "worst": number(scale * drift.worst),
            "at_cycle": drift.at_cycle,
            "drift": [number(scale * float(value)) for value in drift.drift],
        }
    return record


def joints_record(joints: Iterable[JointUse]) -> Record:
    """How each joint is used, by robot and joint, in deg and deg/s or mm and mm/s."""
    record: Record = {}
    for use in joints:
        record.setdefault(use.robot, {})[use.joint] = _joint_record(use)
    return record


def _joint_record(use: JointUse) -> Record:
    scale = math.degrees(1.0) if use.is_revolute else 1e3
    return {
        "unit": "deg" if use.is_revolute else "mm",
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
        "worst_at_s": number(use.margin_at_s if _is_position_worse(use) else use.peak_velocity_at_s),
        "travel": number(scale * use.travel),
    }


def _locked_record(report: Report, cell: Cell) -> list[Record]:
    """Joints that fail: when, where they stay, and whether all tasks are kept within their tolerances all the same."""
    accuracy = ("position_error", "orientation_error")
    are_tasks_kept = all(check.passed for check in report.checks if check.name in accuracy)
    records = []
    for lock in cell.motion.locked:
        names = cell.robot(lock.robot).model.joint_names
        is_revolute = cell.robot(lock.robot).model.joints[names.index(lock.joint)].is_revolute
        positions = report.q[lock.robot][report.times >= lock.since, names.index(lock.joint)]
        scale = math.degrees(1.0) if is_revolute else 1e3
        records.append(
            {
                "robot": lock.robot,
                "joint": lock.joint,
                "from_s": number(lock.since),
                "position": number(scale * positions[0]) if len(positions) else None,
                "unit": "deg" if is_revolute else "mm",
                "tasks_kept": are_tasks_kept,
            }
        )
    return records


def velocity_ratio(use: JointUse) -> float:
    """Largest speed as a share of its limit; infinite when a joint that must not move does."""
    if use.velocity_limit > 0.0:
        return use.peak_velocity / use.velocity_limit
    return 0.0 if use.peak_velocity == 0.0 else math.inf


def _is_position_worse(use: JointUse) -> bool:
    """Whether the joint comes nearer to its position limit than to its speed limit, each as a share of the limit."""
    half_range = 0.5 * (use.upper - use.lower)
    if not math.isfinite(half_range):
        return False
    return use.margin <= half_range * (1.0 - velocity_ratio(use)) if half_range > 0.0 else True


def clearance_record(minima: Mapping[ClearanceClass, ClearanceMinimum]) -> Record:
    """Smallest distance of the whole cell and of each class."""
    measured = [minimum for minimum in minima.values() if minimum.minimum is not None]
    record = {"whole": _whole_record(measured)}
    order = (ClearanceClass.ROBOT_ROBOT, ClearanceClass.SELF, ClearanceClass.PART, ClearanceClass.ENVIRONMENT)
    return record | {str(kind): _minimum_record(minima.get(kind, ClearanceMinimum())) for kind in order}


def _whole_record(measured: list[ClearanceMinimum]) -> Record:
    """The smallest of all classes; it is certified when every class is."""
    if not measured:
        return _minimum_record(ClearanceMinimum())
    smallest = min(measured, key=lambda minimum: minimum.minimum or 0.0)
    return _minimum_record(replace(smallest, certified=all(minimum.certified for minimum in measured)))


def _minimum_record(minimum: ClearanceMinimum) -> Record:
    return {
        "minimum_mm": None if minimum.minimum is None else number(1e3 * minimum.minimum),
        "pair": list(minimum.pair) if minimum.pair else None,
        "at_s": number(minimum.at_s),
        "certified": minimum.certified,
        "exact": minimum.certified and minimum.exact,
        "points_mm": [[number(1e3 * x) for x in point] for point in minimum.points] if minimum.points else None,
    }


def contacts_record(clearance: ClearanceReport) -> list[Record]:
    """Everything that touches, with the stretch of time, allowed or not."""
    return [
        {
            "pair": list(contact.pair),
            "class": str(contact.clearance_class),
            "first_s": number(contact.first_s),
            "last_s": number(contact.last_s),
            "allowed": contact.is_allowed,
            "reason": contact.reason,
        }
        for contact in clearance.contacts
    ]


def exclusions_record(clearance: ClearanceReport) -> list[Record]:
    """Pairs that were not checked, and why."""
    return [{"pair": [first, second], "reason": reason} for first, second, reason in clearance.exclusions]


def _singularity_record(conditioning: Conditioning, times: Array) -> Record:
    """Smallest singular values, condition and manipulability; metres and radians as they come."""
    return {
        "stack": _smallest(conditioning.stack, times),
        "condition": _smallest(conditioning.condition, times),
        "squared_condition": _smallest(conditioning.squared_condition, times),
        "manipulability": _smallest(conditioning.manipulability, times),
        "robots": {robot: _smallest(series, times) for robot, series in conditioning.robots.items()},
    }


def _smallest(series: Array, times: Array) -> Record:
    if not len(series):
        return {"minimum": None, "at_s": None}
    index = int(np.argmin(series))
    return {"minimum": number(series[index]), "at_s": number(times[index])}


def _motion_share_record(report: Report, cell: Cell) -> Record:
    """Who moves how much: share of all motion, and the busiest joint with its travel."""
    travel = {(use.robot, use.joint): use for use in report.joints}
    record: Record = {}
    for robot, (share, joint) in report.motion_share.items():
        use = travel.get((robot, joint))
        scale = math.degrees(1.0) if use is None or use.is_revolute else 1e3
        record[robot] = {
            "role": role(robot, report, cell),
            "share": number(share),
            "busiest_joint": joint,
            "busiest_joint_travel": number(scale * use.travel) if use else None,
            "unit": "deg" if use is None or use.is_revolute else "mm",
        }
    return record


def _speed_record(speed: RobotSpeed) -> Record:
    """How fast a robot moves in the world."""
    return {
        "tool_peak_mm_s": number(1e3 * speed.tool_peak),
        "tool_peak_at_s": number(speed.tool_peak_at_s),
        f"share_above_{1e3 * REDUCED_SPEED:.0f}_mm_s": number(speed.share_above_reduced),
        "axis_peak_mm_s": number(1e3 * speed.axis_peak),
        "axis": speed.axis,
        "axis_peak_at_s": number(speed.axis_peak_at_s),
    }


def role(robot: str, report: Report, cell: Cell) -> str:
    """``positioner``, ``operator``, or ``idle`` for a robot that neither holds the part nor works in this run."""
    if robot in cell.positioners:
        return "positioner"
    return "operator" if any(accuracy.robot == robot for accuracy in report.accuracy) else "idle"
