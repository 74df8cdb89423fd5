"""One layout: poses, rods, start postures and weights that a search may change, at given numbers."""

import math
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import inverse, pose, rotation_about
from cellplan.model.cell.cell import Cell, Robot, Tool
from cellplan.model.cell.layout import VariableKind, VaryRange
from cellplan.model.cell.rod import Rod
from cellplan.model.units import MM
from cellplan.search.variables.twists import Z

ROBOTS = (VariableKind.BASE, VariableKind.TOOL, VariableKind.WEIGHT, VariableKind.START)  # kinds of their own numbers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class State:
    """What the numbers of a layout make of a cell."""

    bases: Array  # position in [m] and roll, pitch, yaw in [rad] of each base, shape (robots, 6)
    grasps: Array  # likewise of each holder's tool tip in the part frame, shape (holders, 6)
    part: Array  # likewise of the part at rest in the world, shape (6,); zero for a part that is held
    rods: tuple[Rod | None, ...]  # rods of the tools by robot; None for a tool without one
    spins: Array  # spins in [rad] by task
    weights: Array  # weights of all joints, shape (nq,)
    starts: Array  # start posture as far as it is among the numbers, NaN elsewhere, shape (nq,)

    @classmethod
    def given(cls, cell: Cell) -> "State":
        """What the file of a cell says."""
        document: Any = cell.origin.document
        robots, part = document["robots"], document["part"]
        return cls(
            bases=np.array([_six(robots[robot.name]["base"]) for robot in cell.robots]),
            grasps=np.array([_six(grasp["at"]) for grasp in part["held_by"]]).reshape(-1, 6),
            part=_six(part["at"]) if "at" in part else np.zeros(6),
            rods=tuple(robot.tool.rod for robot in cell.robots),
            spins=np.array([task.spin for task in cell.tasks]),
            weights=np.concatenate([robot.weights for robot in cell.robots]),
            starts=np.full(cell.joint_count, np.nan),
        )

    def changed(self, cell: Cell, ranges: Sequence[VaryRange], numbers: Array) -> "State":
        """The layout with other numbers, of a weight its logarithm, shape (m,)."""
        bases, grasps, part, spins, weights, starts = (
            group.copy() for group in (self.bases, self.grasps, self.part, self.spins, self.weights, self.starts)
        )
        rods = list(self.rods)
        tasks = [task.name for task in cell.tasks]
        for variable, number in zip(ranges, numbers.tolist(), strict=True):
            match variable.kind:
                case VariableKind.BASE:
                    bases[cell.index(variable.name), variable.index] = number
                case VariableKind.GRASP:
                    grasps[cell.positioners.index(variable.name), variable.index] = number
                case VariableKind.PART:
                    part[variable.index] = number
                case VariableKind.TOOL:
                    at = cell.index(variable.name)
                    rods[at] = _with_number(rods[at], variable.index, number)
                case VariableKind.SPIN:
                    spins[tasks.index(variable.name)] = number
                case VariableKind.WEIGHT:
                    weights[cell.columns(variable.name)][variable.index] = math.exp(number)
                case VariableKind.START:
                    starts[cell.columns(variable.name)][variable.index] = number
        return State(
            bases=bases, grasps=grasps, part=part, rods=tuple(rods), spins=spins, weights=weights, starts=starts
        )

    def numbers(self, cell: Cell, ranges: Sequence[VaryRange]) -> Array:
        """The numbers of the layout, of a weight its logarithm; NaN for what the cell does not have, shape (m,)."""
        tasks, numbers = [task.name for task in cell.tasks], np.full(len(ranges), np.nan)
        for row, variable in enumerate(ranges):
            match variable.kind:
                case VariableKind.BASE:
                    numbers[row] = self.bases[cell.index(variable.name), variable.index]
                case VariableKind.GRASP if variable.name in cell.positioners:
                    numbers[row] = self.grasps[cell.positioners.index(variable.name), variable.index]
                case VariableKind.PART:
                    numbers[row] = self.part[variable.index]
                case VariableKind.TOOL:
                    rod = self.rods[cell.index(variable.name)]
                    numbers[row] = np.nan if rod is None else (rod.length, rod.tilt, rod.roll)[variable.index]
                case VariableKind.SPIN if variable.name in tasks:
                    numbers[row] = self.spins[tasks.index(variable.name)]
                case VariableKind.WEIGHT:
                    numbers[row] = math.log(self.weights[cell.columns(variable.name)][variable.index])
                case VariableKind.START:
                    start = cell.robot(variable.name).start
                    numbers[row] = np.nan if start is None else start[variable.index]
        return numbers

    def cell(self, cell: Cell, ranges: Sequence[VaryRange]) -> Cell:
        """The cell with this layout, neither rounded nor validated; starts as far as they are among the numbers."""
        robots = list(cell.robots)
        for index in concerned(cell, ranges, *ROBOTS):
            robots[index] = self._robot(cell, index)
        held = tuple(
            replace(grasp, X_PT=pose_of(six)) for grasp, six in zip(cell.part.held_by, self.grasps, strict=True)
        )
        X_WP = None if cell.part.X_WP is None else pose_of(self.part)
        tasks = tuple(
            replace(task, spin=float(spin)) if spin != task.spin else task
            for task, spin in zip(cell.tasks, self.spins, strict=True)
        )
        return replace(cell, robots=tuple(robots), part=replace(cell.part, held_by=held, X_WP=X_WP), tasks=tasks)

    def _robot(self, cell: Cell, index: int) -> Robot:
        """A robot with its base, rod, weights and start posture."""
        robot = cell.robots[index]
        columns = cell.columns(robot.name)
        start = self.starts[columns]
        return replace(
            robot,
            X_WB=pose_of(self.bases[index]),
            tool=self.tool(cell, index),
            weights=self.weights[columns],
            start=robot.start if np.any(np.isnan(start)) else start,
        )

    def tool(self, cell: Cell, index: int) -> Tool:
        """The tool of a robot with its rod."""
        tool, rod = cell.robots[index].tool, self.rods[index]
        return tool if rod is None or rod == tool.rod else _with_rod(tool, rod)

    def base_shift(self, cell: Cell) -> Array:
        """What a part at rest that stands elsewhere does to all bases, seen from the part, shape (4, 4)."""
        return np.eye(4) if cell.part.X_WP is None else cell.part.X_WP @ inverse(pose_of(self.part))

    def tip_shift(self, cell: Cell, index: int, at_work: Container[str] | None = None) -> Array:
        """What a changed spin and a changed grasp do to the tool tip of a robot, seen from the tip, shape (4, 4).

        Args:
            at_work: Names of the tasks whose spins count; None for all of them.
        """
        shift, name = np.eye(4), cell.robots[index].name
        for task, spin in zip(cell.tasks, self.spins.tolist(), strict=True):
            if task.robot == name and (at_work is None or task.name in at_work):
                shift[:3, :3] = rotation_about(Z, task.spin - spin)
        for grasp, six in zip(cell.part.held_by, self.grasps, strict=True):
            if grasp.robot == name:
                shift = shift @ inverse(pose_of(six)) @ grasp.X_PT
        return shift

    def tip(self, cell: Cell, index: int) -> Array:
        """The tool tip of a robot in its flange frame, shape (4, 4)."""
        rod = self.rods[index]
        return cell.robots[index].tool.X_FT if rod is None else rod.X_FT


