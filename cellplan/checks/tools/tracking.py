"""Errors of tools on the part and of co-holders on their grasps against what is allowed."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check, ClosureAccuracy, TaskAccuracy
from cellplan.model.task.task import Task
from cellplan.model.units import DEG, MM

CURE: Final = "a shorter motion.step_s, a slower motion or a path farther from singularities reduces it"


def check_accuracy(schedule: Schedule, accuracy: TaskAccuracy, task: Task) -> tuple[Check, Check]:
    """Position and orientation error of one task against its tolerance, from the instant on that it has settled."""
    position = np.linalg.norm(accuracy.position_error, axis=1)
    orientation = np.linalg.norm(accuracy.orientation_error, axis=1)
    first, allowed = task.first_judged(schedule.times), task.tolerance
    checks = (
        worst_error(
            "position_error",
            schedule.times[first:],
            MM * position[first:],
            subject=task.name,
            limit=allowed.position_mm,
            words=("mm", f"of task '{task.name}'"),
        ),
        worst_error(
            "orientation_error",
            schedule.times[first:],
            DEG * orientation[first:],
            subject=task.name,
            limit=allowed.orientation_deg,
            words=("deg", f"of task '{task.name}'"),
        ),
    )
    since = f", evaluated from {task.judged_from:g} s" if task.settle > 0.0 else ""
    position_check, orientation_check = (replace(check, message=f"{check.message}{since}") for check in checks)
    return position_check, orientation_check


def worst_error(name: str, times: Array, error: Array, *, subject: str, limit: float, words: tuple[str, str]) -> Check:
    """The worst instant of one error against its limit.

    Args:
        times: Times in [s] at which it is judged, shape (N,).
        error: Lengths of the error in the unit of the limit, shape (N,).
        words: Unit, and whose error it is.
    """
    worst = int(np.argmax(error))
    value, at_s = float(error[worst]), float(times[worst])
    unit, of = words
    message = f"{name.replace('_', ' ')} {of}: {value:.3g} {unit} at {at_s:.3f} s, allowed {limit:g} {unit}"
    return Check(name, subject, value <= limit, message, value=value, limit=limit, unit=unit, at_s=at_s)


def check_closure(cell: Cell, times: Array, closures: Sequence[ClosureAccuracy]) -> list[Check]:
    """Position and orientation error of every closure against what the cell allows."""
    checks = []
    for closure in closures:
        of = f"of '{closure.robot}' on the part"
        checks += [
            worst_error(
                "closure_position_error",
                times,
                MM * np.linalg.norm(closure.position_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_mm,
                words=("mm", of),
            ),
            worst_error(
                "closure_orientation_error",
                times,
                DEG * np.linalg.norm(closure.orientation_error, axis=1),
                subject=closure.robot,
                limit=cell.checks.closure_deg,
                words=("deg", of),
            ),
        ]
    return [check if check.passed else replace(check, message=f"{check.message}; {CURE}") for check in checks]
