"""Errors of tools on the part and of co-holders on their grasps against what is allowed."""

from collections.abc import Iterator, Mapping, Sequence
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


def check_accuracy(schedule: Schedule, accuracy: TaskAccuracy, task: Task) -> tuple[Check, ...]:
    """Position and orientation error of one task against its tolerance, from the instant on that it has settled."""
    allowed, since = task.tolerance, f", evaluated from {task.judged_from:g} s" if task.settle > 0.0 else ""
    scheduled = next((it for it in schedule.tasks if it.task.name == task.name), None)
    easing = np.ones(len(schedule.times)) if scheduled is None else scheduled.easing(schedule.times)
    turned = np.full(len(easing), allowed.orientation_deg)
    limits = {"position_error": allowed.position_mm / easing, "orientation_error": turned}
    first, of = task.first_judged(schedule.times), f"of task '{task.name}'"
    checks = _worst_errors(schedule.times, accuracy, limits, first=first, subject=task.name, of=of)
    cone = {"orientation_error": f" beyond a tilt of {DEG * task.tilt:.6g} deg"} if task.tilt else {}
    return tuple(replace(check, message=f"{check.message}{cone.get(check.name, '')}{since}") for check in checks)


def check_closure(cell: Cell, times: Array, closures: Sequence[ClosureAccuracy]) -> list[Check]:
    """Position and orientation error of every closure against what the cell allows."""
    allowed, checks = cell.checks, list[Check]()
    limits = {
        "closure_position_error": np.full(len(times), allowed.closure_mm),
        "closure_orientation_error": np.full(len(times), allowed.closure_deg),
    }
    for closure in closures:
        of = f"of '{closure.robot}' on the part"
        checks += _worst_errors(times, closure, limits, first=0, subject=closure.robot, of=of)
    return [check if check.passed else replace(check, message=f"{check.message}; {CURE}") for check in checks]


def _worst_errors(
    times: Array,
    errors: TaskAccuracy | ClosureAccuracy,
    limits: Mapping[str, Array],
    *,
    first: int,
    subject: str,
    of: str,
) -> Iterator[Check]:
    """Position and orientation error, from a row on, where each is nearest to its limits in [mm] or [deg], (N,)."""
    kinds = (errors.position_error, MM, "mm"), (errors.orientation_error, DEG, "deg")
    for (name, allowed), (error, scale, unit) in zip(limits.items(), kinds, strict=True):
        lengths = scale * np.linalg.norm(error[first:], axis=1)
        worst = int(np.argmax(lengths / allowed[first:]))
        value, limit, at_s = float(lengths[worst]), float(allowed[first + worst]), float(times[first + worst])
        message = f"{name.replace('_', ' ')} {of}: {value:.3g} {unit} at {at_s:.3f} s, allowed {limit:g} {unit}"
        yield Check(name, subject, value <= limit, message, value=value, limit=limit, unit=unit, at_s=at_s)
