"""What of a scene depends on where its robots stand."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box, Cylinder, Solid
from cellplan.geometry.transforms import is_rigid
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.mounting import Bracket
from cellplan.model.robot.robot import BASE
from cellplan.scene.bodies import Kind, SceneBody

SAME_SIZE: Final = 1e-12  # [m] by which the height of a column may differ by rounding


def with_bases(cell: Cell, X_WB: Mapping[str, Array]) -> Cell:
    """The cell with some bases elsewhere; see ``Scene.moved``."""
    names = [robot.name for robot in cell.robots]
    for name, X in X_WB.items():
        if name not in names:
            raise ValueError(f"moved: expected names of robots ({', '.join(names)}), got '{name}'")
        if np.shape(X) != (4, 4):
            raise _not_rigid(name, X)
    if X_WB and not is_rigid(np.array(list(X_WB.values()), dtype=float)):
        raise next(_not_rigid(name, X) for name, X in X_WB.items() if not is_rigid(np.array(X, dtype=float)[None]))
    robots = [replace(robot, X_WB=X_WB[robot.name]) if robot.name in X_WB else robot for robot in cell.robots]
    return replace(cell, robots=tuple(robots))


def _not_rigid(name: str, X: Array) -> ValueError:
    """The error of a base that is no displacement."""
    return ValueError(f"moved: expected a rigid displacement of shape (4, 4) as base of '{name}', got {X}")


def stands_by_link(cell: Cell, robot: str) -> bool:
    """Whether a robot's foot has no body, so that its first link may stand in the surroundings; see ``stands_on``."""
    bodies = cell.robot(robot).model.bodies
    return bool(bodies and cell.obstacles) and all(body.link != BASE for body in bodies)


def placed_columns(cell: Cell, bodies: Sequence[SceneBody], X_WB: Mapping[str, Array]) -> dict[int, SceneBody] | None:
    """The columns below or above the bases of moved robots, by the index of their bodies; None where one comes or goes.

    A column whose height stays keeps its solid.
    """
    placed = dict[int, SceneBody]()
    for name in X_WB:
        robot = cell.robot(name)
        if robot.pedestal is None or isinstance(robot.pedestal, Bracket):
            continue
        solid = robot.pedestal.solid(robot.X_WB)
        index = next((i for i, body in enumerate(bodies) if body.kind is Kind.PEDESTAL and body.robot == name), None)
        if (solid is None) is not (index is None):
            return None
        if solid is not None and index is not None:
            shape = bodies[index].shape
            same = isinstance(shape, Box | Cylinder) and _is_same(shape, solid[0])
            placed[index] = replace(bodies[index], shape=shape if same else solid[0], X_BS=solid[1])
    return placed


def _is_same(shape: Box | Cylinder, other: Solid) -> bool:
    """Whether two upright columns of one kind are as high."""
    if isinstance(shape, Box):
        return isinstance(other, Box) and abs(shape.size[2] - other.size[2]) <= SAME_SIZE
    return isinstance(other, Cylinder) and abs(shape.length - other.length) <= SAME_SIZE
