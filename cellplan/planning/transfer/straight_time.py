r"""Time of a straight move in joint space: all joints share one law, so the fastest one is known in closed form.

The share s of the way goes from rest to rest with bounds V, A, J of its speed, acceleration and jerk. Its speed is the
convolution of three boxes of widths :math:`T_1 \ge T_2 + T_3`, :math:`T_2 \ge T_3`, so

.. math:: \max \dot s = 1 / T_1, \quad \max \ddot s = 1 / (T_1 T_2), \quad \max \dddot s = 1 / (T_1 T_2 T_3)

and it takes :math:`T_1 + T_2 + T_3`; the least of these sums is the jerk-limited optimum from rest to rest.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.motion.joint_path import JointPath
from cellplan.planning.timing.retime import JointLimitsInTime, Retimer

NEAR: Final = 1.02  # [-] factor of time up to which the law is slowed as a whole; above, its top speed is lowered
TRIES: Final = 60  # [-] until every limit holds in the rows
LINE_ROWS: Final = 33  # rows of a straight move that is certified before it is retimed


def straight_line(start: Array, goal: Array) -> Array:
    """A straight move as it is certified before it is retimed, shape (LINE_ROWS, nq); both ends are exact.

    Args:
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise.
    """
    line: Array = start + np.linspace(0.0, 1.0, LINE_ROWS)[:, None] * (goal - start)
    line[-1] = goal
    return line


def straight_rows(start: Array, goal: Array, retimer: Retimer) -> Array:
    """Rows of the fastest straight move, shape (N, nq).

    Where limits count that no closed form has, such as those of ``checks.tool_speed_mm_s``, the top speed is lowered;
    where torques do, the law is that of any other path.

    Args:
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise, not the same.
    """
    widths: list[float] = straight_widths(start, goal, retimer.bounds, step=retimer.step).tolist()
    count = int(np.ceil(sum(widths) / retimer.step))
    q = np.array([start, goal])
    for _ in range(TRIES):
        share = shares(np.arange(count + 1) / count, widths)
        q = start + share[:, None] * (goal - start)
        q[-1] = goal
        factor = retimer.slower(share, q)
        if factor <= 1.0:
            break
        if _exceeds_torques(q, retimer):
            return _rows_by_torques(start, goal, retimer)
        if factor > NEAR:
            widths = [widths[0] * factor, *widths[1:]]
            factor = sum(widths) / (count * retimer.step)
        count = max(count + 1, int(np.ceil(count * factor)))
    return q


def _exceeds_torques(q: Array, retimer: Retimer) -> bool:
    """Whether a torque exceeds its limit in rows of shape (N, nq), and slower ones would help."""
    times = np.linspace(0.0, (len(q) - 1) * retimer.step, len(q))
    return any(it.in_rows(times, q)[1].max() > 1.0 for it in retimer.bounds.torques)


def _rows_by_torques(start: Array, goal: Array, retimer: Retimer) -> Array:
    """Rows of a straight move by the fastest speed that torques allow at its places."""
    line = JointPath.through(np.array([0.0, 1.0]), np.stack([start, goal]))
    at = retimer.fastest(line).sigma
    q: Array = start + (at * at * (3.0 - 2.0 * at))[:, None] * (goal - start)
    q[-1] = goal
    return q


def straight_steps(start: Array, goal: Array, bounds: JointLimitsInTime, step: float) -> Indices:
    """Whole steps of the fastest straight moves from rest to rest, shape (...); zero where nothing moves.

    Args:
        start: Joint positions in [rad] or [m], shape (..., n).
        goal: Likewise.
        bounds: Limits of the joints, shape (n,) each.
        step: Time between two rows in [s].
    """
    first, second, third = np.moveaxis(straight_widths(start, goal, bounds, step=step), -1, 0)
    moves = np.any(goal != start, axis=-1)
    return np.where(moves, np.ceil((first + second + third) / step), 0.0).astype(np.intp)


def straight_widths(start: Array, goal: Array, bounds: JointLimitsInTime, *, step: float) -> Array:
    """Widths of the three boxes of straight moves in [s], shape (..., 3), by the limits of points in the world too.

    Args:
        start: Joint positions in [rad] or [m], shape (..., n).
        goal: Likewise.
        bounds: Limits of the joints, shape (n,) each.
        step: Time between two rows in [s]: the smallest width.
    """
    highest = np.full(np.broadcast_shapes(start.shape, goal.shape)[:-1], np.inf)
    for points in bounds.points:
        highest = np.minimum(highest, points.straight_rate(start, goal, step))
    return box_widths(goal - start, bounds, least=step, highest=highest)


def box_widths(move: Array, bounds: JointLimitsInTime, *, least: float, highest: Array | float = np.inf) -> Array:
    """Widths of the three boxes in [s], none below ``least``, the widest first, shape (..., 3).

    Args:
        move: Changes of the joints in [rad] or [m], shape (..., n).
        bounds: Limits of the joints, shape (n,) each.
        least: The smallest width in [s].
        highest: Largest rates of the share for other reasons in [1/s], shape (...).
    """
    length = np.abs(move)
    with np.errstate(divide="ignore", invalid="ignore"):  # joints that stand, and limits that do not exist
        v, a, j = (
            np.where(length > 0.0, limit / length, np.inf).min(axis=-1)
            for limit in (bounds.velocity, bounds.acceleration, bounds.jerk)
        )
        v = np.minimum(v, highest)
        third = np.maximum(least, np.where(np.isfinite(j), np.minimum(a / j, np.sqrt(v / j)), 0.0))
        second = np.maximum(third, np.where(np.isfinite(a), v / a, 0.0))
        first, product = 1.0 / v, 1.0 / a
    is_short = first < second + third  # the top speed is not reached
    half = np.maximum(third, 0.5 * (np.sqrt(third * third + 4.0 * product) - third))
    is_jerky = is_short & np.isfinite(j) & (half <= third)  # nor the full acceleration
    third = np.where(is_jerky, np.maximum(least, np.cbrt(0.5 / j)), third)
    second = np.where(is_jerky, third, np.where(is_short, half, second))
    return np.stack([np.where(is_short, second + third, first), second, third], axis=-1)


def shares(at: Array, widths: Sequence[float]) -> Array:
    """Share of the way at shares of the time, shape (N,): the integral of the convolution of the three boxes."""
    first, second, third = widths
    t = at * (first + second + third)
    total = np.zeros_like(t)
    for sign_1, shift_1 in ((1.0, 0.0), (-1.0, first)):
        for sign_2, shift_2 in ((1.0, 0.0), (-1.0, second)):
            for sign_3, shift_3 in ((1.0, 0.0), (-1.0, third)):
                late = np.maximum(t - shift_1 - shift_2 - shift_3, 0.0)
                total += sign_1 * sign_2 * sign_3 * late**3
    share = np.clip(total / (6.0 * first * second * third), 0.0, 1.0)
    share[0], share[-1] = 0.0, 1.0
    return np.maximum.accumulate(share)
