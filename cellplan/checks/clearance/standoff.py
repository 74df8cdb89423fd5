"""Distances of tool tips from the part against what tasks state."""

from collections.abc import Sequence

import numpy as np

from cellplan.measures.standoff import UNSTATED
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, Standoff
from cellplan.model.task.task import Task
from cellplan.model.units import MM


def check_standoffs(cell: Cell, standoffs: Sequence[Standoff]) -> list[Check]:
    """Distances against what each task states; those of tasks that state nothing count for a process only."""
    tasks = [(cell.task(standoff.task), standoff) for standoff in standoffs]
    return [_check(task, standoff) for task, standoff in tasks if task.standoff is not None or task.process is not None]


def _check(task: Task, standoff: Standoff) -> Check:
    low, high = task.standoff or (0.0, UNSTATED)
    judged = standoff.worst_along if low > 0.0 else standoff.worst_nearest
    when = " on its path" if standoff.at_s is None else f" at {standoff.at_s:.3f} s"
    meets = not np.isinf(standoff.worst_along)
    axis = f"{MM * standoff.worst_along:.1f} mm along its axis" if meets else "which its axis does not meet"
    key = "no standoff_mm is stated" if task.standoff is None else f"standoff_mm = [{MM * low:g}, {MM * high:g}]"
    where = f"the tip is {MM * standoff.worst_nearest:.1f} mm from the part{when}, {axis}"
    message = f"standoff of task '{task.name}': {where}"
    cure = (
        f"allowed {MM * low:g} to {MM * high:g} mm and its tolerance ({key}): put the path on the part, state the "
        "distance of the process, or name where the tool may leave the part (off_part: [run_in, run_out, cut])"
    )
    if standoff.excused:
        names = ", ".join(f"{name} over {MM * length:.1f} mm" for name, length in standoff.excused.items())
        message += f"; excused: {names}"
    message = f"{message}; {cure}" if standoff.is_off else message
    value, limit, at_s = float(min(MM * judged, 1e6)), MM * (low if judged < low else high), standoff.at_s
    return Check("standoff", task.name, not standoff.is_off, message, value=value, limit=limit, unit="mm", at_s=at_s)
