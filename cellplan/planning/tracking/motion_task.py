"""Motion task: what one call of the planner resolves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Grasp, Relation
from cellplan.model.motion.motion import Schedule


@dataclass(frozen=True, slots=True, eq=False)
class MotionTask:
    """The coupled motion of one phase: the tasks that are worked on together and the robots that move for them."""

    cell: Cell  # the cell; its solver names method and integrator
    schedule: Schedule  # the tasks on the clock
    moving: Sequence[str]  # names of the robots that carry the part or work on it; all others stand still
    start: Array  # stacked configuration at the first sample, shape (nq,), in [rad] or [m]

    @property
    def grasps(self) -> tuple[Grasp, ...]:
        """Grasps of the further holders that move: their tools keep their poses on the part."""
        return closures(self.cell, self.moving)

    @property
    def relations(self) -> tuple[Relation, ...]:
        """The tasks, then the grasps of the further holders that move ([Ribeiro2010]_ 4.5), one block row each."""
        return (*(task.task for task in self.schedule.tasks), *self.grasps)

    def references(self) -> tuple[Array, Array]:
        """Reference poses X_PT and twists V_PT_P of all relations at the samples.

        A grasp is a task that never changes: its pose is where the holder took hold of the part, its twist is zero.

        Returns:
            Poses, shape (N, relations, 4, 4), and twists, linear first, shape (N, relations, 6).
        """
        tasks, grasps, count = self.schedule.tasks, self.grasps, len(self.schedule.times)
        X_PT = [task.X_PT for task in tasks] + [np.broadcast_to(grasp.X_PT, (count, 4, 4)) for grasp in grasps]
        V_PT_P = [task.V_PT_P for task in tasks] + [np.zeros((count, 6))] * len(grasps)
        return np.stack(X_PT, axis=1), np.stack(V_PT_P, axis=1)


def closures(cell: Cell, moving: Sequence[str]) -> tuple[Grasp, ...]:
    """Grasps of the further holders that move; where the part stands still, so do all its holders."""
    return tuple(grasp for grasp in cell.closures if grasp.robot in moving)


def locked_since(cell: Cell) -> Array:
    """Time in [s] from which each joint stays where it is, inf for those that do not fail, shape (nq,)."""
    since = np.full(cell.joint_count, np.inf)
    for lock in cell.motion.locked:
        index = cell.columns(lock.robot).start + cell.robot(lock.robot).model.joint_names.index(lock.joint)
        since[index] = min(since[index], lock.from_s)
    return since
