"""Welding: positions of tools and welds to gravity along their paths, and the distance of tips with an arc at once."""

from collections.abc import Iterator
from itertools import combinations
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.measures.weld_position import position_name, torch_angles, weld_angles
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.report.report import Check
from cellplan.model.task.clocked_path import on_line
from cellplan.model.units import MM
from cellplan.scene.kinematics.screw_chain import Chains

ROUNDING: Final = 1e-7  # [rad] beyond a limit that is stated in whole degrees
MOVES: Final = 1e-9  # [m/s] of a tool along its path: below it there is no direction of travel


def check_weld_positions(schedule: Schedule, chains: Chains, q: RobotRows, X_WP: Array) -> Iterator[Check]:
    """Whether torches and welds keep what their tasks demand, while the tools travel along their paths.

    Args:
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
    """
    for scheduled in schedule.tasks:
        task = scheduled.task
        if task.torch is None and task.weld_position is None:
            continue
        rows = _travelled_rows(scheduled, schedule.times)
        if not len(rows):
            continue
        X_WT = chains[task.robot].tool_poses(q[task.robot][rows])
        R_WP = np.broadcast_to(X_WP, (len(schedule.times), 4, 4))[rows, :3, :3]
        travel = (R_WP @ _travel(scheduled, schedule)[rows, :, None])[..., 0]
        slope, rotation = weld_angles(X_WT, travel / np.linalg.norm(travel, axis=1, keepdims=True))
        times = schedule.times[rows]
        if task.torch is not None:
            yield _within("torch_angle", task.name, torch_angles(X_WT), (-np.inf, task.torch.within_deg.si), times)
        if task.weld_position is not None:
            yield _within("weld_slope", task.name, slope, task.weld_position.slope, times)
            names = sorted({position_name(*angles) for angles in zip(slope.tolist(), rotation.tolist(), strict=True)})
            yield _within("weld_rotation", task.name, rotation, task.weld_position.rotation, times, ", ".join(names))


def _travel(scheduled: TaskSchedule, schedule: Schedule) -> Array:
    """Directions of travel along a path at each row, of any length, shape (N, 3), expressed in P."""
    path = schedule.woven(scheduled.task)
    return scheduled.V_PT_P[:, :3] if path is None else np.gradient(on_line(path, scheduled.travelled)[0], axis=0)


def _travelled_rows(scheduled: TaskSchedule, times: Array) -> Indices:
    """Rows in which a tool travels along its path, shape (M,)."""
    is_on_path = (times >= scheduled.begin) & (times <= scheduled.end)
    return np.flatnonzero(is_on_path & (np.linalg.norm(scheduled.V_PT_P[:, :3], axis=1) > MOVES))


def _within(
    name: str, task: str, angles: Array, limits: tuple[float, float], times: Array, position: str = ""
) -> Check:
    """The check of an angle of one task against its limits in [rad]."""
    low, high = limits
    worst = int(np.argmax(np.maximum(low - angles, angles - high)))
    value, limit = float(angles[worst]), high if angles[worst] - high >= low - angles[worst] else low
    what = {"torch_angle": "angle of the tool from gravity", "weld_slope": "slope of the weld"}
    allowed = f"at most {np.degrees(high):g}" if np.isinf(low) else f"{np.degrees(low):g} to {np.degrees(high):g}"
    named = f", position {position}" if position else ""
    passed, at_s = bool(low - ROUNDING <= value <= high + ROUNDING), float(times[worst])
    value, limit = float(np.degrees(value)), float(np.degrees(limit))
    message = (
        f"{what.get(name, 'rotation of the weld')} of task '{task}': {value:.4g} deg at {at_s:.3f} s{named}, "
        f"allowed {allowed} deg"
    )
    return Check(name, task, passed, message, value=value, limit=limit, unit="deg", at_s=at_s)


def check_arcs(cell: Cell, schedule: Schedule, chains: Chains, q: RobotRows) -> Iterator[Check]:
    """Whether the tips of tools that are on their paths at once keep the distance that the program demands."""
    least, times = cell.program.arcs_apart_mm, schedule.times
    for pair in combinations(schedule.tasks, 2) if least is not None else ():
        on = [(times >= it.task.start) & (times <= it.end + it.task.off_delay) for it in pair]
        rows = np.flatnonzero(on[0] & on[1])
        if least is None or not len(rows):
            continue
        tips = [chains[it.task.robot].tool_poses(q[it.task.robot][rows])[:, :3, 3] for it in pair]
        gaps = np.linalg.norm(tips[1] - tips[0], axis=1)
        worst = int(np.argmin(gaps))
        value, at_s = MM * float(gaps[worst]), float(times[rows[worst]])
        first, second = (it.task.name for it in pair)
        both, passed, limit = f"{first}, {second}", value >= least, float(least)
        message = (
            f"tips of tasks '{first}' and '{second}' on their paths: {value:.4g} mm apart at {at_s:.3f} s, at least "
            f"{least:g} mm are demanded"
        )
        yield Check("arc_distance", both, passed, message, value=value, limit=limit, unit="mm", at_s=at_s)
