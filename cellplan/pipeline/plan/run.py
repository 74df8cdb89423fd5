"""Plan one phase: from its tasks to the motion of all joints, nothing of it verified yet."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cellplan.model.cell import Cell
from cellplan.model.clocked_path import ClockedPath
from cellplan.model.motion import Motion, Schedule
from cellplan.model.phase import Phase
from cellplan.model.progress import Progress, silent
from cellplan.planning.modes import standing
from cellplan.planning.refine_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedRun:
    """The motion of one phase.

    Attributes:
        phase: Tasks, moving robots and idle robots.
        schedule: Where every tool must be.
        motion: What all joints do.
        scene: The scene in which it is judged where that is not the scene of the cell.
    """

    phase: Phase
    schedule: Schedule
    motion: Motion
    scene: Scene | None = None


def plan_run(cell: Cell, paths: Mapping[str, ClockedPath], phase: Phase, *, progress: Progress = silent) -> PlannedRun:
    """Follow the tasks of one phase; idle robots stand at their homes, or at their starts while these are unknown.

    Args:
        cell: The cell, every start posture filled in.
        paths: Path of every task on the common clock, by task name.
        phase: The phase.
        progress: Called with the stage and the fraction done.

    Raises:
        NoSolutionError: A tool lost its path.
    """
    schedule = schedule_paths(cell, [paths[name] for name in phase.tasks])
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    at = standing(cell, phase, start)
    motion = plan_within_accuracy(MotionTask(cell, schedule, phase.moving, at), progress=progress)
    return PlannedRun(phase=phase, schedule=schedule, motion=motion)
