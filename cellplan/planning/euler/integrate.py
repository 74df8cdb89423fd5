"""Follow the schedule: from instant to instant, so that every tool stays on its path on the moving part."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import DivergedError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.planning.euler.cycle_closing import close
from cellplan.planning.methods import method_named
from cellplan.planning.tracking.problem import Advance, TrackingProblem
from cellplan.planning.tracking.singularity import singular_words

PROGRESS_EVERY: Final = 200  # [samples] between two words on progress
LARGEST_STEP: Final = np.pi  # [rad] or [m]: a joint that goes farther in one step is not integrated any more


def follow(
    cell: Cell, schedule: Schedule, *, start: Array, moving: Sequence[str], progress: Progress = silent
) -> Motion:
    """Let the cell's resolution method carry the joints from each instant of the clock to the next.

    A cyclic motion gets a drift in the null space of the tasks that brings all joints back.

    Args:
        cell: The cell.
        schedule: Reference tool poses and twists on the common clock.
        start: Stacked start posture, shape (nq,), in [rad] or [m].
        moving: Names of the robots that may move.
        progress: Who wants to know how far it is.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no way on, or no cycle closes.
    """
    problem = TrackingProblem(cell, schedule, moving, start=start)
    if cell.motion.cyclic:
        close(problem, schedule, start, lambda last: carry(problem, start, last=last, progress=progress).q)
    return carry(problem, start, last=len(schedule.times) - 1, progress=progress)


def carry(problem: TrackingProblem, start: Array, *, first: int = 0, last: int, progress: Progress = silent) -> Motion:
    """Motion from a start posture at the instant ``first`` to the instant ``last``; rows before it repeat the start.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no way on.
    """
    cell = problem.cell
    advance = method_named(cell.solver.method)(problem)
    q = np.tile(start, (last + 1, 1))
    iterations, slack = np.zeros(last), np.zeros(last)
    for k in range(first, last):
        try:
            step = advance(k, q[k])
            refuse_leap(cell, q[k], step)
        except NoSolutionError as error:
            singular = singular_words(problem, k, q[k])
            raise type(error)(f"{cell.origin.at('motion')}: at {problem.times[k]:.3f} s {error}{singular}") from None
        q[k + 1], iterations[k], slack[k] = step.q, step.iterations, step.slack
        if k % PROGRESS_EVERY == 0:
            progress("planning", k / len(q))
    return Motion(times=problem.times[: last + 1], q=q, iterations=iterations, slack=slack)


def refuse_leap(cell: Cell, q: Array, step: Advance) -> None:
    """Stop when a step is no number, or so long that the first order says nothing about it any more.

    Raises:
        DivergedError: A joint would turn by half a turn, or slide as many metres, in one step.
    """
    moves = np.abs(step.q - q)
    if not float(np.max(moves, initial=0.0)) < LARGEST_STEP:  # also for what is not a number
        robot, joint = cell.joint_at(int(np.argmax(np.where(np.isfinite(moves), moves, np.inf))))
        raise DivergedError(
            f"joint '{joint}' of '{robot}' would leap by half a turn or more in one step: shorten motion.step_s, lower "
            "the gain or allow damping (auto)"
        )
