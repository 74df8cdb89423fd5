"""Accelerations and jerk of rows that were read back: difference quotients, with rest before and after the rows."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.checks.joints.speed_jumps import NO_TIMES, joint_jumps
from cellplan.geometry.transforms import Array

STEP_TOL: Final = 1e-9  # [-] of a step: 4 ms are four steps of 1 ms, whatever the last digit says
STANDSTILL_TOL: Final = 1e-9  # [rad] or [m] in a step: a joint that moves less stands still


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowAccelerations:
    """Accelerations at the rows."""

    values: Array  # size of the acceleration of each column, shape (N, n)
    is_jump: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]  # where it is a jump of speed, shape (N, n)


def point_accelerations(times: Array, points: Array) -> Array:
    """Accelerations at the rows, shape (N, ...), of anything that stands still before its first and after its last row.

    Speeds are those of the steps, ``v_k = (x_k+1 - x_k) / h_k``, and 0 before the first row and after the last one; the
    acceleration at a row is the change of speed there, divided by the mean of the two steps beside it:
    ``a_k = 2 (v_k - v_k-1) / (h_k + h_k-1)``. So a motion whose first step is as fast as the next ones has the
    acceleration ``v / h`` at its first row.

    Args:
        times: Times in [s], shape (N,), N >= 2.
        points: Positions, shape (N, ...): points in the world in [m], or joints in [rad] or [m].
    """
    steps = np.diff(times)
    spread = (-1, *[1] * (points.ndim - 1))
    velocities = np.zeros((len(times) + 1, *points.shape[1:]))
    velocities[1:-1] = np.diff(points, axis=0) / steps.reshape(spread)
    around = 0.5 * (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]]))
    return np.diff(velocities, axis=0) / around.reshape(spread)


def joint_accelerations(times: Array, q: Array, *, cycle: float, jumps_at: Array = NO_TIMES) -> RowAccelerations:
    """Sizes of the accelerations of joints at the rows; a jump of speed counts over the controller's cycle.

    Where a joint leaves rest, the change of speed at that row is followed by another one as large or larger when the
    joint accelerates uniformly or smoothly. By as much as the next change falls short, the speed has jumped:
    ``v_0 - (v_1 - v_0)``, between 0 and ``v_0``. No controller spreads a jump over a long step for it, so it is divided
    by its cycle, where that is shorter than the step. The same holds backwards in time where a joint comes to rest.
    Likewise for the jumps at times at which the desired speed of a tool is known to jump.

    Args:
        times: Times in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n).
        cycle: Cycle of the controller in [s].
        jumps_at: Where the desired speed of a tool jumps, in [s], shape (J,).
    """
    values = np.abs(point_accelerations(times, q))
    step = float(times[-1]) / (len(times) - 1)
    moves = np.diff(q, axis=0)
    jumps = np.maximum(_jumps(moves), _jumps(moves[::-1])[::-1])
    jumps = np.maximum(jumps, step * joint_jumps(times, q, jumps_at))
    by_jump = jumps / (step * min(step, cycle))
    is_jump = (jumps > 0.5 * step * step * values) & (jumps > STANDSTILL_TOL)
    return RowAccelerations(values=np.maximum(values, by_jump), is_jump=is_jump)


def _jumps(moves: Array) -> Array:
    """Jumps out of rest at each of the N rows, times the step, from the moves between rows, shape (N - 1, n)."""
    padded = np.concatenate([np.zeros_like(moves[:1]), moves, np.zeros_like(moves[:1]), np.zeros_like(moves[:1])])
    before, first, second = padded[:-2], padded[1:-1], padded[2:]
    excess = 2.0 * np.abs(first) - np.abs(second)
    jump = np.where(first * second < 0.0, np.abs(first), excess)
    sizes = np.clip(jump, 0.0, np.abs(first))
    return np.where(np.abs(before) <= STANDSTILL_TOL, sizes, 0.0)


def jerks(times: Array, accelerations: Array, *, window: float) -> Array:
    """Size of the jerk at the rows: the change of acceleration over a window, divided by the window.

    Between two rows the acceleration is taken to change linearly; before the first row and after the last it is zero.
    For each row the window that begins there and the one that ends there are compared, and the larger change counts;
    as the acceleration is piecewise linear, no window elsewhere has a larger one. A window that is shorter than the
    step gives the change over that step, divided by the step.

    Args:
        times: Times in [s], evenly spaced, shape (N,).
        accelerations: At the rows, with their signs, shape (N, n, d): n points or joints with d components each.
        window: In [s].

    Returns:
        Sizes, shape (N, n).
    """
    share = window * (len(times) - 1) / float(times[-1])
    whole = int(share + STEP_TOL)
    rest = max(share - whole, 0.0)
    begins = _changes(accelerations, whole, rest)
    ends = _changes(accelerations[::-1], whole, rest)[::-1]
    return np.maximum(np.linalg.norm(begins, axis=-1), np.linalg.norm(ends, axis=-1)) / window


def _changes(accelerations: Array, whole: int, rest: float) -> Array:
    """Change from each row to ``whole + rest`` steps later, shape (N, n, d)."""
    n = len(accelerations)
    padded = np.concatenate([accelerations, np.zeros((min(whole, n) + 1, *accelerations.shape[1:]))])
    later = np.zeros_like(accelerations)
    reached = padded[whole : whole + n + 1]
    count = min(n, max(len(reached) - 1, 0))
    later[:count] = (1.0 - rest) * reached[:count] + rest * reached[1 : count + 1]
    return later - accelerations
