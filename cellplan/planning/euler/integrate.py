"""Euler's method: from sample to sample of the clock, with the pose error fed back."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.errors import DivergedError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, joint_at
from cellplan.model.motion.motion import Motion
from cellplan.model.progress import Progress, silent
from cellplan.planning.euler.cycle_closing import closed
from cellplan.planning.methods import method_named
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import StepResult, TrackingProblem
from cellplan.planning.tracking.singularity import singular_words

PROGRESS_EVERY: Final = 200  # [samples]
LARGEST_STEP: Final = np.pi  # [rad] or [m] of a joint in one step


def integrate_schedule(motion: MotionTask, *, progress: Progress = silent) -> Motion:
    """Integrate the joint velocities of the cell's resolution method from each sample of the clock to the next.

    A cyclic motion gets a drift in the null space of the tasks that brings all joints back.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no step, or no cycle closes.
    """
    problem, start = TrackingProblem(motion), motion.start
    if motion.cell.motion.cyclic:
        problem = closed(problem, lambda drifting, last: integrate(drifting, start, last=last, progress=progress).q)
    return integrate(problem, start, last=len(problem.times) - 1, progress=progress)


def integrate(
    problem: TrackingProblem, start: Array, *, first: int = 0, last: int, progress: Progress = silent
) -> Motion:
    """Motion from a configuration at the sample ``first`` to the sample ``last``; rows before it repeat the start.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no step.
    """
    cell = problem.cell
    key = next((f"robots.{robot.name}.path" for robot in cell.robots if robot.path is not None), "motion")
    advance = method_named(cell.solver.method)(problem)
    q = np.tile(start, (last + 1, 1))
    iterations, slack = np.zeros(last), np.zeros(last)
    for k in range(first, last):
        step = step_from(problem, advance, k, q[k], key=key)
        q[k + 1] = problem.given.placed(k + 1, step.q)
        iterations[k], slack[k] = step.iterations, step.slack
        if k % PROGRESS_EVERY == 0:
            progress("planning", k / len(q))
    return Motion(times=problem.times[: last + 1], q=q, iterations=iterations, slack=slack)


def step_from(
    problem: TrackingProblem, advance: Callable[[int, Array], StepResult], k: int, q: Array, *, key: str = "motion"
) -> StepResult:
    """The step from a configuration, shape (nq,), at sample k; errors say when, and name a key of the cell file."""
    try:
        step = advance(k, q)
        _refuse_long_step(problem.cell, q, step)
    except NoSolutionError as error:
        at = f"{problem.cell.origin.at(key)}: at {problem.times[k]:.3f} s"
        raise type(error)(f"{at} {error}{singular_words(problem, k, q)}") from None
    return step


def _refuse_long_step(cell: Cell, q: Array, step: StepResult) -> None:
    """Stop when a step is not finite, or a joint would turn by half a turn in it, where the first order ends."""
    moves = np.abs(step.q - q)
    if not float(np.max(moves, initial=0.0)) < LARGEST_STEP:  # also for what is not a number
        robot, joint = joint_at(cell, int(np.argmax(np.where(np.isfinite(moves), moves, np.inf))))
        raise DivergedError(
            f"joint '{joint}' of '{robot}' would move by half a turn or more in one step: shorten motion.step_s, lower "
            "the gain or allow damping (auto)"
        )
