"""Depth of tools in the part, and distances of tool tips from it, against what tasks allow."""

from collections.abc import Iterator, Sequence

import numpy as np

from cellplan.measures.standoff import UNSTATED
from cellplan.measures.tool_depth import AXIS, DEPTH_TOL
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, Standoff, ToolDepth
from cellplan.model.task.task import SampledPath, Task, TimedPath
from cellplan.model.units import MM


def check_depths(cell: Cell, depths: Sequence[ToolDepth]) -> list[Check]:
    """The depth of each task's tool against what the task, or else the cell, allows."""
    added = cell.part.accuracy if cell.checks.adds_accuracy else 0.0
    return [_depth_check(cell.task(depth.task), depth, added) for depth in depths]


def _depth_check(task: Task, tool_depth: ToolDepth, added: float) -> Check:
    """Whether a depth is allowed, where that of a tool that touches the part is raised by its accuracy in [m]."""
    raised = tool_depth.depth + (added if tool_depth.depth > 0.0 else 0.0)
    depth, limit = MM * raised, MM * tool_depth.limit
    passed = raised <= tool_depth.limit + DEPTH_TOL
    what = "its axis" if tool_depth.body == AXIS else f"{tool_depth.robot}/{tool_depth.body}"
    when = " on its path" if tool_depth.at_s is None else f" at {tool_depth.at_s:.3f} s"
    message = (
        f"tool depth of task '{task.name}': {depth:.3g} mm of the tool is inside the part or beyond it{when} ({what}), "
        f"allowed {limit:g} mm"
    )
    message += f" (with {MM * added:g} mm for the accuracy of the part)" if raised > tool_depth.depth else ""
    message = message if passed else f"{message}; {', or '.join(_cures(task, tool_depth))}"
    return Check("tool_depth", task.name, passed, message, value=depth, limit=limit, unit="mm", at_s=tool_depth.at_s)


def _cures(task: Task, depth: ToolDepth) -> Iterator[str]:
    """What may be wrong when a tool is too deep."""
    if task.project is not None and task.tool_axis is not None and task.tool_axis @ task.project > 0.0:
        yield "reverse tool_axis: it points out of the surface, so the tool passes through the part"
    elif task.project is None and isinstance(task.path, SampledPath | TimedPath):
        yield "check the points and axes of the file: points must lie on the surface, axes must point into it"
    elif task.project is None:
        yield "project the path onto the surface (path.project), or check its pose, the sign of offset_mm and tool_axis"
    elif depth.body == AXIS:
        yield "check the tool's pose and the side that the path is projected from"
    else:
        yield "use a slimmer tool or another tool_axis: the surface is concave or inclined there"
    yield "allow it with tool_depth_mm if the process removes material"


def check_standoffs(cell: Cell, standoffs: Sequence[Standoff]) -> list[Check]:
    """Distances against what each task states; those of tasks that state nothing count for a process only."""
    tasks = [(cell.task(standoff.task), standoff) for standoff in standoffs]
    return [
        _standoff_check(task, standoff)
        for task, standoff in tasks
        if task.standoff is not None or task.process is not None
    ]


def _standoff_check(task: Task, standoff: Standoff) -> Check:
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
