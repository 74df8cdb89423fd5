"""Resolve a run: from timed tasks to the motion of all joints, by the integrator that the cell asks for."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, NearestSingular, Resolution, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.solver import Integrator
from cellplan.model.task import INSTANT_ROOM
from cellplan.planning.collocation.cyclic import closed_path
from cellplan.planning.collocation.joint_polynomials import JointPath
from cellplan.planning.collocation.run import AccurateRun
from cellplan.planning.euler.integrate import carry, follow
from cellplan.planning.timing.timed_path import TimedTasks
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.singularity import nearest_to_singular


def resolve(
    cell: Cell,
    timed: TimedTasks,
    schedule: Schedule,
    *,
    start: Array,
    moving: Sequence[str],
    progress: Progress = silent,
) -> Motion:
    """Motion of all joints that follows the tasks.

    Where the accurate mode finds no way on, Euler's steps with damping and feedback go on to the end: the checks tell
    what that costs.

    Args:
        cell: The cell; its solver names the integrator.
        timed: The tasks on the common clock.
        schedule: The same, sampled at the instants of the clock.
        start: Stacked start posture, shape (nq,), in [rad] or [m].
        moving: Names of the robots that may move.
        progress: Who wants to know how far it is.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: No way leads on, or no cycle closes.
    """
    if not cell.solver.is_accurate:
        motion = follow(cell, schedule, start=start, moving=moving, progress=progress)
        return replace(motion, resolution=_steps(len(motion.times) - 1))
    run = AccurateRun(cell, timed, start=start, moving=moving, progress=progress)
    if not cell.motion.cyclic:
        path = run.path(start, begin=0.0, end=run.end)
        return _sampled(run, path, lambda: TrackingProblem(cell, schedule, moving, start=start), timed.times, progress)
    problem = TrackingProblem(cell, schedule, moving, start=start)
    closed = closed_path(run, problem, schedule, start=start)
    if closed is None:
        motion = follow(cell, schedule, start=start, moving=moving, progress=progress)
        lost = nearest_to_singular(problem, 0, start)
        return replace(motion, resolution=_resolution(run, JointPath(start, 0.0, (), ()), euler_from=0.0, lost=lost))
    return _sampled(run, closed, lambda: problem, timed.times, progress)


def _sampled(
    run: AccurateRun, path: JointPath, problem: Callable[[], TrackingProblem], times: Array, progress: Progress
) -> Motion:
    """The path at the instants of the clock; from where it ends, Euler's steps."""
    last = len(times) - 1
    reached = int(np.searchsorted(times, path.end + INSTANT_ROOM, side="right")) - 1
    q = path.at(times[: reached + 1])
    q[0] = path.start
    lost = None
    if reached < last:
        steps = problem()
        lost = nearest_to_singular(steps, reached, q[-1])
        stepped = carry(steps, q[-1], first=reached, last=last, progress=progress)
        q = np.concatenate([q, stepped.q[reached + 1 :]])
    euler_from = float(times[reached]) if reached < last else None
    return Motion(times=times, q=q, resolution=_resolution(run, path, euler_from=euler_from, lost=lost))


def _resolution(
    run: AccurateRun, path: JointPath, *, euler_from: float | None, lost: NearestSingular | None
) -> Resolution:
    """What the run took in all, and the path that came of it."""
    return Resolution(
        integrator=Integrator.ACCURATE,
        panels=len(path.panels),
        nodes=path.node_count,
        sweeps=run.collocation.sweeps,
        solves=run.collocation.solves,
        error_between=path.worst if path.panels else None,
        euler_from=euler_from,
        lost=lost,
    )


def _steps(count: int) -> Resolution:
    """What Euler's steps took: a node and a system of equations each."""
    return Resolution(integrator=Integrator.EULER, panels=0, nodes=count + 1, sweeps=0, solves=count)
