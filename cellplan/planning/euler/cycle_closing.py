"""Closing a cycle: the drift in the null space of the tasks that brings every joint back to its start."""

from collections.abc import Callable
from typing import Final

import numpy as np

from cellplan.errors import InputError, NoSolutionError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Grasp, Relation, joint_at
from cellplan.model.motion.motion import Schedule
from cellplan.planning.timing.schedule import SAME_PERIOD, common_cycles
from cellplan.planning.tracking.problem import TrackingProblem
from cellplan.planning.tracking.singularity import singular_words

CLOSED: Final = 1e-9  # [rad] or [m] of drift in the null space per cycle that counts as none
ROUNDS: Final = 40  # cycles tried; four robots need about ten
SAME_POSE: Final = 1e-9  # largest difference of pose entries at both ends of a closed path: rounding
SINGULAR: Final = 1e-9  # singular values below this share of the largest one are zero: rounding of the matrix


def closed(problem: TrackingProblem, integrate: Callable[[TrackingProblem, int], Array]) -> TrackingProblem:
    """The problem with a drift with which the joint motion closes, cycle after cycle.

    The first cycle gets a drift in one direction, at rest at both ends. What is left of the error would grow from cycle
    to cycle where the map of one cycle onto the next is not a contraction, so every later cycle is led back to the
    first one at the feedback gain.

    Args:
        integrate: Motion of a problem from its start to the sample k, shape (k + 1, nq).
    """
    schedule, start = problem.motion.schedule, problem.motion.start
    begin, end = first_cycle(problem.cell, schedule)
    middles = (np.arange(end - begin) + 0.5) / (end - begin)
    pace = drift_pace(middles) / drift_pace(middles).mean()  # of each step of the cycle, as Euler takes it

    def drifting(k: int, mean: Array) -> Array:
        return mean * pace[(k - begin) % (end - begin)] if k >= begin else np.zeros_like(mean)

    def cycle(mean: Array) -> Array:
        return integrate(problem.with_drift(lambda k, _q: drifting(k, mean)), end)

    def gap(mean: Array) -> Array:
        q = cycle(mean)
        return q[-1] - q[begin]

    mean = closing_drift(problem, start, gap, duration=float(schedule.times[end] - schedule.times[begin]))
    first = cycle(mean)

    def feedback_drift(k: int, q: Array) -> Array:
        if k < end:
            return drifting(k, mean)
        return drifting(k, mean) + problem.gain * (first[begin + (k - begin) % (end - begin)] - q)

    return problem.with_drift(feedback_drift)


def drift_pace(share: Array) -> Array:
    """Speed of a drift as a multiple of its mean, at shares 0..1 of the cycle: at rest at both ends, 1 on average."""
    return 30.0 * (share * (1.0 - share)) ** 2


def closing_drift(
    problem: TrackingProblem, start: Array, moved: Callable[[Array], Array], *, duration: float, sample: int = 0
) -> Array:
    r"""Joint speeds that, added in the null space at all times, close the joint motion over one cycle.

    The drift of one cycle lies in the null space ``N`` of the tasks at the start, as the tools come back. Its ``r``
    coordinates are functions of as many constants ``u``: Broyden's method solves
    ``N^T (q(T; N u) - q(0)) = 0`` beginning with ``T I`` for the derivative.

    Args:
        start: Stacked configuration at the beginning of the cycle, shape (nq,).
        moved: How far the joints are from where they began after one cycle, by the mean of the drift, shape (nq,).
        duration: Time ``T`` of the cycle in [s].
        sample: Number of the sample of the clock at which the cycle begins.

    Returns:
        Mean speeds in [rad/s] or [m/s], shape (nq,); ``moved`` was evaluated for them last.
    """
    N = _null_space(problem, sample, start)
    u = np.zeros(N.shape[1])
    B = np.eye(len(u)) / duration  # inverse of the derivative

    def gap(u: Array) -> Array:
        return N.T @ moved(N @ u)

    drift = gap(u)
    for _ in range(ROUNDS):
        if np.max(np.abs(drift), initial=0.0) <= CLOSED:
            return N @ u
        change = -B @ drift
        remaining = gap(u + change)
        gained = remaining - drift
        B += np.outer(change - B @ gained, change @ B) / (change @ B @ gained)
        u, drift = u + change, remaining
    left = np.abs(N @ drift)
    robot, joint = joint_at(problem.cell, int(np.argmax(left)))
    raise NoSolutionError(
        f"{problem.cell.origin.at('motion.cyclic')}: the joint motion does not close, joint '{joint}' of '{robot}' is "
        f"still {np.degrees(left.max(initial=0.0)):.3g} deg away after {ROUNDS} tries"
        f"{singular_words(problem, sample, start)}; another start may help, or no goal that keeps off obstacles"
    )


def first_cycle(cell: Cell, schedule: Schedule) -> tuple[int, int]:
    """Times at which the first cycle begins and ends, where the tools must be back; the whole motion without one."""
    first, last = 0, len(schedule.times) - 1
    bounds = common_cycles(schedule)
    if bounds is not None and np.ptp(np.diff(bounds)) <= SAME_PERIOD:
        first, last = np.searchsorted(schedule.times[:-1], bounds[:2] - 0.5 * schedule.step).tolist()
    for task in schedule.tasks:
        gap = float(np.max(np.abs(task.X_PT[last] - task.X_PT[first])))
        if gap > SAME_POSE:
            raise InputError(not_back(cell, task.task, float(schedule.times[last])))
    return first, last


def not_back(cell: Cell, task: Relation, end: float) -> str:
    """What to say of a tool that is not back at the end of a cycle, a time in [s]."""
    name = task.robot if isinstance(task, Grasp) else task.name
    return (
        f"{cell.origin.at('motion.cyclic')}: expected closed paths whose cycles end on a multiple of motion.step_s, "
        f"but the tool of task '{name}' is not back at its start at {end:g} s"
    )


def _null_space(problem: TrackingProblem, sample: int, start: Array) -> Array:
    """Orthonormal joint directions that move no task at the beginning, shape (nq, r)."""
    J = problem.first_order(sample, start).J
    free = np.flatnonzero(np.any(problem.signs != 0.0, axis=0) & (problem.mobile(sample) > 0.0))
    _, s, Vt = np.linalg.svd(J[:, free])
    rank = int(np.sum(s > SINGULAR * s.max(initial=0.0)))
    N = np.zeros((len(start), len(free) - rank))
    N[free] = Vt[rank:].T
    return N