def concerned(cell: Cell, ranges: Sequence[VaryRange], *kinds: VariableKind) -> list[int]:
    """Indices of the robots that numbers of some kinds belong to; a part at rest concerns them all."""
    chosen = [variable for variable in ranges if variable.kind in kinds]
    if any(variable.kind is VariableKind.PART for variable in chosen):
        return list(range(len(cell.robots)))
    doing = {task.name: task.robot for task in cell.tasks}
    names = {doing[variable.name] if variable.kind is VariableKind.SPIN else variable.name for variable in chosen}
    return [index for index, robot in enumerate(cell.robots) if robot.name in names]


def pose_of(six: Array) -> Array:
    """The pose of a position and roll, pitch, yaw."""
    return pose(six[:3], six[3:])


def _six(entry: dict[str, list[float]]) -> Array:
    """Position in [m] and angles in [rad] of a pose as a cell file writes it."""
    return np.concatenate([np.array(entry["xyz_mm"]) / MM, np.radians(entry["rpy_deg"])])


def _with_number(rod: Rod | None, index: int, number: float) -> Rod:
    """A rod with another length, tilt or roll."""
    if rod is None:
        raise ValueError("expected a tool with a rod")
    if index == 0:
        return replace(rod, length=number)
    return replace(rod, tilt=number) if index == 1 else replace(rod, roll=number)


def _with_rod(tool: Tool, rod: Rod) -> Tool:
    """A tool with another rod; its further solids stay."""
    bodies = rod.bodies()
    return replace(tool, X_FT=rod.X_FT, bodies=(*bodies, *tool.bodies[len(bodies) :]), rod=rod)
