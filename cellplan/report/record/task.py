"""What a report tells of each task besides its errors: how deep its tool stands in the part, and which way it runs."""

from collections.abc import Iterable

from cellplan.geometry.transforms import Array
from cellplan.model.cell import Cell
from cellplan.model.path_direction import run_direction
from cellplan.model.report import Report, ToolDepth
from cellplan.model.task import Task
from cellplan.report.record.between_rows import full_tasks_record
from cellplan.report.record.run import Record, number

AS_LISTED = "as listed"
ON_AXIS = 1e-9  # [-] a direction this near to an axis is called by it
AXIS = "axis"


def tasks_record(report: Report, cell: Cell) -> Record:
    """Tool errors at the rows and between them, depth and direction by task."""
    depths = {depth.task: depth for depth in report.depths}
    return {
        name: errors | _depth_record(depths.get(name)) | direction_record(cell.task(name))
        for name, errors in full_tasks_record(report, cell).items()
    }


def direction_record(task: Task) -> Record:
    """The way round of a closed path and the side that it is seen from; an open one runs as its points are listed."""
    direction, outside = run_direction(task)
    if direction is None or outside is None:
        return {"direction": AS_LISTED, "direction_seen_from": None}
    return {"direction": str(direction), "direction_seen_from": _named(outside)}


def direction_words(found: Record) -> str:
    """``clockwise seen from +z``, for people."""
    seen_from = found["direction_seen_from"]
    if seen_from is None:
        return str(found["direction"])
    return f"{found['direction']} seen from {seen_from if isinstance(seen_from, str) else _listed(seen_from)}"


def _depth_record(depth: ToolDepth | None) -> Record:
    """How deep the tool of a task stands in the part; nothing of a task in the world."""
    if depth is None:
        return {}
    return {
        "max_tool_depth_mm": number(1e3 * depth.depth),
        "max_tool_depth_at_s": number(depth.at_s),
        "deepest_body": depth.body if depth.body == AXIS else f"{depth.robot}/{depth.body}",
        "allowed_tool_depth_mm": number(1e3 * depth.limit),
    }


def _named(direction: Array) -> str | list[float | None]:
    """``+z`` for an axis, else the components."""
    for axis, letter in enumerate("xyz"):
        rest = [float(abs(value)) for k, value in enumerate(direction) if k != axis]
        if max(rest) <= ON_AXIS:
            return f"{'+' if direction[axis] > 0.0 else '-'}{letter}"
    return [number(float(value)) for value in direction]


def _listed(components: Iterable[float | None]) -> str:
    """Components of a direction with four decimals."""
    return f"[{', '.join(f'{round(value or 0.0, 4) + 0.0:g}' for value in components)}]"
