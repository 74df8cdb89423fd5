"""How bases and tool tips move with the numbers of a layout, m of them."""

from collections.abc import Sequence

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.transforms import cross, inverse
from cellplan.model.cell import Cell
from cellplan.model.layout import VariableKind, VaryRange
from cellplan.search.variables.state import State, concerned, pose_of
from cellplan.search.variables.twists import about_origin, at_point, carried, pose_twists, rod_twists


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


def tip_twists(state: State, cell: Cell, ranges: Sequence[VaryRange]) -> Array:
    """Motion of each tool tip as the kernel sees it: of its origin in the flange frame, shape (robots, 6, m)."""
    by_robot = np.zeros((len(cell.robots), 6, len(ranges)))
    kinds = (VariableKind.TOOL, VariableKind.SPIN, VariableKind.GRASP)
    for robot, columns in _by_robot(cell, ranges, *kinds).items():
        tip = (state.tip(cell, robot) @ state.tip_shift(cell, robot))[:3, 3]
        twists = np.array([_tip_twist(state, cell, robot, ranges[column]) for column in columns]).reshape(-1, 6)
        by_robot[robot][:, columns] = at_point(twists, tip).T
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
