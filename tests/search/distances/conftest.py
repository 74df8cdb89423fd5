"""A cell with columns, rods and a held part, and variables that move them all."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Capsule
from cellplan.geometry.transforms import Array, pose, rotation_exp
from cellplan.model.cell.cell import Cell, Part, Tool
from cellplan.scene.scene import Scene
from cellplan.search.distances.moving_bodies import NeighbourCells

CELL = Path(__file__).resolve().parents[3] / "cells" / "four_robots.yaml"
BASES = [("kuka", 0), ("kuka", 1), ("kuka", 2), ("kuka", 5), ("abb", 1), ("abb", 2), ("abb", 3)]  # robot, component


@dataclass
class SomeVariables:
    """Displacements of two bases about the world's axes, length, tilt and roll of a rod, and of a grasp along z."""

    cell: Cell

    @property
    def given(self) -> Array:
        return np.array([0.0] * len(BASES) + [0.15, 0.2, 0.3, 0.0])

    def base_twists(self, x: Array) -> Array:
        twists = np.zeros((len(self.cell.robots), 6, len(x)))
        for variable, (robot, component) in enumerate(BASES):
            twists[self.cell.index(robot), component, variable] = 1.0
        return twists

    def tools(self, x: Array) -> Mapping[str, Tool]:
        length, tilt, roll = x[len(BASES) : len(BASES) + 3]
        holder, _ = self.cell.robot("kuka").tool.bodies
        X_FR = pose((0.0, 0.0, 0.0), (0.0, tilt, roll))
        axis, begin, end = X_FR[:3, 2].copy(), 0.042, length - 0.024
        X_FT, X_FS = X_FR.copy(), X_FR.copy()
        X_FT[:3, 3], X_FS[:3, 3] = length * axis, 0.5 * (begin + end) * axis
        rod = replace(self.cell.robot("kuka").tool.bodies[1], shape=Capsule(0.012, end - begin), X_BS=X_FS)
        return {"kuka": replace(self.cell.robot("kuka").tool, X_FT=X_FT, bodies=(holder, rod))}

    def part(self, x: Array) -> Part:
        part = self.cell.part
        grasp = part.held_by[0]
        return replace(part, held_by=(replace(grasp, X_PT=grasp.X_PT @ pose((0.0, 0.0, -x[-1]))), *part.held_by[1:]))

    def neighbours(self, x: Array, step: float) -> Iterator[NeighbourCells]:
        for unit in np.eye(len(x)):
            sides = (self.placed(x + step * unit), self.placed(x - step * unit))
            for robot in ("kuka", None):
                yield NeighbourCells(robot=robot, by=unit, sides=sides)

    def placed(self, x: Array) -> Cell:
        tools, robots = self.tools(x), []
        for robot in self.cell.robots:
            twist = np.zeros(6)
            for value, (name, component) in zip(x, BASES, strict=False):
                twist[component] += value if name == robot.name else 0.0
            X_WB = robot.X_WB.copy()
            X_WB[:3, :3], X_WB[:3, 3] = rotation_exp(twist[3:]) @ X_WB[:3, :3], X_WB[:3, 3] + twist[:3]
            robots.append(replace(robot, X_WB=X_WB, tool=tools.get(robot.name, robot.tool)))
        return replace(self.cell, robots=tuple(robots), part=self.part(x))


@pytest.fixture(scope="session")
def variables() -> SomeVariables:
    variables = SomeVariables(load_cell(CELL))
    return SomeVariables(variables.placed(variables.given))


@pytest.fixture(scope="session")
def scene(variables: SomeVariables) -> Scene:
    return Scene.from_cell(variables.cell)
