"""What every joint does in the three modes of Ribeiro 2010, for the claims of sections 5.3.2 to 5.6."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from cellplan import Report
from reproduction.runs import Numbers

ROBOTS = ("reis", "kuka", "abb", "staubli")


def joint_numbers(reports: Mapping[int, Sequence[Report]]) -> Numbers:
    """By mode, robot and joint; of the positioner in mode 2 by task, as it works in all three runs."""
    result: Numbers = {}
    for mode, runs in reports.items():
        result[f"mode_{mode}"] = {
            robot: _of_robot(report, robot)
            for robot in ROBOTS
            if (report := next((run for run in runs if np.any(run.qd[robot])), None)) is not None
        }
    result["positioner"] = {report.tasks[0]: _of_robot(report, "reis") for report in reports[2]}
    return result


def _of_robot(report: Report, robot: str) -> Numbers:
    """Range, largest speed and acceleration, and room to both limits, of each joint of a robot, in degrees."""
    steps = np.diff(report.times)
    fastest = np.abs(np.diff(report.qd[robot], axis=0) / (0.5 * (steps[1:] + steps[:-1]))[:, None]).max(axis=0)
    uses = [use for use in report.joints if use.robot == robot]
    return {
        use.joint: {
            "range_deg": math.degrees(use.max - use.min),
            "speed_deg_s": math.degrees(use.peak_velocity),
            "acceleration_deg_s2": math.degrees(fastest[column]),
            "to_upper_deg": math.degrees(use.upper - use.max),
            "to_lower_deg": math.degrees(use.min - use.lower),
        }
        for column, use in enumerate(uses)
    }
