"""Accelerations and jerk of joints, points and part in rows: difference quotients, rest before and after the rows."""

from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array, Flags, first_peak
from cellplan.geometry.shapes import bounding_box
from cellplan.measures.velocity_jumps import NO_TIMES, joint_jumps
from cellplan.model.cell.acceleration import PartAcceleration, PointAcceleration
from cellplan.model.cell.cell import Cell

STEP_TOL: Final = 1e-9  # [-] of a step: 4 ms are four steps of 1 ms, whatever the last digit says
STANDSTILL_TOL: Final = 1e-9  # [rad] or [m] in a step: a joint that moves less stands still


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RowAccelerations:
    """Accelerations at the rows."""

    values: Array  # size of the acceleration of each column, shape (N, n)
    is_jump: Flags  # where it is a jump of speed, shape (N, n)


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
    return changes_of_velocity(times, np.diff(points, axis=0) / _spread(np.diff(times), points))


def changes_of_velocity(times: Array, velocities: Array) -> Array:
    """Accelerations at the rows, shape (N, ...), from the velocities of the steps, shape (N - 1, ...), likewise."""
    steps = np.diff(times)
    padded = np.zeros((len(times) + 1, *velocities.shape[1:]))
    padded[1:-1] = velocities
    around = 0.5 * (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]]))
    return np.diff(padded, axis=0) / _spread(around, padded)


def _spread(times: Array, values: Array) -> Array:
    """Times of shape (N,) beside values of shape (M, ...)."""
    return times.reshape(-1, *[1] * (values.ndim - 1))


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


def part_acceleration(cell: Cell, times: Array, X_WP: Array, *, window: float) -> PartAcceleration:
    """The centre of the part's bounding box, and the corner of it that is accelerated most.

    Args:
        times: Times of the rows in [s], shape (N,).
        X_WP: The part in the world, shape (N, 4, 4), or (1, 4, 4) for a part at a fixed place.
        window: Time in [s] over which jerk is taken.
    """
    middle, half = bounding_box(cell.part.shape)
    points_S = middle + half * np.array([(0, 0, 0), *product((-1, 1), repeat=3)])
    points_P = points_S @ cell.part.X_PS[:3, :3].T + cell.part.X_PS[:3, 3]
    points = [point_peaks(times, (X_WP[:, :3, :3] @ p + X_WP[:, :3, 3])[:, None], window=window)[0] for p in points_P]
    centre, *corners = points
    most = max(corners, key=lambda corner: corner.peak)
    jerk = max(corners, key=lambda corner: corner.peak_jerk)
    most = replace(most, peak_jerk=jerk.peak_jerk, peak_jerk_at_s=jerk.peak_jerk_at_s)
    return PartAcceleration(centre=centre, corner=most)


def point_peaks(times: Array, points: Array, *, window: float) -> tuple[PointAcceleration, ...]:
    """Largest acceleration and jerk of points in the world, shape (N, n, 3); jerk over ``window`` in [s]."""
    accelerations = point_accelerations(times, points)
    sizes, jerk = np.linalg.norm(accelerations, axis=-1), jerks(times, accelerations, window=window)
    of_points = []
    for index in range(points.shape[1]):
        k, m = first_peak(sizes[:, index]), first_peak(jerk[:, index])
        of_points.append(
            PointAcceleration(
                peak=float(sizes[:, index].max()),
                peak_at_s=float(times[k]),
                peak_jerk=float(jerk[:, index].max()),
                peak_jerk_at_s=float(times[m]),
                window=window,
            )
        )
    return tuple(of_points)
