"""Where the tools, further holders and bodies of a played program are: against all that its cell demands of them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cellplan.certify.certify import certify
from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.run_pairs import scene_of_run
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.clearance.tool_depth import check_depths, tool_depths
from cellplan.checks.joints.locked import check_locked, with_locked_joints
from cellplan.checks.tools.between_checks import (
    check_between_rows,
    check_closures_between,
    check_task_between,
    with_between,
)
from cellplan.checks.tools.closure import check_closure, closure_accuracy
from cellplan.checks.tools.tracking import check_accuracy, part_poses, task_accuracy
from cellplan.checks.verify import stacked
from cellplan.geometry.arrays import Array, Flags
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.report import Check, TaskAccuracy
from cellplan.model.task import Task
from cellplan.model.units import MM
from cellplan.pipeline.export.margins import body_margin, tool_margin
from cellplan.pipeline.export.schedule_at import schedule_at
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathRows:
    """Joint positions of a phase, straight between times.

    Attributes:
        scene: The cell as it is in the phase.
        schedule: Desired tool poses at the rows of the run.
        times: Times in [s] on the phase's own time, shape (M,).
        q: Positions of all robots there in [rad] or [m], shape (M, n), by robot.
        is_row: Which of them are rows of the run, where what the cell demands of rows holds, shape (M,).
        is_break: Which of them are needed, the joints being straight between these already, shape (M,).
        off: How far all joints may be from the straight motion in each step, shape (M - 1, nq).
    """

    scene: Scene
    schedule: Schedule
    times: Array
    q: Mapping[str, Array]
    is_row: Flags
    is_break: Flags
    off: Array


def path_findings(rows: PathRows) -> Iterator[str]:
    """What the cell demands of the places of tools, holders and bodies, and the rows do not keep."""
    for check in _checks(rows):
        if not check.passed:
            yield check.message
    yield from clearance_findings(rows)


def keeps_demands(rows: PathRows) -> bool:
    """Whether all of it is kept, without a word about what is not: several times as fast where something is not."""
    arms = LeverArms(rows.scene, stacked(rows.scene.cell, rows.q))
    for scheduled in rows.schedule.tasks:
        margin = tool_margin(arms, rows.scene, scheduled.task, rows.off)
        if any(off >= allowed for off, allowed in zip(margin, scheduled.task.tolerance.between, strict=True)):
            return False
    if not all(check.passed for check in _checks(rows)):
        return False
    scene = _demanding(rows)
    return certify(scene, stacked(scene.cell, rows.q)[rows.is_break], with_minimum=False, with_curves=False).is_kept


def _checks(rows: PathRows) -> list[Check]:
    """Tool errors at the rows and between them, depth, further holders, locked joints and mounted bodies."""
    scene, cell, q = rows.scene, rows.scene.cell, rows.q
    arms = LeverArms(scene, stacked(cell, q))
    schedule = _relaxed(schedule_at(rows.schedule, rows.times), rows, arms)
    X_WP = part_poses(cell, scene.chains, q)
    accuracy = tuple(
        task_accuracy(task, scene.chains[task.task.robot], q=q[task.task.robot], X_WP=X_WP) for task in schedule.tasks
    )
    closures = closure_accuracy(cell, scene.chains, q, X_WP)
    accuracy, closures = check_between_rows(scene, schedule, q, accuracy=accuracy, closures=closures)
    checks: list[Check] = []
    for own, given, errors in zip(schedule.tasks, rows.schedule.tasks, accuracy, strict=True):
        tolerance = own.task.tolerance
        found = with_between(check_accuracy(schedule, errors, own.task), check_task_between(errors, tolerance))
        strict = _at_rows(rows, given, errors) if all(check.passed for check in found) else ()
        both = [*found, *strict]
        checks += with_locked_joints(both, errors, tolerance, times=schedule.times, locked=cell.motion.locked)
    checks += with_between(check_closure(cell, schedule.times, closures), check_closures_between(cell, closures))
    checks += check_depths(cell, tool_depths(cell, schedule, scene.chains, q))
    checks += check_locked(cell, schedule.times, q)
    checks += check_mounting(scene, stacked(cell, q), schedule.times)
    return checks


def _relaxed(schedule: Schedule, rows: PathRows, arms: LeverArms) -> Schedule:
    """The schedule with what is allowed between rows everywhere, less what joints may be off the straight motion."""
    tasks = []
    for scheduled in schedule.tasks:
        position, orientation = scheduled.task.tolerance.between
        margin = tool_margin(arms, rows.scene, scheduled.task, rows.off)
        allowed = replace(
            scheduled.task.tolerance,
            position=position - margin[0],
            orientation=orientation - margin[1],
            position_between=position - margin[0],
            orientation_between=orientation - margin[1],
        )
        depth = scheduled.task.tool_depth - margin[0]
        tasks.append(replace(scheduled, task=replace(scheduled.task, tolerance=allowed, tool_depth=depth)))
    return replace(schedule, tasks=tuple(tasks))


def _at_rows(rows: PathRows, given: TaskSchedule, errors: TaskAccuracy) -> tuple[Check, ...]:
    """Errors at the rows of the run, where the cell demands more of them than of what lies between."""
    task: Task = given.task
    tolerance = task.tolerance
    if tolerance.between == (tolerance.position, tolerance.orientation) or not np.any(rows.is_row):
        return ()
    at_rows = replace(
        errors,
        position_error=np.where(rows.is_row[:, None], errors.position_error, 0.0),
        orientation_error=np.where(rows.is_row[:, None], errors.orientation_error, 0.0),
    )
    return check_accuracy(replace(rows.schedule, times=rows.times), at_rows, task)


def clearance_findings(rows: PathRows) -> Iterator[str]:
    """The pairs of bodies that are found first to touch or not to keep their distance; others are not searched then."""
    scene = _demanding(rows)
    bound = certify(scene, stacked(scene.cell, rows.q)[rows.is_break], with_minimum=False, with_curves=False)
    if bound.is_kept:
        return
    found = [pair for pair in bound.pairs if pair.touches or pair.unproved or pair.distance < pair.demand]
    for pair in found:
        first, second = bound.names(pair)
        sample = min((*pair.touches, *pair.unproved), default=pair.at)
        at_s = float(np.interp(sample, np.arange(rows.is_break.sum()), rows.times[rows.is_break]))
        kept = "touch" if pair.touches else "are not proved to keep their distance"
        if not pair.touches and pair.distance < pair.demand:
            kept = f"come as near as {MM * pair.distance:.4g} mm or nearer"
        yield f"clearance: {first} and {second} {kept}, at {at_s:.3f} s, demanded {MM * pair.demand:.4g} mm"
    if not found:
        yield "clearance: not certified"


def _demanding(rows: PathRows) -> Scene:
    """The scene of a phase whose pairs are to keep what joints may be off besides their clearance."""
    scene = scene_of_run(rows.scene, [scheduled.task.name for scheduled in rows.schedule.tasks])
    margin = body_margin(LeverArms(scene, stacked(scene.cell, rows.q)), scene, rows.off)
    if margin == 0.0:
        return scene
    pairs = tuple(
        replace(pair, demand=pair.demand + margin) if pair.rule is Rule.CLEARANCE else pair for pair in scene.pairs
    )
    return replace(scene, pairs=pairs)
