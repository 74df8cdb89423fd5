"""Cells in which one number of a tool or of the part is a step to either side, for derivatives by differences."""

from collections.abc import Iterator
from dataclasses import replace

from cellplan.model.cell import Cell
from cellplan.model.layout import VariableKind
from cellplan.search.distances.moving_bodies import NeighbourCells
from cellplan.search.variables.state import State
from cellplan.search.variables.ties import Tied


def neighbour_cells(state: State, cell: Cell, tied: Tied, step: float) -> Iterator[NeighbourCells]:
    """All that numbers do to the solids of tools and to the place of the part.

    Args:
        state: The layout.
        cell: The cell that is searched.
        tied: The numbers.
        step: In [m] or [rad].
    """
    for variable, by in zip(tied.ranges, tied.factors, strict=True):
        if variable.kind not in {VariableKind.TOOL, VariableKind.GRASP, VariableKind.PART}:
            continue
        values = state.numbers(cell, [variable])
        sides = [state.changed(cell, [variable], values + change) for change in (step, -step)]
        if variable.kind is VariableKind.TOOL:
            forward, back = (_with_tool(side, cell, cell.index(variable.name)) for side in sides)
            yield NeighbourCells(robot=variable.name, by=by, sides=(forward, back))
        if variable.kind is not VariableKind.TOOL or cell.index(variable.name) == cell.carrier:
            forward, back = (side.cell(cell, tied.ranges) for side in sides)
            yield NeighbourCells(robot=None, by=by, sides=(forward, back))


def _with_tool(state: State, cell: Cell, index: int) -> Cell:
    """The cell with the tool of one robot."""
    robots = list(cell.robots)
    robots[index] = replace(robots[index], tool=state.tool(cell, index))
    return replace(cell, robots=tuple(robots))
