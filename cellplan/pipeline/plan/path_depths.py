"""Depth of tools on their paths as they are desired, before there is a motion."""

from collections.abc import Mapping
from typing import Final

from cellplan.checks.clearance.tool_depth import check_depths, path_depth
from cellplan.model.cell import Cell
from cellplan.model.report import Check
from cellplan.model.toolpath import Toolpath

POSES: Final = 1001  # [-] poses of each path at which the depth of the tool's axis is computed


def depths_on_paths(cell: Cell, toolpaths: Mapping[str, Toolpath]) -> list[Check]:
    """Checks of those tools whose axis would stand too deep in the part on the desired path.

    Args:
        cell: The cell.
        toolpaths: The path of each task by its name.
    """
    found = [path_depth(cell, cell.task(name), toolpath.spread(POSES)) for name, toolpath in toolpaths.items()]
    checks = check_depths(cell, [depth for depth in found if depth is not None])
    return [check for check in checks if not check.passed]
