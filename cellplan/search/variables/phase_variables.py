"""The variables of a program as one of its phases has them: other starts, and the part where it lies."""

from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.frozen import derive
from cellplan.model.cell.cell import Cell, Part
from cellplan.search.distances.moving_bodies import LayoutVariables, NeighbourCells
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.kernel.varied import VARIED, KernelVariables, VariedFields


class ProgramVariables(KernelVariables, LayoutVariables, Protocol):
    """Variables of a whole program."""

    def layouts(self, x: Array, start: Array, at_work: Container[str] | None = None) -> Layouts:
        """See ``Variables``."""

    def directions(self, x: Array, at_work: Container[str] | None = None) -> Directions:
        """See ``Variables``."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PhaseVariables(VariedFields):
    """The variables of a program in one of its phases."""

    whole: ProgramVariables  # the variables of the program
    begins_there: bool  # whether it begins where variables of the start say
    lying: Part | None = None  # the part where it lies in the cell
    tasks: tuple[str, ...] = ()  # names of its tasks, whose spins count

    def __post_init__(self) -> None:
        """Note what the variables of the program know."""
        derive(self, **{name: getattr(self.whole, name) for name in VARIED})

    def layouts(self, x: Array, start: Array, at_work: Container[str] | None = None) -> Layouts:
        """See ``KernelVariables``."""
        layouts = self.whole.layouts(x, start, self.tasks if at_work is None else at_work)
        return layouts if self.begins_there else replace(layouts, start=start)

    def directions(self, x: Array, at_work: Container[str] | None = None) -> Directions:
        """See ``KernelVariables``."""
        directions = self.whole.directions(x, self.tasks if at_work is None else at_work)
        return directions if self.begins_there else replace(directions, start=np.zeros_like(directions.start))

    def placed(self, x: Array) -> Cell:
        """See ``LayoutVariables``."""
        cell = self.whole.placed(x)
        return cell if self.lying is None else replace(cell, part=self.lying)

    def base_twists(self, x: Array) -> Array:
        """See ``LayoutVariables``."""
        return self.whole.base_twists(x)

    def neighbours(self, x: Array, step: float) -> Iterable[NeighbourCells]:
        """See ``LayoutVariables``; a part that lies does not move."""
        return (it for it in self.whole.neighbours(x, step) if self.lying is None or it.robot is not None)


def in_place_of(variables: object, whole: ProgramVariables) -> ProgramVariables:
    """Other variables of a program in place of these, as the phase has them that these belong to."""
    return replace(variables, whole=whole) if isinstance(variables, PhaseVariables) else whole
