"""Closures: where the tools of further holders are desired on the part while it moves, beside the tools at work."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell, Grasp, Relation
from cellplan.planning.tracking.motion_task import MotionTask


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Target:
    """Where one tool is desired at each of N instants.

    Attributes:
        relation: The task, or the grasp of a further holder.
        X_PT: Reference tool tip in P, shape (N, 4, 4).
        V_PT_P: Reference twist of the tool relative to the part in P, linear first, shape (N, 6).
        tolerance: Allowed distance in [m].
        settled: Instant in [s] until which the tool may be on its way; -inf when it is there from the start.
    """

    relation: Relation
    X_PT: Array
    V_PT_P: Array
    tolerance: float
    settled: float = -np.inf


def targets(motion: MotionTask) -> tuple[Target, ...]:
    """The scheduled tasks, then the grasp of every further holder that moves ([Ribeiro2010]_ 4.5).

    A grasp is a task that never changes: its pose is where the holder took hold of the part, its twist is zero. Where
    the part stands still, so do all its holders; they ask for nothing then.
    """
    cell, schedule = motion.cell, motion.schedule
    asked = [
        Target(
            relation=each.task,
            X_PT=each.X_PT,
            V_PT_P=each.V_PT_P,
            tolerance=each.task.tolerance.position,
            settled=each.task.start + each.task.settle if each.task.settle else -np.inf,
        )
        for each in schedule.tasks
    ]
    count = len(schedule.times)
    for grasp in motion.grasps:
        X_PT: Array = np.broadcast_to(grasp.X_PT, (count, 4, 4))
        still, allowed = np.zeros((count, 6)), cell.checks.closure_position
        asked.append(Target(relation=grasp, X_PT=X_PT, V_PT_P=still, tolerance=allowed))
    return tuple(asked)


def closures(cell: Cell, moving: Sequence[str]) -> tuple[Grasp, ...]:
    """Grasps of the further holders that move."""
    return tuple(grasp for grasp in cell.closures if grasp.robot in moving)
