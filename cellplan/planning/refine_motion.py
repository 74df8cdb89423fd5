"""Refine a motion until the tool errors at all samples of the clock are within the accuracy."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.motion.motion import Motion
from cellplan.model.progress import Progress, silent
from cellplan.model.task.clocked_path import distinct
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.tracking.motion_task import MotionTask

MAX_PLANS: Final = 4  # each with more nodes than the one before


def plan_within_accuracy(task: MotionTask, *, progress: Progress = silent) -> Motion:
    """Plan a motion as `plan_motion` does, and check the tool errors at every sample of the clock.

    The error bound of `plan_motion` follows from points between the nodes. Where a sample of the clock shows more than
    the allowed error, its time becomes an end of panels, and the motion is planned again. The error bound of the result
    holds for these samples as well.

    Robots and tasks are taken in the order of their names, so that the order in which a file lists them changes
    nothing, not even where a search goes from joint to joint.

    The arguments and errors are those of `plan_motion`.
    """
    order = NameOrder.of(task.cell)
    tasks = tuple(sorted(task.schedule.tasks, key=lambda path: path.task.name))
    paths = tuple(sorted(task.schedule.paths, key=lambda path: path.task.name))
    schedule = replace(task.schedule, tasks=tasks, paths=paths)
    start = order.sorted(task.start)
    for _ in range(MAX_PLANS):
        task = MotionTask(order.cell, schedule, task.moving, start)
        motion, rough = _with_errors(plan_motion(task, progress=progress), task)
        if not len(rough):
            break
        schedule = replace(schedule, extra_breaks=distinct(np.concatenate([schedule.extra_breaks, rough])))
    path = motion.path and replace(
        motion.path,
        start=order.as_listed(motion.path.start),
        nodes=[order.as_listed(nodes.T).T for nodes in motion.path.nodes],
    )
    return replace(motion, q=order.as_listed(motion.q), path=path)


def _with_errors(motion: Motion, task: MotionTask) -> tuple[Motion, Array]:
    """The motion with the largest error at its samples, and times in [s] at which that is too large."""
    made = motion.resolution
    if made is None or made.error_between is None:
        return motion, np.zeros(0)
    schedule = task.schedule
    last = len(motion.q) if made.euler_from is None else int(np.searchsorted(schedule.times, made.euler_from))
    errors = AccurateRun(replace(task, start=motion.q[0])).errors(schedule, motion.q[:last])
    worst = max(made.error_between, float(errors.max(initial=0.0)))
    checked = replace(motion, resolution=replace(made, error_between=worst))
    return checked, schedule.times[:last][_peaks(errors, task.cell.solver.accuracy_mm.si)]


def _peaks(errors: Array, allowed: float) -> NDArray[np.bool_]:
    """Where errors, shape (N,), are above what is allowed and not below their neighbours, shape (N,)."""
    padded = np.concatenate([[-np.inf], errors, [-np.inf]])
    return (errors > allowed) & (errors >= padded[:-2]) & (errors > padded[2:])
