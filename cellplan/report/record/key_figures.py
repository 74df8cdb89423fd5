"""Key figures of a program as flat values, for tables with a row for each variant of a cell."""

from collections.abc import Sequence
from typing import Annotated, TypedDict

import numpy as np

from cellplan.model.report import Report, TaskAccuracy
from cellplan.model.units import DEG, MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.joints import velocity_ratio
from cellplan.report.record.merging import merge_accelerations, merge_joint_uses, merge_minima


class KeyFigures(TypedDict):
    """The worst values of a program over all its phases."""

    cycle_time_s: Annotated[Number, "duration of the program"]
    failed_checks: Annotated[int, "checks that failed"]
    max_position_error_mm: Annotated[Number, "largest position error of a tool, at the rows or between them"]
    max_orientation_error_deg: Annotated[Number, "largest orientation error of a tool, likewise"]
    min_margin_deg: Annotated[Number, "smallest distance of a revolute joint from a position limit"]
    min_margin_joint: Annotated[str | None, "that joint"]
    max_velocity_ratio: Annotated[Number, "largest joint velocity as a share of its limit"]
    max_velocity_joint: Annotated[str | None, "that joint"]
    max_acceleration_ratio: Annotated[Number, "largest joint acceleration as a share of its limit, where one counts"]
    max_acceleration_joint: Annotated[str | None, "that joint"]
    min_clearance_mm: Annotated[Number, "smallest certified distance of two bodies"]
    min_clearance_pair: Annotated[str | None, "these bodies"]
    max_tool_speed_mm_s: Annotated[Number, "largest speed of a tool tip in the world"]


def key_figures(reports: Sequence[Report]) -> KeyFigures:
    """The worst values of all phases of a program.

    Args:
        reports: The report of each phase.
    """
    joints = list(merge_joint_uses(use for report in reports for use in report.joints))
    turning = [use for use in joints if use.is_revolute and np.isfinite(use.margin)]
    margin = min(turning, key=lambda use: use.margin, default=None)
    fastest = max(joints, key=velocity_ratio, default=None)
    accelerations = merge_accelerations(report.accelerations for report in reports).joints
    limited = [use for use in accelerations if use.ratio is not None]
    hardest = max(limited, key=lambda use: use.ratio or 0.0, default=None)
    minima = [found for found in merge_minima(list(reports)).values() if found.minimum is not None]
    nearest = min(minima, key=lambda found: found.minimum or 0.0, default=None)
    accuracy = [task for report in reports for task in report.accuracy]
    speeds = [speed.tool_peak for report in reports for speed in report.speeds.values()]
    return {
        "cycle_time_s": number(sum(report.cycle_time for report in reports)),
        "failed_checks": sum(not check.passed for report in reports for check in report.checks),
        "max_position_error_mm": number(MM * max(map(_position_error, accuracy), default=0.0)),
        "max_orientation_error_deg": number(DEG * max(map(_orientation_error, accuracy), default=0.0)),
        "min_margin_deg": number(DEG * margin.margin) if margin else None,
        "min_margin_joint": f"{margin.robot}/{margin.joint}" if margin else None,
        "max_velocity_ratio": number(velocity_ratio(fastest)) if fastest else None,
        "max_velocity_joint": f"{fastest.robot}/{fastest.joint}" if fastest else None,
        "max_acceleration_ratio": number(hardest.ratio) if hardest else None,
        "max_acceleration_joint": f"{hardest.robot}/{hardest.joint}" if hardest else None,
        "min_clearance_mm": number(MM * nearest.minimum) if nearest and nearest.minimum is not None else None,
        "min_clearance_pair": " - ".join(nearest.pair) if nearest and nearest.pair else None,
        "max_tool_speed_mm_s": number(MM * max(speeds, default=0.0)),
    }


def _position_error(task: TaskAccuracy) -> float:
    """Largest position error of a tool in [m], at the rows and between them."""
    at_rows = float(np.linalg.norm(task.position_error, axis=1).max())
    return at_rows if task.between is None else max(at_rows, task.between.position.largest)


def _orientation_error(task: TaskAccuracy) -> float:
    """Largest orientation error of a tool in [rad], likewise."""
    at_rows = float(np.linalg.norm(task.orientation_error, axis=1).max())
    return at_rows if task.between is None else max(at_rows, task.between.orientation.largest)
