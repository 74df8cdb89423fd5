"""Shares of the robots in the motion, their speeds in the world, and their distance to singularities."""

from typing import Annotated, TypedDict

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Conditioning, Report, RobotSpeed
from cellplan.model.units import DEGREES, MM
from cellplan.report.record.common import ExtremeRecord, Number, number, smallest


class SingularityRecord(TypedDict):
    """Smallest values of the constrained rows J over the moving joints; mixed units: metres and radians."""

    stack: Annotated[ExtremeRecord, "smallest singular value of J"]
    condition: Annotated[ExtremeRecord, "ratio of the smallest to the largest singular value of J, 0 to 1"]
    squared_condition: Annotated[ExtremeRecord, "the same of `J J^T`: the square of `condition` (Vargas 2012)"]
    manipulability: Annotated[ExtremeRecord, "`sqrt(det(J J^T))`, the product of the singular values of J"]
    robots: Annotated[dict[str, ExtremeRecord], "by robot: smallest singular value of its own block"]


class MotionShareRecord(TypedDict):
    """Share of a robot in the motion."""

    role: Annotated[str, "`positioner`, `operator` or `idle`"]
    share: Annotated[Number, "fraction of all joint travel, 0 to 1"]
    busiest_joint: Annotated[str, "the joint that travels most"]
    busiest_joint_travel: Annotated[Number, "its travel, in `unit`"]
    unit: Annotated[str, "`deg` or `mm`"]


class SpeedRecord(TypedDict):
    """Speeds of a robot in the world."""

    tool_peak_mm_s: Annotated[Number, "largest speed of the tool tip"]
    tool_peak_at_s: Annotated[Number, "its time"]
    share_above_250_mm_s: Annotated[
        Number, "fraction of the cycle, 0 to 1, in which the tip is faster than the reduced speed of ISO 10218-1"
    ]
    axis_peak_mm_s: Annotated[Number, "largest speed of a point on a joint axis"]
    axis: Annotated[str, "that axis"]
    axis_peak_at_s: Annotated[Number, "its time"]


def singularity_record(conditioning: Conditioning | None, times: Array) -> SingularityRecord | None:
    """Smallest singular values, condition and manipulability; mixed units: metres and radians."""
    if conditioning is None:
        return None
    return {
        "stack": smallest(conditioning.stack, times),
        "condition": smallest(conditioning.condition, times),
        "squared_condition": smallest(conditioning.squared_condition, times),
        "manipulability": smallest(conditioning.manipulability, times),
        "robots": {robot: smallest(series, times) for robot, series in conditioning.robots.items()},
    }


def motion_share_record(report: Report, cell: Cell) -> dict[str, MotionShareRecord]:
    """Share of all motion by robot, and its busiest joint."""
    uses = {(use.robot, use.joint): use for use in report.joints}
    record: dict[str, MotionShareRecord] = {}
    for robot, (share, joint) in report.motion_share.items():
        use = uses.get((robot, joint))
        unit, scale = DEGREES if use is None else use.display_unit
        record[robot] = {
            "role": role(robot, report, cell),
            "share": number(share),
            "busiest_joint": joint,
            "busiest_joint_travel": number(scale * use.travel) if use else None,
            "unit": unit,
        }
    return record


def role(robot: str, report: Report, cell: Cell) -> str:
    """``positioner``, ``operator``, or ``idle`` for a robot that neither holds the part nor has anything to do."""
    if robot in cell.positioners:
        return "positioner"
    is_transferred = not report.tasks and robot not in report.idle
    is_at_work = any(accuracy.robot == robot for accuracy in report.accuracy)
    return "operator" if is_at_work or is_transferred else "idle"


def speed_record(speed: RobotSpeed) -> SpeedRecord:
    """Largest speeds of a robot in the world."""
    return {
        "tool_peak_mm_s": number(MM * speed.tool_peak),
        "tool_peak_at_s": number(speed.tool_peak_at_s),
        "share_above_250_mm_s": number(speed.share_above_reduced),
        "axis_peak_mm_s": number(MM * speed.axis_peak),
        "axis": speed.axis,
        "axis_peak_at_s": number(speed.axis_peak_at_s),
    }
