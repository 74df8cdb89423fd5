"""cellplan with Euler's steps, as the papers have it; start posture and desired poses given."""

from collections.abc import Callable
from pathlib import Path

from job import Array, Job

from cellplan import load_cell
from cellplan.planning.euler.integrate import integrate_schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.planning.tracking.motion_task import MotionTask


def prepare(job: Job) -> Callable[[], Array]:
    """Read the cell and set the clock; a run builds the planner's model and goes from sample to sample."""
    cell = load_cell(Path(job.cell))
    schedule = schedule_tasks(cell, [build_toolpath(task, cell.part) for task in cell.tasks])
    moving = [robot.name for robot in cell.robots]

    def run() -> Array:
        return integrate_schedule(MotionTask(cell, schedule, moving, job.start)).q

    return run
