"""Plan one phase: from its tasks to the motion of all joints, nothing of it verified yet."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.motion.motion import Motion, Schedule
from cellplan.model.motion.plan import Phase
from cellplan.model.progress import Progress, silent
from cellplan.model.task.clocked_path import ClockedPath
from cellplan.model.task.task import TIME_TOLERANCE
from cellplan.planning.modes import standing
from cellplan.planning.plan_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.scene import Scene


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedRun:
    """The motion of one phase."""

    phase: Phase  # tasks, moving robots and idle robots
    schedule: Schedule  # where every tool must be
    motion: Motion  # what all joints do
    scene: Scene | None = None  # the scene in which it is judged where that is not the scene of the cell


def on_grid(motion: Motion, times: Array) -> Motion:
    """The rows of a motion on a coarser grid, whose times are among its own; it stays known between them."""
    rows = np.searchsorted(motion.times, times - TIME_TOLERANCE)
    path = JointPath.through(motion.times, motion.q) if motion.path is None else motion.path
    return replace(motion, times=times, q=motion.q[rows], sigma=times, iterations=None, slack=None, path=path)


def plan_run(cell: Cell, paths: Mapping[str, ClockedPath], phase: Phase, *, progress: Progress = silent) -> PlannedRun:
    """Follow the tasks of one phase; idle robots stand at their homes, or at their starts while these are unknown.

    Args:
        cell: The cell, every start posture filled in.

    Raises:
        NoSolutionError: A tool lost its path.
    """
    paths_of_run = [paths[name] for name in phase.tasks]
    schedule = schedule_paths(cell, paths_of_run)
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    at = standing(cell, phase, start)
    finer = cell.motion.finer
    if finer is None or cell.solver.is_accurate:
        motion = plan_within_accuracy(MotionTask(cell, schedule, phase.moving, at), progress=progress)
        return PlannedRun(phase=phase, schedule=schedule, motion=motion)
    clock = replace(cell.motion, step=finer, duration=float(schedule.times[-1]))
    solved = replace(cell, motion=clock)
    task = MotionTask(solved, schedule_paths(solved, paths_of_run), phase.moving, at)
    motion = on_grid(plan_within_accuracy(task, progress=progress), schedule.times)
    return PlannedRun(phase=phase, schedule=schedule, motion=motion)
