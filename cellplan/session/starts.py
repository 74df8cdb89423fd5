"""Starts of a live cell: where robots begin is written beside what was changed, so that a solve begins there too."""

from collections.abc import Mapping
from typing import Any

from cellplan.geometry.arrays import Array
from cellplan.jobs.repair.neat import written_at
from cellplan.model.cell.cell import Cell
from cellplan.search.variables.written import written_start, written_task_start
from cellplan.session.blocks import Block


def written_starts(cell: Cell, block: Block, start: Array) -> dict[str, object]:
    """Values by address that begin a block at stacked joint positions in [rad] or [m], shape (nq,).

    The start that is stated of the holder of the part stays; it is a variable of its own.
    """
    values = dict[str, Any]()
    if block.stage.move is not None:
        return values
    for task in block.cell.tasks:
        robot = cell.robot(task.robot)
        if robot.path is None and task.name in block.tasks:
            at = start[cell.columns(robot.name)]
            is_program = cell.program.is_home_to_home
            values |= written_task_start(cell, task, at) if is_program else written_start(cell, robot, at)
    for name in cell.positioners:
        robot = cell.robot(name)
        is_open = robot.start is None and robot.path is None and not cell.program.is_home_to_home
        if is_open or name in cell.positioners[1:]:
            values |= written_start(cell, robot, start[cell.columns(name)])
    return values


def as_given(cell: Cell, values: Mapping[str, object]) -> dict[str, object]:
    """What the file says at the same addresses."""
    return {address: written_at(cell.origin.document, address) for address in values}
