"""Follow the schedule: from instant to instant, so that every tool stays on its path on the moving part."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.errors import NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.planning.methods import METHODS
from cellplan.planning.tracking_problem import TrackingProblem

TOLD_EVERY: Final = 200  # [samples] between two words on progress


def follow(
    cell: Cell, schedule: Schedule, *, start: Array, moving: Sequence[str], progress: Progress = silent
) -> Motion:
    """Let the cell's resolution method carry the joints from each instant of the clock to the next.

    Args:
        cell: The cell.
        schedule: Wanted tool poses and twists on the common clock.
        start: Stacked start posture, shape (nq,), in [rad] or [m].
        moving: Names of the robots that may move.
        progress: Who wants to know how far it is.

    Raises:
        DivergedError: A tool lost its path.
        NoSolutionError: The method found no way on.
    """
    advance = METHODS[cell.solver.method](TrackingProblem(cell, schedule, moving))
    q = np.empty((len(schedule.times), cell.joint_count))
    q[0] = start
    for k in range(len(q) - 1):
        try:
            q[k + 1] = advance(k, q[k])
        except NoSolutionError as error:
            raise type(error)(f"{cell.origin.at('motion')}: at {schedule.times[k]:.3f} s {error}") from None
        if k % TOLD_EVERY == 0:
            progress("planning", k / len(q))
    return Motion(times=schedule.times, q=q)
