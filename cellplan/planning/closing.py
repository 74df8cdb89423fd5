"""Closing a cycle: the constant drift in the null space of the tasks that brings every joint back to its start."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule
from cellplan.planning.tracking_problem import TrackingProblem

CLOSED: Final = 1e-9  # [rad] or [m] of drift in the null space per cycle that counts as none
ROUNDS: Final = 40  # cycles tried; four robots need about ten
SAME_POSE: Final = 1e-9  # largest difference of pose entries at both ends of a closed path: rounding
SINGULAR: Final = 1e-9  # singular values below this share of the largest one are zero: rounding of the matrix


def closing_drift(
    problem: TrackingProblem, schedule: Schedule, start: Array, cycle: Callable[[Array, int], Array]
) -> Array:
    r"""Joint speeds that, added in the null space at all times, close the joint motion over one cycle.

    The drift of one cycle lies in the null space ``N`` of the tasks at the start, as the tools come back. Its ``r``
    coordinates are functions of as many constants ``u``: Broyden's method solves
    ``N^T (q(T; N u) - q(0)) = 0`` beginning with ``T I`` for the derivative.

    Args:
        problem: The tasks.
        schedule: Their schedule.
        start: Stacked start posture, shape (nq,).
        cycle: Motion up to an instant under a drift, shape (k + 1, nq).

    Returns:
        Speeds in [rad/s] or [m/s], shape (nq,).

    Raises:
        InputError: A path is open, or its cycle does not end on an instant of the clock.
        NoSolutionError: The cycle does not close.
    """
    last = _end_of_cycle(problem.cell, schedule)
    N = _null_space(problem, start)
    u = np.zeros(N.shape[1])
    if not len(u):
        return N @ u
    B = np.eye(len(u)) / float(schedule.times[last])  # inverse of the derivative
    drift = N.T @ (cycle(N @ u, last)[-1] - start)
    for _ in range(ROUNDS):
        if np.max(np.abs(drift)) <= CLOSED:
            return N @ u
        change = -B @ drift
        found = N.T @ (cycle(N @ (u + change), last)[-1] - start)
        gained = found - drift
        B += np.outer(change - B @ gained, change @ B) / (change @ B @ gained)
        u, drift = u + change, found
    raise NoSolutionError(
        f"{problem.cell.origin.at('motion.cyclic')}: the joint motion does not close, a joint is still "
        f"{np.degrees(np.max(np.abs(drift))):.3g} deg away after {ROUNDS} tries; another start posture may help"
    )


def _end_of_cycle(cell: Cell, schedule: Schedule) -> int:
    """Index of the instant at which all tools are back for the first time.

    Raises:
        InputError: There is no such instant.
    """
    place = cell.origin.at("motion.cyclic")
    cycles = {(task.task.start, task.end, task.task.repeat) for task in schedule.tasks}
    last = len(schedule.times) - 1
    if len(cycles) == 1:
        begin, end, repeat = cycles.pop()
        last = int(np.searchsorted(schedule.times, begin + (end - begin) / repeat - 0.5 * schedule.step))
    for task in schedule.tasks:
        gap = float(np.max(np.abs(task.X_PT[last] - task.X_PT[0])))
        if gap > SAME_POSE:
            raise InputError(
                f"{place}: expected closed paths whose cycles end on a multiple of motion.step_s, but the tool of task "
                f"'{task.task.name}' is not back at its start at {schedule.times[last]:g} s"
            )
    return last


def _null_space(problem: TrackingProblem, start: Array) -> Array:
    """Orthonormal joint directions that move no task at the start, shape (nq, r)."""
    J = problem.first_order(0, start).J
    free = np.flatnonzero(np.any(problem.signs != 0.0, axis=0) & (problem.mobile(0) > 0.0))
    _, s, Vt = np.linalg.svd(J[:, free])
    rank = int(np.sum(s > SINGULAR * s.max(initial=0.0)))
    N = np.zeros((len(start), len(free) - rank))
    N[free] = Vt[rank:].T
    return N
