"""Variables of a layout as the parts of a search see them that know no cell files."""

from dataclasses import dataclass

from cellplan.geometry.arrays import Array
from cellplan.model.cell import Cell, Part, Tool
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.variables.variables import Variables


@dataclass(frozen=True, slots=True)
class SearchedVariables:
    """Variables as starts see them: candidates are what the kernel needs for the motion.

    Attributes:
        variables: The variables.
    """

    variables: Variables

    @property
    def cell(self) -> Cell:
        """The cell that is searched."""
        return self.variables.base

    @property
    def names(self) -> tuple[str, ...]:
        """Address of each variable."""
        return self.variables.names

    @property
    def lower(self) -> Array:
        """Lower bounds, shape (n,)."""
        return self.variables.lower

    @property
    def upper(self) -> Array:
        """Upper bounds, shape (n,)."""
        return self.variables.upper

    @property
    def scale(self) -> Array:
        """Usual steps, shape (n,)."""
        return self.variables.scale

    @property
    def given(self) -> Array:
        """Values of the given cell, shape (n,)."""
        return self.variables.given

    def layouts(self, x: Array, start: Array) -> Layouts:
        """Candidates at values of shape (K, n), with start postures of shape (K, nq)."""
        return self.variables.layouts(x, start)

    def directions(self, x: Array) -> Directions:
        """What each variable does to a candidate."""
        return self.variables.directions(x)

    def tools(self, x: Array) -> dict[str, Tool]:
        """Tools of the robots whose tools vary."""
        return self.variables.tools(x)

    def part(self, x: Array) -> Part:
        """The part with its grasps."""
        return self.variables.part(x)


class PlacedVariables(SearchedVariables):
    """Variables as bodies see them: bases and tools where they stand, not where the kernel needs them."""

    def layouts(self, x: Array, start: Array) -> Layouts:
        """Layouts at values of shape (K, n), with start postures of shape (K, nq)."""
        return Layouts.of([self.variables.placed(each) for each in x], start)

    def directions(self, x: Array) -> Directions:
        """What each variable does to bases, tools, start and weights."""
        found = self.variables.directions(x)
        base = self.variables.base_twists(x)
        return Directions(base=base, tool=found.tool, start=found.start, weights=found.weights)
