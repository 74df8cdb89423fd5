"""cellplan in its accurate mode; start posture and toolpaths given."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from job import Array, Job

from cellplan import load_cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask


def prepare(job: Job, *, accuracy_m: float) -> Callable[[], Array]:
    """Read the cell and set the clock; a run builds the planner's model, resolves the motion and samples it.

    The targets of the nodes, which are not those of the samples, are computed within the run.
    """
    cell = load_cell(Path(job.cell))
    solver = cell.solver.changed(integrator="accurate", accuracy_mm=1e3 * accuracy_m)
    cell = replace(cell, solver=solver)
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    moving = [robot.name for robot in cell.robots]

    def run() -> Array:
        return plan_motion(MotionTask(cell, schedule, moving, job.start)).q

    return run
