"""How near the motion comes to a singularity: singular values along it, from the screws of all joints."""

from collections.abc import Mapping, Sequence

import numpy as np

from cellplan.geometry.transforms import Array, skew
from cellplan.kinematics.screws import ScrewChain
from cellplan.model.cell import Cell
from cellplan.model.motion import Schedule, TaskSchedule
from cellplan.model.report import Conditioning

SAMPLES_AT_ONCE = 2000  # keeps the stacked matrices of 16 robots below 100 MB


def conditioning(
    cell: Cell,
    schedule: Schedule,
    chains: Mapping[str, ScrewChain],
    *,
    q: Mapping[str, Array],
    X_WP: Array,
    moving: Sequence[str],
) -> Conditioning:
    r"""Singular values of the whole stack and of every moving robot's own Jacobian, along the motion.

    The manipulability of the stack J is ``w = sqrt(det(J J^T))`` ([Ribeiro2010]_ Eq. D.45), here the product of its
    singular values: it also holds where ``det`` would lose its digits. A stack with more rows than columns has 0.

    An operator's Jacobian has the rows its task constrains; a positioner's gives the twist of the part frame. Joints
    that stand still are left out. Metres and radians stand side by side as they come.

    Args:
        cell: The cell.
        schedule: The tasks that were worked on.
        chains: Kinematics of each robot.
        q: Positions of each robot, shape (N, n).
        X_WP: The part, shape (N, 4, 4) or (1, 4, 4).
        moving: Names of the robots that may move.
    """
    count = len(schedule.times)
    at_each: Array = np.broadcast_to(X_WP, (count, 4, 4))
    stack: list[Array] = []
    robots: dict[str, list[Array]] = {}
    for first in range(0, count, SAMPLES_AT_ONCE):
        piece = slice(first, first + SAMPLES_AT_ONCE)
        positions = {name: values[piece] for name, values in q.items()}
        blocks = _blocks(cell, schedule, chains, positions, piece=piece, X_WP=at_each[piece])
        stack.append(_singular_values(_stacked(cell, schedule, blocks, moving)))
        for task in (scheduled.task for scheduled in schedule.tasks):
            robots.setdefault(task.robot, []).append(_smallest(blocks[task.name][0]))
        for name in cell.positioners[:1]:
            if name in moving:
                J_WP = _at_point(chains[name].flange_screws(positions[name]), at_each[piece])
                robots.setdefault(name, []).append(_smallest(J_WP))
    spectrum = np.concatenate(stack)
    smallest, largest = spectrum[:, -1], spectrum[:, 0]
    return Conditioning(
        stack=smallest,
        condition=smallest / np.where(largest > 0.0, largest, 1.0),
        manipulability=spectrum.prod(axis=1),
        robots={name: np.concatenate(values) for name, values in robots.items()},
    )


def _blocks(
    cell: Cell,
    schedule: Schedule,
    chains: Mapping[str, ScrewChain],
    q: Mapping[str, Array],
    *,
    piece: slice,
    X_WP: Array,
) -> dict[str, tuple[Array, Array | None]]:
    """Constrained rows of each task: the operator's columns and the positioner's, by task name."""
    holder = cell.positioners[0] if cell.positioners else None
    blocks = {}
    for scheduled in schedule.tasks:
        X_WT = chains[scheduled.task.robot].tool_poses(q[scheduled.task.robot])
        at_tip = X_WP.copy()
        at_tip[:, :3, 3] = X_WT[:, :3, 3]
        pick = _pick(scheduled, piece)
        own = pick @ _at_point(chains[scheduled.task.robot].flange_screws(q[scheduled.task.robot]), at_tip)
        others = None if holder is None else -pick @ _at_point(chains[holder].flange_screws(q[holder]), at_tip)
        blocks[scheduled.task.name] = (own, others)
    return blocks


def _pick(scheduled: TaskSchedule, piece: slice) -> Array:
    """Rows that a task constrains, from a twist in P, shape (N, m, 6)."""
    task, R_PT = scheduled.task, scheduled.X_PT[piece, :3, :3]
    axes = [axis for axis in task.axes if axis < 3 or not task.is_spin_free]
    rows = np.zeros((len(R_PT), len(axes) + 2 * task.is_spin_free, 6))
    rows[:, range(len(axes)), axes] = 1.0
    if task.is_spin_free:
        rows[:, -2, 3:], rows[:, -1, 3:] = R_PT[:, :, 0], R_PT[:, :, 1]
    return rows


def _at_point(screws_W: Array, X_W: Array) -> Array:
    """Twists at the origin of a moving frame, in its axes, from screws at the world origin, shape (N, 6, n)."""
    R_T = np.swapaxes(X_W[:, :3, :3], 1, 2)
    linear = screws_W[:, :3] - skew(X_W[:, :3, 3]) @ screws_W[:, 3:]
    return np.concatenate([R_T @ linear, R_T @ screws_W[:, 3:]], axis=1)


def _stacked(
    cell: Cell, schedule: Schedule, blocks: Mapping[str, tuple[Array, Array | None]], moving: Sequence[str]
) -> Array:
    """Arrow matrix of all tasks over the joints that may move, shape (N, rows, columns)."""
    holder_moves = bool(cell.positioners) and cell.positioners[0] in moving
    rows = []
    for scheduled in schedule.tasks:
        own, holder = blocks[scheduled.task.name]
        row: list[Array] = [holder] if holder_moves and holder is not None else []
        for other in schedule.tasks:
            width = blocks[other.task.name][0].shape[2]
            row.append(own if other is scheduled else np.zeros((*own.shape[:2], width)))
        rows.append(np.concatenate(row, axis=2))
    return np.concatenate(rows, axis=1)


def _singular_values(J: Array) -> Array:
    """Singular values of each matrix, largest first, shape (N, rows); zeros when there are fewer columns than rows."""
    if J.shape[2] < J.shape[1]:
        return np.zeros(J.shape[:2])
    values = np.linalg.svd(J, compute_uv=False)
    return values.astype(np.float64, copy=False)


def _smallest(J: Array) -> Array:
    """Smallest singular value of each matrix, shape (N,)."""
    return _singular_values(J)[:, -1]
