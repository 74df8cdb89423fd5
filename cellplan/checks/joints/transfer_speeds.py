"""Robots beside the tasks: idle ones stay at home, transfer moves at the speeds that ``program.transfer`` allows."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.certify.point_speeds import point_speeds
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot, RobotRows, stacked_positions
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check, JointUse
from cellplan.model.settings.units import si_or_none
from cellplan.model.units import MM
from cellplan.scene.scene import Scene

HOME_TOL: Final = 1e-7  # [deg] or [mm]: tables have twelve decimals, and cells as many
ROUNDING: Final = 1e-9  # [-] of a speed: times of rows have 12 decimals of a second


def check_transfer_speeds(scene: Scene, schedule: Schedule, uses: Sequence[JointUse], q: RobotRows) -> list[Check]:
    """The fastest joint and the fastest point of each robot where no task is worked on, as far as they are limited.

    The speed of a point is a bound that holds between the rows too.
    """
    if schedule.tasks:
        return []
    limits, checks = scene.cell.program.transfer, list[Check]()
    for robot in scene.cell.robots if limits.share < 1.0 else ():
        shares = {use: use.peak_velocity / use.velocity_limit for use in uses if use.robot == robot.name}
        fastest = max(shares, key=lambda use: shares[use])
        what, at_s = f"joint {robot.name}/{fastest.joint} goes", fastest.peak_velocity_at_s
        value = 100.0 * shares[fastest], "% of its velocity limit"
        checks.append(_check("transfer_joint_speed", robot.name, what, value, limit=limits.speed_percent, at_s=at_s))
    stacked, steps = stacked_positions(scene.cell, q), np.diff(schedule.times)
    for points in point_speeds(scene, si_or_none(limits.tcp_mm_s)):
        speeds = points.travel(stacked) / steps
        fastest_step = int(np.argmax(speeds))
        what, at_s = f"tool tip, flange or held part of {points.robot} may go", float(schedule.times[fastest_step])
        value = MM * float(speeds[fastest_step]), "mm/s"
        checks.append(_check("transfer_speed", points.robot, what, value, limit=MM * points.limit, at_s=at_s))
    return checks


def _check(name: str, robot: str, what: str, value: tuple[float, str], *, limit: float, at_s: float) -> Check:
    """A largest speed, with its unit, against its limit."""
    speed, unit = value
    passed, word = speed <= (1.0 + ROUNDING) * limit, unit.partition(" ")[0]
    message = f"{what} at {speed:.4g} {unit} in a transfer move at {at_s:.3f} s, allowed {limit:g} {unit}"
    return Check(name, robot, passed, message, value=speed, limit=limit, unit=word, at_s=at_s)


def check_idle(cell: Cell, idle: Sequence[str], times: Array, q: RobotRows) -> list[Check]:
    """One check for each idle robot: its largest distance from its home.

    Args:
        cell: The cell; a robot without a home is held against its first row.
        times: Times of the rows in [s], shape (N,).
    """
    return [_stands(cell.robot(name), times, q[name]) for name in idle]


def _stands(robot: Robot, times: Array, q: Array) -> Check:
    """Whether one robot stands at its home."""
    scales = np.array([joint.display_unit.scale for joint in robot.model.joints])
    away = np.abs(q - (q[0] if robot.home is None else robot.home)) * scales
    row, column = np.unravel_index(int(np.argmax(away)), away.shape)
    joint, value = robot.model.joints[column], float(away[row, column])
    unit, passed = joint.display_unit.name, value <= HOME_TOL
    outcome = f"stays at its home, at most {value:.2g} {unit} from it" if passed else ""
    far = f"joint {joint.name} is {value:.6g} {unit} from its home at {times[row]:.3f} s, although the robot is idle"
    message = f"idle robot {robot.name}: {outcome or far}"
    return Check("home", robot.name, passed, message, value=value, limit=HOME_TOL, unit=unit, at_s=float(times[row]))
