"""Idle robots: each stays at its home, from the first row of its table to the last."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot, RobotRows
from cellplan.model.report.report import Check

HOME_TOL: Final = 1e-7  # [deg] or [mm]: tables have twelve decimals, and cells as many


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
