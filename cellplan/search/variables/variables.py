"""Variables of a layout search: numbers of a cell file that may change, for the kernel and for the file."""

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross, inverse
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.layout import LayoutSettings, VariableKind, VaryRange
from cellplan.search.distances.moving_bodies import NeighbourCells
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.kernel.varied import VARIED
from cellplan.search.variables.pedestals import leaving_columns, with_pedestals
from cellplan.search.variables.state import State, concerned, pose_of
from cellplan.search.variables.ties import Tied
from cellplan.search.variables.twists import about_origin, at_point, carried, pose_twists, rod_twists
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
        """The variables that a cell file gives."""
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

    def layouts(self, x: Array, start: Array, at_work: Container[str] | None = None) -> Layouts:
        """Candidates for the kernel, with a job of ``base``.

        The kernel knows no grasp, spin or part at rest: there the tool tip of a robot or the bases of all robots are
        elsewhere, which gives the same motion. Scenes take ``placed``.

        Args:
            x: Values of the variables, shape (K, n).
            start: Start postures in [rad] or [m], shape (K, nq); those among the variables are taken from x.
            at_work: Names of the tasks of one phase of a program; None for all.
        """
        base, states = self.base, [self.state(row) for row in x]
        chosen = np.array([state.starts for state in states])
        X_WB = np.tile(np.array([robot.X_WB for robot in base.robots]), (len(x), 1, 1, 1))
        X_FT = np.tile(np.array([robot.tool.X_FT for robot in base.robots]), (len(x), 1, 1, 1))
        ranges = self.tied.ranges
        for robot in concerned(base, ranges, VariableKind.BASE, VariableKind.PART):
            X_WB[:, robot] = [state.base_shift(base) @ pose_of(state.bases[robot]) for state in states]
        for robot in concerned(base, ranges, VariableKind.TOOL, VariableKind.GRASP, VariableKind.SPIN):
            X_FT[:, robot] = [state.tip(base, robot) @ state.tip_shift(base, robot, at_work) for state in states]
        return Layouts(
            X_WB=X_WB,
            X_FT=X_FT,
            start=np.where(np.isnan(chosen), start, chosen),
            weights=np.array([state.weights for state in states]),
        )

    def directions(self, x: Array, at_work: Container[str] | None = None) -> Directions:
        """What each variable does to a candidate for the kernel, at values of shape (n,); see ``layouts``."""
        state, cell, ranges, factors = self.state(x), self.base, self.tied.ranges, self.tied.factors
        start, weights = np.zeros((cell.joint_count, len(ranges))), np.zeros((cell.joint_count, len(ranges)))
        for column, variable in enumerate(ranges):
            if variable.kind in {VariableKind.START, VariableKind.WEIGHT}:
                joint = cell.columns(variable.name).start + variable.index
                is_start = variable.kind is VariableKind.START
                (start if is_start else weights)[joint, column] = 1.0 if is_start else state.weights[joint]
        return Directions(
            base=effective_base_twists(state, cell, ranges) @ factors,
            tool=tip_twists(state, cell, ranges, at_work) @ factors,
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
        starts = self.state(x).starts
        return self.numbers(x) | written_starts(self.base, self.settings, np.where(np.isnan(starts), start, starts))

    def numbers(self, x: Array) -> dict[str, object]:
        """The same without the start postures."""
        values, state = dict[str, object](self.conversion), self.state(x)
        numbers = self.tied.factors @ x + self.tied.terms
        for variable, number in zip(self.tied.ranges, numbers.tolist(), strict=True):
            if variable.kind is VariableKind.WEIGHT:
                values[f"robots.{variable.name}.weights"] = [
                    written_weight(weight) for weight in state.weights[self.base.columns(variable.name)].tolist()
                ]
            elif variable.kind is not VariableKind.START:
                values[variable.address] = written_number(variable, number)
        return values

    def cell(self, x: Array, start: Array) -> Cell:
        """The cell of the file with these values, as ``solve`` will have it; see ``values``."""
        return self.given_cell.with_values(self.values(x, start))

    def read_from(self, cell: Cell) -> Array:
        """Values of the variables in another cell with the same robots, brought into the bounds, shape (n,)."""
        return self.tied.values(State.given(cell).numbers(cell, self.tied.ranges))


def _varied(tied: Tied) -> dict[str, Any]:
    """What variables have from their ties."""
    return {name: getattr(tied, name) for name in VARIED}


def base_twists(state: State, cell: Cell, ranges: Sequence[VaryRange]) -> Array:
    """Motion of each base: velocity of its origin in W and angular velocity, shape (robots, 6, m)."""
    by_robot = np.zeros((len(cell.robots), 6, len(ranges)))
    for robot, columns in _by_robot(cell, ranges, VariableKind.BASE).items():
        twists = pose_twists(state.bases[robot, 3:])
        for column in columns:
            by_robot[robot, :, column] = twists[ranges[column].index]
    return by_robot


def effective_base_twists(state: State, cell: Cell, ranges: Sequence[VaryRange]) -> Array:
    """Likewise of the bases as the kernel sees them, where a part at rest that moves moves all bases instead."""
    by_robot, shift = base_twists(state, cell, ranges), state.base_shift(cell)
    by_robot[:, :3], by_robot[:, 3:] = shift[:3, :3] @ by_robot[:, :3], shift[:3, :3] @ by_robot[:, 3:]
    for column, variable in enumerate(ranges):
        if variable.kind is VariableKind.PART:
            twist = -carried(part_twists(state)[variable.index], shift)
            for robot in range(len(cell.robots)):
                origin = (shift @ pose_of(state.bases[robot]))[:3, 3]
                by_robot[robot, :, column] = at_point(twist, origin)
    return by_robot


def part_twists(state: State) -> Array:
    """Motion of the part at rest by its six components, about the origin of W, shape (6, 6)."""
    return about_origin(pose_twists(state.part[3:]), state.part[:3])


def tip_twists(state: State, cell: Cell, ranges: Sequence[VaryRange], at_work: Container[str] | None = None) -> Array:
    """Motion of each tool tip as the kernel sees it: of its origin in the flange frame, shape (robots, 6, m)."""
    by_robot = np.zeros((len(cell.robots), 6, len(ranges)))
    kinds = (VariableKind.TOOL, VariableKind.SPIN, VariableKind.GRASP)
    for robot, columns in _by_robot(cell, ranges, *kinds).items():
        tip = (state.tip(cell, robot) @ state.tip_shift(cell, robot, at_work))[:3, 3]
        twists = np.array([_tip_twist(state, cell, robot, ranges[column]) for column in columns]).reshape(-1, 6)
        by_robot[robot][:, columns] = at_point(twists, tip).T
    is_out = [it.kind is VariableKind.SPIN and at_work is not None and it.name not in at_work for it in ranges]
    by_robot[:, :, is_out] = 0.0
    return by_robot


def _by_robot(cell: Cell, ranges: Sequence[VaryRange], *kinds: VariableKind) -> dict[int, list[int]]:
    """Places of the numbers of some kinds, by the robot that they belong to."""
    columns: dict[int, list[int]] = {robot: [] for robot in concerned(cell, ranges, *kinds)}
    for column, variable in enumerate(ranges):
        if variable.kind in kinds and len(robots := concerned(cell, [variable], *kinds)) == 1:
            columns[robots[0]].append(column)
    return columns


def _tip_twist(state: State, cell: Cell, robot: int, variable: VaryRange) -> Array:
    """Motion of a tool tip by one number, about the centre of the flange, shape (6,)."""
    X_FT, rod = state.tip(cell, robot), state.rods[robot]
    if variable.kind is VariableKind.TOOL and rod is not None:
        return rod_twists(rod)[variable.index]
    if variable.kind is VariableKind.SPIN:
        w = -X_FT[:3, 2]
        return np.concatenate([cross(X_FT[:3, 3], w), w])
    return grasp_twists(state, cell, robot)[variable.index]


def grasp_twists(state: State, cell: Cell, robot: int) -> Array:
    """Motion of the part by the six components of a grasp, about the centre of the holder's flange, shape (6, 6)."""
    six = state.grasps[cell.positioners.index(cell.robots[robot].name)]
    X_FP = state.tip(cell, robot) @ inverse(pose_of(six))
    return -carried(about_origin(pose_twists(six[3:]), six[:3]), X_FP)


def neighbour_cells(state: State, cell: Cell, tied: Tied, step: float) -> Iterator[NeighbourCells]:
    """All that numbers do to the solids of tools and to the place of the part.

    Args:
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
    robots = list(cell.robots)
    robots[index] = replace(robots[index], tool=state.tool(cell, index))
    return replace(cell, robots=tuple(robots))
