"""Variables of a layout search: numbers of a cell file that may change, for the kernel and for the file."""

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.model.cell import Cell
from cellplan.model.layout import LayoutSettings, VariableKind
from cellplan.search.distances.moving_bodies import NeighbourCells
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.variables.directions import base_twists, effective_base_twists, tip_twists
from cellplan.search.variables.neighbours import neighbour_cells
from cellplan.search.variables.pedestals import leaving_columns, with_pedestals
from cellplan.search.variables.state import State, concerned, pose_of
from cellplan.search.variables.ties import Tied
from cellplan.search.variables.written import written_number, written_starts, written_weight


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Variables:
    """The continuous variables of a layout search, n of them, with what they do to a cell.

    Lengths are in [m], angles in [rad]; a variable of a joint weight is the weight's natural logarithm.
    """

    base: Cell  # the cell that is searched: obstacles below varied bases are pedestals of these robots here
    names: tuple[str, ...]  # addresses in the file, of tied numbers that of the first, n of them
    lower: Array  # lowest values, shape (n,)
    upper: Array  # highest values, shape (n,)
    given: Array  # values in the file, brought into the bounds, shape (n,)
    scale: Array  # A usual step of each, shape (n,)
    cost: Array  # cost of a change by one unit of each, shape (n,)
    margin: Array  # distance from its limits that each joint is to keep, in [rad] or [m], shape (nq,)
    remarks: tuple[str, ...]  # what was converted, kept or brought into its bounds, for people
    settings: LayoutSettings  # what may change, as the cell file says it
    tied: Tied  # how the numbers of the file follow from the variables
    given_cell: Cell  # the cell as it was given
    given_state: State  # its layout
    conversion: Mapping[str, object]  # values that turn the given cell into ``base``

    @classmethod
    def of(cls, cell: Cell, *, without: Container[str] = ()) -> "Variables":
        """The variables that a cell file gives.

        Args:
            without: Addresses of numbers that stay as they are, whatever the file says.

        Raises:
            InputError: The cell was not read from a file, or was changed in Python since.
        """
        settings = None if cell.layout is None else cell.layout.without(without)
        if settings is None:
            raise InputError(f"cell '{cell.name}': expected a cell that was read from a file, got one built in Python")
        conversion, remarks = with_pedestals(cell, settings)
        base = cell.with_values(conversion)
        spare = 0.0 if settings.misplacement is None else settings.misplacement.position_mm.si
        settings = replace(settings, ranges=leaving_columns(base, settings.ranges, spare=spare))
        tied = Tied.of(settings)
        joints = [joint for robot in base.robots for joint in robot.model.joints]
        return cls(
            base=base,
            **_varied(tied),
            margin=np.array([settings.margin if it.is_revolute else settings.margin_sliding for it in joints]),
            remarks=(*remarks, *tied.remarks),
            settings=settings,
            tied=tied,
            given_cell=cell,
            given_state=State.given(base),
            conversion=conversion,
        )

    def among(self, addresses: Container[str]) -> Self:
        """The same with only some of the numbers of the file, by their addresses."""
        settings = self.settings.among(addresses)
        tied, conversion = Tied.of(settings), with_pedestals(self.given_cell, settings)[0]
        return replace(self, **_varied(tied), settings=settings, tied=tied, conversion=conversion)

    def state(self, x: Array) -> State:
        """The layout at values of the variables, shape (n,)."""
        return self.given_state.changed(self.base, self.tied.ranges, self.tied.factors @ x + self.tied.terms)

    def placed(self, x: Array) -> Cell:
        """The cell at values of the variables, shape (n,), neither rounded nor validated: quick, for scenes.

        Bases, tools with their solids, grasps, the part at rest, spins and weights are those of the layout, and so are
        start postures as far as they are among the variables.
        """
        return self.state(x).cell(self.base, self.tied.ranges)

    def layouts(self, x: Array, start: Array) -> Layouts:
        """Candidates for the kernel, with a job of ``base``.

        The kernel knows no grasp, spin or part at rest: there the tool tip of a robot or the bases of all robots are
        elsewhere, which gives the same motion. Scenes take ``placed``.

        Args:
            x: Values of the variables, shape (K, n).
            start: Start postures in [rad] or [m], shape (K, nq); those among the variables are taken from x.
        """
        base, states = self.base, [self.state(row) for row in x]
        chosen = np.array([state.starts for state in states])
        X_WB = np.tile(np.array([robot.X_WB for robot in base.robots]), (len(x), 1, 1, 1))
        X_FT = np.tile(np.array([robot.tool.X_FT for robot in base.robots]), (len(x), 1, 1, 1))
        ranges = self.tied.ranges
        for robot in concerned(base, ranges, VariableKind.BASE, VariableKind.PART):
            X_WB[:, robot] = [state.base_shift(base) @ pose_of(state.bases[robot]) for state in states]
        for robot in concerned(base, ranges, VariableKind.TOOL, VariableKind.GRASP, VariableKind.SPIN):
            X_FT[:, robot] = [state.tip(base, robot) @ state.tip_shift(base, robot) for state in states]
        return Layouts(
            X_WB=X_WB,
            X_FT=X_FT,
            start=np.where(np.isnan(chosen), start, chosen),
            weights=np.array([state.weights for state in states]),
        )

    def directions(self, x: Array) -> Directions:
        """What each variable does to a candidate for the kernel, at values of shape (n,)."""
        state, cell, ranges, factors = self.state(x), self.base, self.tied.ranges, self.tied.factors
        start, weights = np.zeros((cell.joint_count, len(ranges))), np.zeros((cell.joint_count, len(ranges)))
        for column, variable in enumerate(ranges):
            if variable.kind in {VariableKind.START, VariableKind.WEIGHT}:
                joint = cell.columns(variable.name).start + variable.index
                is_start = variable.kind is VariableKind.START
                (start if is_start else weights)[joint, column] = 1.0 if is_start else state.weights[joint]
        return Directions(
            base=effective_base_twists(state, cell, ranges) @ factors,
            tool=tip_twists(state, cell, ranges) @ factors,
            start=start @ factors,
            weights=weights @ factors,
        )

    def base_twists(self, x: Array) -> Array:
        """What each variable does to each base: velocity of its origin in W, angular velocity, shape (robots, 6, n)."""
        return base_twists(self.state(x), self.base, self.tied.ranges) @ self.tied.factors

    def neighbours(self, x: Array, step: float) -> Iterator[NeighbourCells]:
        """Cells with the numbers of each tool and of the part a step to either side; see ``NeighbourCells``.

        Args:
            x: Values of the variables, shape (n,).
            step: In [m] or [rad].
        """
        return neighbour_cells(self.state(x), self.base, self.tied, step)

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the given cell file: values by address, rounded.

        Args:
            x: Values of the variables, shape (n,).
            start: Start postures in [rad] or [m], shape (nq,); those among the variables are taken from x.
        """
        values = dict[str, object](self.conversion)
        numbers = self.tied.factors @ x + self.tied.terms
        state = self.state(x)
        for variable, number in zip(self.tied.ranges, numbers.tolist(), strict=True):
            if variable.kind is VariableKind.WEIGHT:
                values[f"robots.{variable.name}.weights"] = [
                    written_weight(weight) for weight in state.weights[self.base.columns(variable.name)].tolist()
                ]
            elif variable.kind is not VariableKind.START:
                values[variable.address] = written_number(variable, number)
        return values | written_starts(self.base, self.settings, np.where(np.isnan(state.starts), start, state.starts))

    def cell(self, x: Array, start: Array) -> Cell:
        """The cell of the file with these values, as ``solve`` will have it; see ``values``."""
        return self.given_cell.with_values(self.values(x, start))

    def read_from(self, cell: Cell) -> Array:
        """Values of the variables in another cell with the same robots, brought into the bounds, shape (n,)."""
        numbers = State.given(cell).numbers(cell, self.tied.ranges)
        return self.tied.values(numbers)


def _varied(tied: Tied) -> dict[str, Any]:
    """What variables have from their ties."""
    return {name: getattr(tied, name) for name in ("names", "lower", "upper", "given", "scale", "cost")}
