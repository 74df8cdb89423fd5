"""Joints that fail during the motion: whether they remain at rest, and the effect on the tasks."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.report.report import Check, TaskAccuracy
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.model.settings.task import ToleranceEntry

STANDSTILL_TOL: Final = 1e-9  # [deg] or [mm] a joint that stands still may differ by: a thousand units in the tables


def check_locked(cell: Cell, times: Array, q: RobotRows) -> list[Check]:
    """Whether each joint that fails stays where it is from its instant on.

    Args:
        times: Times in [s], shape (N,).
    """
    return [_check(cell, lock, times, q[lock.robot]) for lock in cell.motion.locked]


def with_locked_joints(
    checks: Iterable[Check],
    errors: TaskAccuracy,
    tolerance: ToleranceEntry,
    *,
    times: Array,
    locked: Iterable[LockedJointEntry],
) -> list[Check]:
    """Failed checks on the accuracy of one task, with the joints that had failed when its tool left the path.

    Args:
        times: Times in [s], shape (N,).
    """
    outside = np.linalg.norm(errors.position_error, axis=1) > tolerance.position_mm.si
    outside |= np.linalg.norm(errors.orientation_error, axis=1) > tolerance.orientation_deg.si
    if not outside.any():
        return list(checks)
    left = float(times[np.argmax(outside)])
    names = [f"{lock.robot}/{lock.joint} locked at {lock.from_s:.3f} s" for lock in locked if lock.from_s <= left]
    if not names:
        return list(checks)
    reason = f"after {' and '.join(names)}: the other joints cannot compensate"
    return [check if check.passed else replace(check, message=f"{check.message}, {reason}") for check in checks]


def _check(cell: Cell, lock: LockedJointEntry, times: Array, q: Array) -> Check:
    """One joint: the farthest it goes from where it was when it failed."""
    index = cell.robot(lock.robot).model.joint_names.index(lock.joint)
    unit, scale = cell.robot(lock.robot).model.joints[index].display_unit
    after = np.flatnonzero(times >= lock.from_s)
    name = f"joint {lock.robot}/{lock.joint}"
    if not len(after):
        message = f"{name} is locked from {lock.from_s:.3f} s on, after the end at {times[-1]:.3f} s"
        return _verdict(lock, message, value=0.0, unit=unit, at_s=None)
    first = int(after[0])
    moved = scale * np.abs(q[first:, index] - q[first, index])
    worst = int(np.argmax(moved))
    value, at_s = float(moved[worst]), float(times[first + worst])
    if value <= STANDSTILL_TOL:
        message = f"{name} stands still at {scale * q[first, index]:.4f} {unit} from {lock.from_s:.3f} s on"
    else:
        message = f"{name} is locked from {lock.from_s:.3f} s on but moves by {value:.4g} {unit}, worst at {at_s:.3f} s"
    return _verdict(lock, message, value=value, unit=unit, at_s=at_s)


def _verdict(lock: LockedJointEntry, message: str, *, value: float, unit: str, at_s: float | None) -> Check:
    joint, limit = f"{lock.robot}/{lock.joint}", STANDSTILL_TOL
    return Check("locked_joint", joint, value <= limit, message, value=value, limit=limit, unit=unit, at_s=at_s)
