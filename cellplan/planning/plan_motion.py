"""Plan a motion by the integrator of its cell, and refine it until no sample of the clock is beyond the accuracy."""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags
from cellplan.model.cell.name_order import NameOrder
from cellplan.model.motion.motion import Motion, NearestSingular, Resolution
from cellplan.model.progress import Progress, silent
from cellplan.model.solver import Integrator
from cellplan.model.task.clocked_path import distinct
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.planning.collocation.cyclic import closed_path
from cellplan.planning.collocation.joint_polynomials import CollocatedPath
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.euler.integrate import integrate, integrate_schedule
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.singularity import nearest_to_singular

MAX_PLANS: Final = 4  # each with more nodes than the one before


def plan_motion(task: MotionTask, *, progress: Progress = silent) -> Motion:
    """Motion of all joints that follows the tasks.

    Where collocation does not converge, Euler's steps with damping and feedback go on to the end; the checks then show
    the tool errors that result.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no step, or no cycle closes.
    """
    if not task.cell.solver.is_accurate:
        motion = integrate_schedule(task, progress=progress)
        return replace(motion, resolution=_steps(len(motion.times) - 1))
    run = AccurateRun(task, progress=progress)
    if not task.cell.motion.cyclic:
        path = run.path(task.start, begin=0.0, end=run.end)
        return _sampled(run, path, lambda: TrackingProblem(task), task.schedule.times, progress)
    problem = TrackingProblem(task)
    closed = closed_path(run, problem)
    if closed is None:
        motion = integrate_schedule(task, progress=progress)
        lost = nearest_to_singular(problem, 0, task.start)
        nothing = CollocatedPath(task.start, 0.0, (), ())
        return replace(motion, resolution=_resolution(run, nothing, euler_from=0.0, lost=lost))
    return _sampled(run, closed, lambda: problem, task.schedule.times, progress)


def _sampled(
    run: AccurateRun, path: CollocatedPath, problem: Callable[[], TrackingProblem], times: Array, progress: Progress
) -> Motion:
    """The path at the samples of the clock; from where it ends, Euler's steps."""
    last = len(times) - 1
    reached = int(np.searchsorted(times, path.end + TIME_TOLERANCE, side="right")) - 1
    q = path.at(times[: reached + 1])
    q[0] = path.start
    lost = None
    if reached < last:
        steps = problem()
        lost = nearest_to_singular(steps, reached, q[-1])
        stepped = integrate(steps, q[-1], first=reached, last=last, progress=progress)
        q = np.concatenate([q, stepped.q[reached + 1 :]])
    euler_from = float(times[reached]) if reached < last else None
    whole = path.joints if euler_from is None else None
    return Motion(times=times, q=q, path=whole, resolution=_resolution(run, path, euler_from=euler_from, lost=lost))


def _resolution(
    run: AccurateRun, path: CollocatedPath, *, euler_from: float | None, lost: NearestSingular | None
) -> Resolution:
    """What the run took in all, and the path that came of it."""
    return Resolution(
        integrator=Integrator.ACCURATE,
        panels=len(path.panels),
        nodes=path.node_count,
        sweeps=run.sweeps,
        solves=run.solves,
        error_between=path.worst if path.panels else None,
        euler_from=euler_from,
        lost=lost,
    )


def _steps(count: int) -> Resolution:
    """What Euler's steps took: a node and a system of equations each."""
    return Resolution(integrator=Integrator.EULER, panels=0, nodes=count + 1, sweeps=0, solves=count)


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


def _peaks(errors: Array, allowed: float) -> Flags:
    """Where errors, shape (N,), are above what is allowed and not below their neighbours, shape (N,)."""
    padded = np.concatenate([[-np.inf], errors, [-np.inf]])
    return (errors > allowed) & (errors >= padded[:-2]) & (errors > padded[2:])
