"""Verify joint tables against their cell, without planning anything."""

from collections.abc import Mapping

from cellplan.cache import nothing_kept
from cellplan.checks.verify import verify as verify_tables
from cellplan.errors import InputError
from cellplan.io.run.joint_tables import parse_table
from cellplan.model.cell import Cell
from cellplan.model.progress import Progress, silent
from cellplan.model.report import Report
from cellplan.planning.modes import plan_phases
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.scene.scene import Scene


def verify(cell: Cell, tables: Mapping[str, str], *, task: str | None = None, progress: Progress = silent) -> Report:
    """Recompute tool errors, joint limits and clearance from the text of joint tables.

    Args:
        cell: The cell the tables were made for.
        tables: Text of one joint table per robot, by robot name.
        task: Name of the only task that was worked on; needed when the cell's mode has one run per task.
        progress: Called with the stage and the fraction done.

    Raises:
        InputError: A table is missing, unreadable, or does not fit the cell; there is no such task.
    """
    plans = plan_phases(cell, only=task).program
    if len(plans) > 1:
        names = ", ".join(str(plan.task) for plan in plans)
        raise InputError(f"task: this cell has one run per task: name one of {names}")
    plan = plans[0]
    toolpaths = [build_toolpath(cell.task(name), cell.part, cell.origin) for name in plan.tasks]
    parsed = [parse_table(text, f"tables/{name}.csv") for name, text in tables.items()]
    schedule = schedule_tasks(cell, toolpaths)
    with nothing_kept():  # a proof rests on the cell itself
        return verify_tables(Scene.from_cell(cell), schedule, parsed, moving=plan.moving, progress=progress)
