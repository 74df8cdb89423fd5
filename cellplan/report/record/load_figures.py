"""Load of a program: how hard joints and tools work at its cycle time, as flat values for curves and tables."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Final, TypedDict

import numpy as np

from cellplan.model.report import Report
from cellplan.model.units import MM
from cellplan.report.record.common import Number, number
from cellplan.report.record.key_figures import key_figures

SECONDS_PER_HOUR: Final = 3600.0


class LoadFigures(TypedDict):
    """The worst values of a program over all its phases, and its energy proxy."""

    cycle_time_s: Annotated[Number, "duration of the program"]
    parts_per_h: Annotated[Number, "programs in an hour, one after the other"]
    load_ratio: Annotated[Number, "share of the cycle in which the limits would allow the same motion; 1: the shortest"]
    max_velocity_ratio: Annotated[Number, "largest joint velocity as a share of its limit"]
    max_velocity_joint: Annotated[str | None, "that joint"]
    max_acceleration_ratio: Annotated[Number, "largest joint acceleration as a share of its limit, where one counts"]
    max_acceleration_joint: Annotated[str | None, "that joint"]
    max_tool_speed_mm_s: Annotated[Number, "largest speed of a tool tip in the world"]
    max_tool_speed_robot: Annotated[str | None, "its robot"]
    max_axis_speed_mm_s: Annotated[Number, "largest speed of a point on a joint axis: shoulder, elbow or wrist"]
    max_axis_speed_joint: Annotated[str | None, "that axis"]
    share_above_250_mm_s: Annotated[Number, "largest share of the cycle in which a tool tip is faster than 250 mm/s"]
    share_above_250_robot: Annotated[str | None, "its robot"]
    energy_proxy_s: Annotated[Number, "sum over all joints of the integral of (velocity / limit)^2 over the time"]
    min_margin_deg: Annotated[Number, "smallest distance of a revolute joint from a position limit"]
    min_margin_joint: Annotated[str | None, "that joint"]
    min_clearance_mm: Annotated[Number, "smallest certified distance of two bodies; null if it was not certified"]
    min_clearance_pair: Annotated[str | None, "these bodies"]
    failed_checks: Annotated[int, "checks that failed"]


class RobotSpeedRecord(TypedDict):
    """Speeds of a robot in the world over all phases of a program."""

    tool_peak_mm_s: Annotated[Number, "largest speed of the tool tip"]
    share_above_250_mm_s: Annotated[Number, "fraction of the cycle, 0 to 1, in which the tip is faster than 250 mm/s"]
    axis_peak_mm_s: Annotated[Number, "largest speed of a point on a joint axis"]
    axis: Annotated[str, "that axis"]


def load_figures(reports: Sequence[Report], *, cycle: float, load: float) -> LoadFigures:
    """The load of a program.

    Args:
        reports: The report of each phase.
        cycle: Time from the first row of the program to the last one in [s].
        load: Share of its time in which the limits would allow the same motion.
    """
    key = key_figures(reports)
    speeds = robot_speeds(reports, cycle)
    tool = max(speeds, key=lambda name: speeds[name]["tool_peak_mm_s"] or 0.0)
    axis = max(speeds, key=lambda name: speeds[name]["axis_peak_mm_s"] or 0.0)
    above = max(speeds, key=lambda name: speeds[name]["share_above_250_mm_s"] or 0.0)
    return {
        "cycle_time_s": number(cycle),
        "parts_per_h": number(SECONDS_PER_HOUR / cycle),
        "load_ratio": number(load),
        "max_velocity_ratio": key["max_velocity_ratio"],
        "max_velocity_joint": key["max_velocity_joint"],
        "max_acceleration_ratio": key["max_acceleration_ratio"],
        "max_acceleration_joint": key["max_acceleration_joint"],
        "max_tool_speed_mm_s": speeds[tool]["tool_peak_mm_s"],
        "max_tool_speed_robot": tool,
        "max_axis_speed_mm_s": speeds[axis]["axis_peak_mm_s"],
        "max_axis_speed_joint": f"{axis}/{speeds[axis]['axis']}",
        "share_above_250_mm_s": speeds[above]["share_above_250_mm_s"],
        "share_above_250_robot": above,
        "energy_proxy_s": number(sum(energy_proxy(report) for report in reports)),
        "min_margin_deg": key["min_margin_deg"],
        "min_margin_joint": key["min_margin_joint"],
        "min_clearance_mm": key["min_clearance_mm"],
        "min_clearance_pair": key["min_clearance_pair"],
        "failed_checks": key["failed_checks"],
    }


def robot_speeds(reports: Sequence[Report], cycle: float) -> Mapping[str, RobotSpeedRecord]:
    """Speeds of each robot in the world over all phases, by robot; arguments as in ``load_figures``."""
    found: dict[str, RobotSpeedRecord] = {}
    for name in reports[0].speeds:
        every = [report.speeds[name] for report in reports]
        above = sum(speed.share_above_reduced * report.cycle_time for speed, report in zip(every, reports, strict=True))
        axis = max(every, key=lambda speed: speed.axis_peak)
        found[name] = {
            "tool_peak_mm_s": number(MM * max(speed.tool_peak for speed in every)),
            "share_above_250_mm_s": number(above / cycle),
            "axis_peak_mm_s": number(MM * axis.axis_peak),
            "axis": axis.axis,
        }
    return found


def energy_proxy(report: Report) -> float:
    r"""A figure that grows with the losses of all drives, in [s]; it is no energy in joules.

    .. math:: E = \sum_j \int_0^T \left( \dot q_j / \dot q_{j,\max} \right)^2 dt

    Along the same path it is inversely proportional to the cycle time. Masses and motors are not in it: it compares
    programs of one cell, not cells.

    Args:
        report: The report of one phase.
    """
    found, steps = 0.0, np.diff(report.times)
    for robot, speeds in report.qd.items():
        limits = np.array([use.velocity_limit for use in report.joints if use.robot == robot])
        turns = limits > 0.0
        found += float(steps @ np.sum((speeds[:, turns] / limits[turns]) ** 2, axis=1))
    return found
