"""Speeds: of tools and arms in the world, as a risk assessment needs them, and of the process on the part."""

from collections.abc import Mapping

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.measures.tool_errors import points_of_travel
from cellplan.model.cell.acceleration import STEADY_FRACTION, ProcessSpeed
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import REDUCED_SPEED, Check, RobotSpeed
from cellplan.model.settings.units import si_or_none
from cellplan.model.units import MM
from cellplan.scene.kinematics.screw_chain import ScrewChain


def robot_speed(robot: Robot, chain: ScrewChain, times: Array, q: Array) -> RobotSpeed:
    """Largest speeds of one robot's tool tip and joint axes; between two samples a point moves along the chord.

    Args:
        times: Times in [s], shape (N,).
        q: Positions, shape (N, n).
    """
    tool = _speeds(chain.tool_poses(q)[:, :3, 3], times)
    axes = _speeds(chain.axis_points(q), times)
    fastest = int(np.argmax(tool))
    joint = first_peak(axes.max(axis=0))  # axes that meet in a wrist have one speed
    instant = first_peak(axes[:, joint])
    return RobotSpeed(
        tool_peak=float(tool[fastest]),
        tool_peak_at_s=float(times[fastest + 1]),
        share_above_reduced=float(np.mean(tool > REDUCED_SPEED)),
        axis_peak=float(axes.max()),
        axis=robot.model.joint_names[joint],
        axis_peak_at_s=float(times[instant + 1]),
    )


def check_tool_speeds(cell: Cell, speeds: Mapping[str, RobotSpeed]) -> list[Check]:
    """The largest speed of each tool tip in the world, where the cell allows no more."""
    limit = si_or_none(cell.checks.tool_speed_mm_s)
    if limit is None:
        return []
    checks = []
    for name, speed in speeds.items():
        peak, most, at_s = MM * speed.tool_peak, MM * limit, speed.tool_peak_at_s
        peak_words = f"has a peak speed of {peak:.4g} mm/s in the world at {at_s:.3f} s"
        message, passed = f"tool of {name} {peak_words}, allowed {most:g} mm/s", speed.tool_peak <= limit
        checks.append(Check("tool_speed", name, passed, message, value=peak, limit=most, unit="mm/s", at_s=at_s))
    return checks


def process_speeds(schedule: Schedule, X_WT: Mapping[str, Array], X_WP: Array) -> dict[str, ProcessSpeed]:
    """Speed of every tool that moves along its path, by task; of one that weaves, that along its seam.

    Args:
        X_WT: Tool poses in the world, shape (N, 4, 4), by robot.
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    speeds = {
        scheduled.task.name: _process_speed(schedule, scheduled, X_WT[scheduled.task.robot], X_WP)
        for scheduled in schedule.tasks
    }
    return {name: speed for name, speed in speeds.items() if speed is not None}


def _process_speed(schedule: Schedule, scheduled: TaskSchedule, X_WT: Array, X_WP: Array) -> ProcessSpeed | None:
    """Speeds between the samples of the path, once settled, without its runs; None for a tool at rest."""
    task, times = scheduled.task, schedule.times
    tolerance = 1e-6 * float(times[-1])  # rounding of times
    begin = max(scheduled.begin + task.settle, scheduled.work[0])
    end = min(scheduled.end, scheduled.work[1])
    steps = np.flatnonzero((times[:-1] >= begin - tolerance) & (times[1:] <= end + tolerance))
    if not len(steps) or not scheduled.length > 0.0:
        return None
    points = points_of_travel(schedule, scheduled, X_WT, X_WP)
    speeds = (np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times))[steps]
    lengths = np.diff(times)[steps]
    peak = float(speeds.max())
    if not peak > 0.0:
        return None
    is_slow = speeds < (1.0 - STEADY_FRACTION) * peak
    return ProcessSpeed(
        mean=float(speeds @ lengths / lengths.sum()),
        peak=peak,
        peak_at_s=float(times[steps[int(np.argmax(speeds))] + 1]),
        steady_share=float(lengths[~is_slow].sum() / lengths.sum()),
        slower=_stretches(is_slow, times[steps], times[steps + 1]),
    )


def _stretches(
    flags: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], begins: Array, ends: Array
) -> tuple[tuple[float, float], ...]:
    """Stretches of time over neighbouring steps that are flagged."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return tuple((float(begins[a]), float(ends[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _speeds(points: Array, times: Array) -> Array:
    """Speeds of points, shape (N, ..., 3), between the samples in [m/s], shape (N - 1, ...)."""
    steps = np.diff(times).reshape(-1, *[1] * (points.ndim - 2))
    return np.linalg.norm(np.diff(points, axis=0), axis=-1) / steps
