"""Depth of tools in the part and distance of their tips from it on the desired paths, before there is a motion."""

from collections.abc import Mapping
from typing import Final

from cellplan.checks.clearance.standoff import check_standoffs, standoff_on
from cellplan.checks.clearance.tool_depth import AXIS_COMPONENTS, check_depths, path_depth
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check
from cellplan.model.task.task import Frame
from cellplan.model.task.toolpath import Toolpath

POSES: Final = 1001  # [-] poses of each path at which the depth of the tool's axis is computed


def depths_on_paths(cell: Cell, toolpaths: Mapping[str, Toolpath]) -> list[Check]:
    """Checks of those tools that would stand too deep in the part, or off it, on the desired path."""
    depths = [path_depth(cell, cell.task(name), toolpath.spread(POSES)) for name, toolpath in toolpaths.items()]
    checks = check_depths(cell, [depth for depth in depths if depth is not None])
    tips = [
        standoff_on(cell, cell.task(name), path.spread(POSES))
        for name, path in toolpaths.items()
        if _on_part(cell, name)
    ]
    return [check for check in (*checks, *check_standoffs(cell, tips)) if not check.passed]


def _on_part(cell: Cell, name: str) -> bool:
    """Whether a task says where on the part the tip is, all along its path."""
    task = cell.task(name)
    return task.relative_to is Frame.PART and set(AXIS_COMPONENTS) <= set(task.axes)
