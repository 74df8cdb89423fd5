"""Task constraints: which components of which tool motions the tasks constrain, in which frames, by which joints.

Both linearisations of the tasks take their rows, signs and frames from here: the dense one (`cooperation_jacobian`,
one configuration) and the batched one (`collocation.batch_tasks`, many configurations).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell.cell import Cell, Relation
from cellplan.model.task.task import Frame


class TiltRows(NamedTuple):
    """Rows of a tool axis that may lean."""

    rows: slice  # both of them among the rows of all tasks
    tilt: float  # half angle of its cone in [rad]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TaskConstraints:
    r"""The block rows of the cooperation Jacobian ([Ribeiro2010]_ Eq. 4.33), whatever the configuration.

    The relative twist of task i is that of its tool minus that of its reference frame, the part or the world:

    .. math:: V_i = s_i \, \$_{T_i} \dot q_i + c_i \, \$_P \dot q_p

    with the positioner's joints in ``q_p``. A tool that the positioner itself carries in the world has no ``q_i`` of
    its own. The linear components are those along the axes of the reference frame R, the angular ones likewise; with
    free spin they are taken along the axes of the desired tool frame, of which z is left open. Errors are desired minus
    actual.
    """

    tasks: tuple[Relation, ...]  # the tasks, then the grasps of further holders
    operators: Indices  # index of each one's robot in the cell, shape (tasks,)
    carrier: int | None  # index of the positioner that carries the part frame; None for a part at a fixed pose
    is_on_part: Flags  # whether R is the part frame P rather than the world frame W, shape (tasks,)
    is_spin_free: Flags  # whether the rotation about the tool's own axis is left open, shape (tasks,)
    constrained: Flags  # which of the six components are constrained, shape (tasks, 6)
    operator_signs: Array  # ``s_i``, 1 or 0, shape (tasks,)
    carrier_signs: Array  # ``c_i``, -1, 0 or 1, shape (tasks,)
    may_move: Array  # 1 for the joints of robots that may move, 0 for all others, shape (nq,)
    follows_path: Array  # 1 for those of them whose motion is given, 0 for all others, shape (nq,)

    @classmethod
    def of(cls, cell: Cell, tasks: Sequence[Relation], moving: Sequence[str]) -> "TaskConstraints":
        """The constraints of some tasks and grasps of a cell.

        Args:
            moving: Names of the robots that may move: the part at rest, an operator that stands still and the single
                pair are not special cases.
        """
        operators = np.array([cell.index(task.robot) for task in tasks], dtype=np.intp)
        is_carrier = np.isin(operators, [] if cell.carrier is None else [cell.carrier])
        may_move = np.concatenate([np.full(len(r.model.joints), float(r.name in moving)) for r in cell.robots])
        is_on_part = np.array([task.relative_to is Frame.PART for task in tasks], dtype=bool)
        return cls(
            tasks=tuple(tasks),
            operators=operators,
            carrier=cell.carrier,
            is_on_part=is_on_part,
            is_spin_free=np.array([task.is_spin_free for task in tasks], dtype=bool),
            constrained=np.array([constrained_components(task) for task in tasks], dtype=bool).reshape(-1, 6),
            operator_signs=np.where(is_carrier, 0.0, 1.0),
            carrier_signs=is_carrier.astype(float) - is_on_part,
            may_move=may_move,
            follows_path=may_move
            * np.concatenate([np.full(len(r.model.joints), float(r.path is not None)) for r in cell.robots]),
        )

    @property
    def is_whole(self) -> bool:
        """Whether every task constrains all six components, so that no rows need to be picked."""
        return bool(self.constrained.all())

    def column_signs(self, carries_flange: Flags) -> Array:
        """Sign of each joint in each task: +1 where it moves the tool, -1 where it moves the part, 0 elsewhere.

        Args:
            carries_flange: Whether a joint moves a robot's flange, shape (robots, nq).

        Returns:
            Signs, shape (tasks, nq).
        """
        carries = carries_flange.astype(float)
        signs = self.operator_signs[:, None] * carries[self.operators]
        if self.carrier is not None:
            signs += np.outer(self.carrier_signs, carries[self.carrier])
        return signs * self.may_move

    def reference_frames(self, X_WP: Array) -> Array:
        """Frame R of each task for a pose of the part, shape (tasks, 4, 4)."""
        return np.where(self.is_on_part[:, None, None], X_WP, np.eye(4))


def tilt_rows(tasks: Sequence[Relation]) -> tuple[TiltRows, ...]:
    """Rows about x and y of the desired tool frame, among those of all tasks, of each tool whose axis may lean."""
    rows, first = [], 0
    for task in tasks:
        count = int(constrained_components(task).sum())
        if task.tilt:
            rows.append(TiltRows(slice(first + count - 2, first + count), task.tilt))
        first += count
    return tuple(rows)


def constrained_components(task: Relation) -> Flags:
    """Which components a task constrains, shape (6,); with free spin the two rotations across the tool axis."""
    is_constrained = np.isin(np.arange(6), task.axes)
    if task.is_spin_free:
        is_constrained[3:] = [True, True, False]
    return is_constrained


def constraint_rows(task: Relation, X_RT: Array) -> Array:
    """Rows that pick what a task constrains from a relative twist in R, shape (N, m, 6).

    Args:
        X_RT: Desired tool poses, shape (N, 4, 4).
    """
    to_frames = np.zeros((len(X_RT), 6, 6))
    to_frames[:, :3, :3] = to_frames[:, 3:, 3:] = np.eye(3)
    if task.is_spin_free:
        to_frames[:, 3:, 3:] = np.swapaxes(X_RT[:, :3, :3], 1, 2)
    return np.ascontiguousarray(to_frames[:, constrained_components(task)])
