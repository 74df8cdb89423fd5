"""Configurations that were found, rounded to what is written of them."""

from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.files.cell.write import as_written
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot

DECIMALS: Final = 12  # of a degree or a metre, as in the tables: below the noise of the arithmetic


def rounded(robot: Robot, q: Array) -> Array:
    """A configuration with few decimals of a degree or millimetre, as the resolved cell file gives it back."""
    turns = [joint.is_revolute for joint in robot.model.joints]
    few = np.where(turns, np.deg2rad(np.round(np.rad2deg(q), DECIMALS)), np.round(q, DECIMALS))
    return as_written(robot.model, np.clip(few, robot.model.lower, robot.model.upper))


def with_rounded_starts(cell: Cell, given: Cell) -> Cell:
    """The cell with starts that differ from the given ones rounded to what is written of them."""
    robots = []
    for robot in cell.robots:
        is_same = robot.start is given.robot(robot.name).start
        robots.append(robot if is_same else replace(robot, start=rounded(robot, np.asarray(robot.start))))
    return replace(cell, robots=tuple(robots))


def with_start(cell: Cell, start: Array) -> Cell:
    """The cell with every start configuration filled in; what is not as given is rounded to what is written of it."""
    robots = []
    for robot in cell.robots:
        configuration = start[cell.columns(robot.name)]
        is_given = robot.start is not None and np.array_equal(robot.start, configuration)
        robots.append(robot if is_given else replace(robot, start=rounded(robot, configuration)))
    return replace(cell, robots=tuple(robots))
