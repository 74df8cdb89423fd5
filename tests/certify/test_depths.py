"""Depths of bodies that stand on or hold each other, in closed form, wherever the cell stands."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, body, displaced, floor, held_part, make_cell, no_tool, placed

from cellplan.certify.depths import MAX_ROWS, PairDepth, mounted_depths
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Tool
from cellplan.scene.scene import Scene

X = pose((0.3, -0.2, 0.1), (0.4, 0.2, -1.0))
SUNK = 0.0013  # [m]


def named(cell: Cell, q: Array) -> dict[tuple[str, str], PairDepth]:
    scene = Scene.from_cell(cell)
    names = [body.name for body in scene.bodies]
    return {(names[one.pair.first], names[one.pair.second]): one for one in mounted_depths(scene, q)}


def lowered(z: float) -> Cell:
    """An arm with an upright foot, lowered into the floor."""
    return make_cell(placed("arm", arm_model(), base=pose((0.2, 0.1, -z)), tool=no_tool()), things=(floor(),))


@pytest.mark.parametrize("place", [np.eye(4), X])
def test_a_foot_is_as_deep_in_the_floor_as_its_base_stands_below_it(place: Array) -> None:
    for z in (-0.001, 0.0, SUNK):
        depths = named(displaced(lowered(z), place), np.zeros((2, 6)))
        assert depths["arm/foot", "floor"].depth == pytest.approx(max(z, 0.0), abs=1e-9)


@pytest.mark.parametrize("place", [np.eye(4), X])
def test_a_gripper_is_as_deep_in_the_part_as_it_reaches_into_it(place: Array) -> None:
    grip = Tool(X_FT=pose((0.0, 0.0, 0.1)), bodies=(body("tool", 5, shape=Box((0.02, 0.02, 0.1)), at=(0, 0, 0.05)),))
    part = held_part(Cylinder(0.05, 0.04), "arm", pose((0.0, 0.0, SUNK - 0.02)))
    cell = make_cell(placed("arm", arm_model(), tool=grip), part=part)
    q = np.random.default_rng(1).uniform(-1.0, 1.0, size=(3, 6))

    depths = named(displaced(cell, place), q)

    assert depths["arm/tool", "part"].depth == pytest.approx(SUNK, abs=2e-5)  # of a depth of solids


def test_a_part_that_turns_in_its_second_holder_is_deepest_where_the_holder_points_at_its_middle() -> None:
    """Two balls, the part and a holder, 30 mm above each other where the first joint of the holder is at zero."""
    holder = placed("holder", arm_model(), base=pose((0.0, 0.0, 5.0)))
    ball = body("tool", 5, shape=Sphere(0.01))
    other = placed("other", arm_model(), tool=Tool(X_FT=np.eye(4), bodies=(ball,)))
    at = pose((0.7, 0.0, 1.0 + 0.03), (0.0, 0.5 * np.pi, 0.0))  # flange of the other at zero, and 30 mm above it
    X_WF = pose((0.7, 0.0, 6.0), (0.0, 0.5 * np.pi, 0.0))
    part = held_part(Sphere(0.025), "holder", np.linalg.inv(at) @ X_WF)
    grasp = replace(part.held_by[0], robot="other", X_PT=np.linalg.inv(at), axes=(0, 1, 2))
    cell = make_cell(holder, other, part=replace(part, held_by=(*part.held_by, grasp)))
    q = np.zeros((2 * MAX_ROWS + 1, 12))
    q[:, 6] = np.linspace(-0.01, 0.015, len(q))

    depth = named(cell, q)["other/tool", "part"]

    middles = np.stack([0.7 * np.cos(q[:, 6]), 0.7 * np.sin(q[:, 6])], axis=1)
    closed = 0.035 - np.hypot(np.linalg.norm(middles - [0.7, 0.0], axis=1), 0.03)
    assert depth.pair.moves
    assert depth.depth == pytest.approx(closed.max(), abs=2e-5)
    assert closed[depth.row] == pytest.approx(closed.max(), abs=2e-5)
