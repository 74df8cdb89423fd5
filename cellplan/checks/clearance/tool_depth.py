"""Depth of tools in the part against what tasks allow."""

from collections.abc import Iterator, Sequence

from cellplan.measures.tool_depth import AXIS, DEPTH_TOL
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, ToolDepth
from cellplan.model.task.task import SampledPath, Task, TimedPath
from cellplan.model.units import MM


def check_depths(cell: Cell, depths: Sequence[ToolDepth]) -> list[Check]:
    """The depth of each task's tool against what the task, or else the cell, allows."""
    return [_check(cell.task(depth.task), depth) for depth in depths]


def _check(task: Task, tool_depth: ToolDepth) -> Check:
    depth, limit = MM * tool_depth.depth, MM * tool_depth.limit
    passed = tool_depth.depth <= tool_depth.limit + DEPTH_TOL
    what = "its axis" if tool_depth.body == AXIS else f"{tool_depth.robot}/{tool_depth.body}"
    when = " on its path" if tool_depth.at_s is None else f" at {tool_depth.at_s:.3f} s"
    message = (
        f"tool depth of task '{task.name}': {depth:.3g} mm of the tool is inside the part or beyond it{when} ({what}), "
        f"allowed {limit:g} mm"
    )
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
