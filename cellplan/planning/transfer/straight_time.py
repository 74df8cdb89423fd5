r"""Time of a straight move in joint space: all joints share one law, so the fastest one is known in closed form.

The share s of the way goes from rest to rest with bounds V, A, J of its speed, acceleration and jerk. Its speed is the
convolution of three boxes of widths :math:`T_1 \ge T_2 + T_3`, :math:`T_2 \ge T_3`, so

.. math:: \max \dot s = 1 / T_1, \quad \max \ddot s = 1 / (T_1 T_2), \quad \max \dddot s = 1 / (T_1 T_2 T_3)

and it takes :math:`T_1 + T_2 + T_3`; the least of these sums is the jerk-limited optimum from rest to rest.
"""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
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

    Where limits count that are not of single joints, such as those of the tools' speeds, the top speed is lowered.

    Args:
        start: Stacked joint positions in [rad] or [m], shape (nq,).
        goal: Likewise, not the same.
    """
    widths = box_widths(goal - start, retimer.bounds, least=retimer.step)
    count = int(np.ceil(sum(widths) / retimer.step))
    q = np.array([start, goal])
    for _ in range(TRIES):
        share = shares(np.arange(count + 1) / count, widths)
        q = start + share[:, None] * (goal - start)
        q[-1] = goal
        factor = retimer.slower(share, q)
        if factor <= 1.0:
            break
        if factor > NEAR:
            widths = (widths[0] * factor, *widths[1:])
            factor = sum(widths) / (count * retimer.step)
        count = max(count + 1, int(np.ceil(count * factor)))
    return q


def box_widths(move: Array, bounds: JointLimitsInTime, *, least: float) -> tuple[float, float, float]:
    """Widths of the three boxes in [s], none below ``least``, the widest first."""
    length = np.abs(move)
    moved = length > 0.0
    limits = (bounds.velocity, bounds.acceleration, bounds.jerk)
    v, a, j = (float((limit[moved] / length[moved]).min()) for limit in limits)
    third = min(a / j, np.sqrt(v / j)) if np.isfinite(j) else 0.0
    third = max(least, third)
    second = max(third, v / a if np.isfinite(a) else 0.0)
    first = 1.0 / v
    if first < second + third:  # the top speed is not reached
        product = 1.0 / a if np.isfinite(a) else 0.0
        second = max(third, 0.5 * (np.sqrt(third * third + 4.0 * product) - third))
        if np.isfinite(j) and second <= third:  # nor the full acceleration
            second = third = max(least, float(np.cbrt(0.5 / j)))
        first = second + third
    return first, float(second), float(third)


def shares(at: Array, widths: tuple[float, float, float]) -> Array:
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
