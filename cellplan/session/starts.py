"""Starts of a live cell: where robots begin is written beside what was changed, so that a solve begins there too."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.jobs.repair.neat import written_at
from cellplan.model.cell.cell import Cell
from cellplan.search.variables.written import written_start, written_task_start
from cellplan.session.blocks import Block

ROUNDED: Final = 1e-5  # [deg] or [mm] by which a start that is written may be off
ADDRESS: Final = re.compile(r"(robots|tasks)\.[^.\[]+\.start(_deg)?")  # of a start posture as a whole


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


def unstated(cell: Cell, values: Mapping[str, object]) -> dict[str, object]:
    """Those of some starts by address that a cell does not state already, up to rounding."""
    document = cell.origin.document
    return {address: value for address, value in values.items() if not _is_same(value, written_at(document, address))}


def _is_same(value: object, stated: object) -> bool:
    """Whether two start postures are the same."""
    if isinstance(value, Mapping) and isinstance(stated, Mapping):
        return value.keys() == stated.keys() and all(_is_same(it, stated[key]) for key, it in value.items())
    if isinstance(value, list | tuple) and isinstance(stated, list | tuple):
        return len(value) == len(stated) and all(map(_is_same, value, stated))
    if isinstance(value, int | float) and isinstance(stated, int | float):
        return abs(value - stated) <= ROUNDED
    return value == stated


def stated_start(cell: Cell, block: Block) -> Array:
    """Where a cell says that a block begins, and as in the block where it says nothing, shape (nq,)."""
    start, is_program = block.start.copy(), cell.program.is_home_to_home
    stated = {robot.name: robot.start for robot in cell.robots if not is_program}
    stated |= {task.robot: task.start_posture for task in cell.tasks if is_program and task.name in block.tasks}
    for name, configuration in stated.items():
        if configuration is not None and cell.robot(name).path is None and name not in block.stage.phase.idle:
            start[cell.columns(name)] = np.asarray(configuration)
    return start


def started(cell: Cell, start: Array) -> Cell:
    """The cell with starts that are to be found at stacked joint positions, shape (nq,); a program as it is."""
    working = {*cell.positioners, *(task.robot for task in cell.tasks)}
    if cell.program.is_home_to_home:
        return cell
    robots = (
        replace(robot, start=start[cell.columns(robot.name)])
        if robot.start is None and robot.name in working
        else robot
        for robot in cell.robots
    )
    return replace(cell, robots=tuple(robots))
