"""Resolve a run: from timed tasks to the motion of all joints, by the integrator that the cell asks for."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Resolution, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.solver import Integrator
from cellplan.model.task import INSTANT_ROOM
from cellplan.planning.accurate_run import AccurateRun
from cellplan.planning.closing import closing_drift, first_cycle
from cellplan.planning.follow import carry, follow
from cellplan.planning.joint_path import JointPath
from cellplan.planning.timing import TimedTasks
from cellplan.planning.tracking_problem import TrackingProblem

CLOSER_LOOKS: Final = 3  # paths found again because the instants of the clock showed a larger error than the nodes


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
    path, q, worst = _path(run, cell, schedule, start=start, moving=moving)
    reached, last = len(q) - 1, len(schedule.times) - 1
    if reached < last:
        problem = TrackingProblem(cell, schedule, moving, start=start)
        stepped = carry(problem, q[-1], first=reached, last=last, progress=progress)
        q = np.concatenate([q, stepped.q[reached + 1 :]])
    resolution = Resolution(
        integrator=Integrator.ACCURATE,
        panels=len(path.panels),
        nodes=path.node_count,
        sweeps=run.collocation.sweeps,
        solves=run.collocation.solves,
        error_between=worst if path.panels else None,
        euler_from=float(schedule.times[reached]) if reached < last else None,
    )
    return Motion(times=schedule.times, q=q, resolution=resolution)


def _path(
    run: AccurateRun, cell: Cell, schedule: Schedule, *, start: Array, moving: Sequence[str]
) -> tuple[JointPath, Array, float]:
    """The path, the postures at the instants of the clock that it reaches, and the largest tool error anywhere.

    The error is looked at at the nodes, between them, and at every instant of the clock; where one of these shows more
    than the others did, the panels are cut there and the path is found again.
    """
    problem = TrackingProblem(cell, schedule, moving, start=start) if cell.motion.cyclic else None
    for closer in range(CLOSER_LOOKS + 1):
        path = run.path(start, begin=0.0, end=run.end) if problem is None else _closed(run, problem, schedule, start)
        reached = int(np.searchsorted(schedule.times, path.end + INSTANT_ROOM, side="right"))
        q = path.at(schedule.times[:reached])
        q[0] = start
        errors = run.errors(schedule, q)
        if errors.max() <= run.accuracy or not path.panels or closer == CLOSER_LOOKS:
            break
        run.look_closer(path, schedule.times[:reached], errors)
    return path, q, max(run.worst, float(errors.max()))


def _closed(run: AccurateRun, problem: TrackingProblem, schedule: Schedule, start: Array) -> JointPath:
    """A path that closes after the first cycle; later cycles repeat it."""
    begin, end = (float(schedule.times[k]) for k in first_cycle(problem.cell, schedule))

    def moved(drift: Array) -> Array:
        at = run.path(start, begin=0.0, end=begin, drift=drift).last if begin > 0.0 else start
        round_trip: Array = run.path(at, begin=begin, end=end, drift=drift).last - at
        return round_trip

    drift = closing_drift(problem, start, moved, duration=end)
    return run.path(start, begin=0.0, end=run.end, drift=drift)


def _steps(count: int) -> Resolution:
    """What Euler's steps took: a node and a system of equations each."""
    return Resolution(integrator=Integrator.EULER, panels=0, nodes=count + 1, sweeps=0, solves=count)
