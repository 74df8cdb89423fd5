"""Plan one run: from its tasks to the motion of all joints, nothing of it verified yet."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cellplan.model.cell import Cell
from cellplan.model.motion import Motion, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.toolpath import Toolpath
from cellplan.planning.modes import RunPlan, standing
from cellplan.planning.refine_motion import plan_within_accuracy
from cellplan.planning.timing.schedule import sample, time_tasks


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlannedRun:
    """One motion of the cell.

    Attributes:
        plan: What is worked on, who moves, who is idle.
        schedule: Where every tool must be.
        motion: What all joints do.
    """

    plan: RunPlan
    schedule: Schedule
    motion: Motion


def plan_run(
    cell: Cell, toolpaths: Mapping[str, Toolpath], plan: RunPlan, *, progress: Progress = silent
) -> PlannedRun:
    """Follow the tasks of one run; idle robots stand at their homes, or at their starts while these are unknown.

    Args:
        cell: The cell, every start posture filled in.
        toolpaths: Toolpath of every task, by task name.
        plan: The run.
        progress: Who wants to know how far it is.

    Raises:
        NoSolutionError: A tool lost its path.
    """
    timed = time_tasks(cell, [toolpaths[name] for name in plan.tasks])
    schedule = sample(timed)
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    at = standing(cell, plan, start)
    motion = plan_within_accuracy(cell, timed, schedule, start=at, moving=plan.moving, progress=progress)
    return PlannedRun(plan=plan, schedule=schedule, motion=motion)
