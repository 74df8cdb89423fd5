"""Checks of tool errors between the rows of the tables."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from cellplan.checks.tools.between_rows import ErrorsBetweenRows
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.between_rows import BetweenError
from cellplan.model.report.report import Check, ClosureAccuracy, TaskAccuracy
from cellplan.model.settings.task import ToleranceEntry
from cellplan.model.units import DEGREES, MILLIMETRES
from cellplan.scene.scene import Scene

BETWEEN: Final = "_between_rows"  # what the name of a check ends with


def check_between_rows(
    scene: Scene,
    schedule: Schedule,
    q: RobotRows,
    *,
    accuracy: Sequence[TaskAccuracy],
    closures: Sequence[ClosureAccuracy],
    off: Sequence[Array] | None = None,
) -> tuple[tuple[TaskAccuracy, ...], tuple[ClosureAccuracy, ...]]:
    """The errors of all tasks and closures with those between the rows, where the schedule knows what is desired there.

    Args:
        off: By how much each tool, those of the tasks first, may be off besides at the rows in [m] and [rad], shape
            (N, 2) each; between two rows by no more than the value between both. None for nothing.
    """
    if not schedule.is_continuous or not (accuracy or closures):
        return tuple(accuracy), tuple(closures)
    program = ErrorsBetweenRows(scene, schedule, q)
    of_tasks, of_closures = program.errors_between(accuracy, closures, off)
    return (
        tuple(replace(errors, between=between) for errors, between in zip(accuracy, of_tasks, strict=True)),
        tuple(replace(errors, between=between) for errors, between in zip(closures, of_closures, strict=True)),
    )


def check_task_between(errors: TaskAccuracy, tolerance: ToleranceEntry) -> tuple[Check, ...]:
    """Position and orientation error of one task between the rows against its tolerance."""
    if errors.between is None:
        return ()
    of, allowed = f"of task '{errors.task}'", tolerance.between
    return (
        _check("position_error_between_rows", errors.between.position, errors.task, allowed=allowed[0], of=of),
        _check("orientation_error_between_rows", errors.between.orientation, errors.task, allowed=allowed[1], of=of),
    )


def check_closures_between(cell: Cell, closures: Sequence[ClosureAccuracy]) -> list[Check]:
    """Position and orientation error of every closure between the rows against what the cell allows."""
    checks: list[Check] = []
    for closure in closures:
        if closure.between is None:
            continue
        of, robot, between = f"of '{closure.robot}' on the part", closure.robot, closure.between
        position, orientation = cell.checks.closure_mm.si, cell.checks.closure_deg.si
        checks += [
            _check("closure_position_error_between_rows", between.position, robot, allowed=position, of=of),
            _check("closure_orientation_error_between_rows", between.orientation, robot, allowed=orientation, of=of),
        ]
    return checks


def with_between(at_rows: Sequence[Check], between: Sequence[Check]) -> tuple[Check, ...]:
    """Checks at the rows and between them, but for those of errors that are too large at the rows already."""
    failed = {(check.name, check.subject) for check in at_rows if not check.passed}
    return (*at_rows, *(c for c in between if (c.name.removesuffix(BETWEEN), c.subject) not in failed))


def _check(name: str, error: BetweenError, subject: str, *, allowed: float, of: str) -> Check:
    """The largest error of one kind against its limit, with the step that would keep it."""
    unit, scale = MILLIMETRES if "position" in name else DEGREES
    what, passed = name.removesuffix(BETWEEN).replace("_", " "), error.largest * error.easing <= allowed
    value, limit = scale * error.largest, scale * allowed / error.easing
    message = (
        f"{what} {of} between the rows of its table: {value:.3g} {unit} at {error.at_s:.4f} s, allowed {limit:g} {unit}"
    )
    if error.longest_step is not None:
        message += f"; a motion.step_s of at most {error.longest_step:g} meets the tolerance"
    return Check(name, subject, passed, message, value=value, limit=limit, unit=unit, at_s=error.at_s)
