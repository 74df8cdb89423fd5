"""Velocity jumps of the desired motion, and the joint accelerations that they cause in the rows read back."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array, rotation_vector
from cellplan.model.motion.motion import Schedule

SIDE_S: Final = 1e-6  # [s] before and after a time: the velocities on its two sides
JUMP_TOL: Final = 1e-4  # [m/s] or [rad/s]: a smaller change of a tool's speed is no jump
ROW_TOL: Final = 1e-6  # [-] of a step: nearer times are those of the row
NO_TIMES: Final = np.zeros(0)


def desired_jumps(schedule: Schedule) -> Array:
    """Times in [s] at which the desired speed of a tool jumps, shape (J,).

    So it does where a constant law starts, passes a corner or ends, and where a trajectory starts or ends at speed.
    """
    jump_times = schedule.jumps
    around = np.concatenate([jump_times - SIDE_S, jump_times, jump_times + SIDE_S])
    is_jump = np.zeros(len(jump_times), dtype=bool)
    for X_PT in schedule.poses(np.clip(around, 0.0, float(schedule.times[-1]))):
        before, at, after = np.split(X_PT, 3)
        change = (after[:, :3, 3] - 2.0 * at[:, :3, 3] + before[:, :3, 3]) / SIDE_S
        turn = (_turns(at, after) - _turns(before, at)) / SIDE_S
        is_jump |= (np.linalg.norm(change, axis=1) > JUMP_TOL) | (np.linalg.norm(turn, axis=1) > JUMP_TOL)
    return jump_times[is_jump]


def joint_jumps(times: Array, q: Array, jump_times: Array) -> Array:
    """By how much the speed of each joint jumps at the rows nearest to given times, shape (N, n), else 0.

    The speeds are those of the steps, 0 before the first row and after the last one. A jump at a row is the change of
    speed there; one within a step is that from the step before to the step after it. The larger change at the rows
    beside it, once for each row that is passed, is what the joint does without a jump.

    Args:
        times: Times of the rows in [s], evenly spaced, shape (N,).
        q: Positions in [rad] or [m], shape (N, n).
        jump_times: Where the desired speed jumps, in [s], shape (J,).
    """
    step = float(times[-1]) / (len(times) - 1)
    jumps = np.zeros_like(q)
    rest = np.zeros_like(q[:2])
    changes = np.concatenate([rest, np.diff(np.concatenate([q[:1], q, q[-1:]]), n=2, axis=0) / step, rest])  # row + 2
    place = jump_times / step
    first = np.floor(place + ROW_TOL).astype(np.intp)
    is_between = np.abs(place - first) > ROW_TOL
    last = first + is_between
    total = np.abs(changes[first + 2] + is_between[:, None] * changes[last + 2])
    usual = np.maximum(np.abs(changes[first + 1]), np.abs(changes[last + 3]))
    row = np.minimum(np.rint(place).astype(np.intp), len(times) - 1)
    np.maximum.at(jumps, row, total - (1 + is_between)[:, None] * usual)
    return np.maximum(jumps, 0.0)


def _turns(X_from: Array, X_to: Array) -> Array:
    """Rotation vectors from poses to others in the frame that both are given in, shape (N, 3)."""
    return rotation_vector(X_to[:, :3, :3] @ np.swapaxes(X_from[:, :3, :3], 1, 2))
