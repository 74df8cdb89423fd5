"""What never moves but stands where a base is: each kind that stands in another fails the checks and is a distance."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest
from builders.scene_builders import arm_model, body, fixed_part, floor, make_cell, placed, thing

from cellplan.certify.certify import certify
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.geometry.shapes import Box, Shape
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell, Part, Robot
from cellplan.model.cell.layout import KeepOut, LayoutSettings
from cellplan.model.cell.mounting import Pedestal
from cellplan.model.robot.robot import BASE
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.distances.moving_bodies import NeighbourCells

COLUMN = Pedestal(radius=0.3, floor=0.0)
HIGH, LOW = pose((0.0, 0.0, 0.5)), np.eye(4)
AT_REST = np.zeros((2, 12))
BIG = Box((0.5, 0.5, 0.4))
WALL = Box((0.1, 4.0, 0.15))


@dataclass
class BaseOfB:
    """Where the second robot stands: x, y and z."""

    cell: Cell

    @property
    def given(self) -> Array:
        return np.zeros(3)

    def base_twists(self, x: Array) -> Array:
        base = np.zeros((2, 6, 3))
        base[1, :3] = np.eye(3)
        return base

    def neighbours(self, x: Array, step: float) -> Iterator[NeighbourCells]:
        return iter(())

    def placed(self, x: Array) -> Cell:
        a, b = self.cell.robots
        return replace(self.cell, robots=(a, replace(b, X_WB=pose(tuple(x)) @ b.X_WB)))


def arm(name: str, base: Array, **changes) -> Robot:
    """A robot of which only the foot has a body."""
    model = arm_model()
    return replace(placed(name, replace(model, bodies=model.bodies[:1]), base=base), **changes)


def cabinet(x: float) -> dict[str, tuple]:
    return {"attachments": (body("cabinet", BASE, shape=BIG, at=(x, 0.0, 0.2)),)}


def facing(base: Array, x: float) -> Array:
    """A base so far along x, turned towards the first robot."""
    return pose((x, 0.0, 0.0)) @ base @ pose((0.0, 0.0, 0.0), (0.0, 0.0, np.pi))


def cell_of(a: Robot, b: Robot, *things: tuple[str, Shape, Array], part: Part | None = None) -> Cell:
    return make_cell(a, b, part=part, things=(floor(), *(thing(*entry) for entry in things)))


KINDS = {
    "foot in the plinth of another": (
        cell_of(arm("a", HIGH, pedestal=COLUMN), arm("b", facing(LOW, 2.0))),
        {"a/pedestal", "b/foot"},
        1.55,
    ),
    "plinth in plinth": (
        cell_of(arm("a", HIGH, pedestal=COLUMN), arm("b", facing(HIGH, 2.0), pedestal=COLUMN)),
        {"a/pedestal", "b/pedestal"},
        1.4,
    ),
    "foot in an obstacle": (
        cell_of(arm("a", LOW), arm("b", facing(LOW, 2.0)), ("wall", WALL, pose((1.2, 0.0, 0.075)))),
        {"b/foot", "wall"},
        0.6,
    ),
    "plinth in an obstacle": (
        cell_of(arm("a", LOW), arm("b", facing(HIGH, 2.0), pedestal=COLUMN), ("wall", WALL, pose((1.2, 0.0, 0.075)))),
        {"b/pedestal", "wall"},
        0.45,
    ),
    "feet of two robots": (cell_of(arm("a", LOW), arm("b", facing(LOW, 2.0))), {"a/foot", "b/foot"}, 1.7),
    "attachment in an obstacle": (
        cell_of(arm("a", LOW), arm("b", facing(LOW, 2.0), **cabinet(-0.5)), ("wall", WALL, pose((3.2, 0.0, 0.075)))),
        {"b/cabinet", "wall"},
        -0.4,
    ),
    "attachment in a foot": (
        cell_of(arm("a", LOW, **cabinet(-0.6)), arm("b", facing(LOW, -2.0))),
        {"a/cabinet", "b/foot"},
        -1.0,
    ),
    "attachment in a plinth": (
        cell_of(arm("a", LOW, **cabinet(-0.6)), arm("b", facing(HIGH, -2.5), pedestal=COLUMN)),
        {"a/cabinet", "b/pedestal"},
        -1.35,
    ),
    "attachments of two robots": (
        cell_of(arm("a", LOW, **cabinet(-0.6)), arm("b", facing(LOW, -3.0), **cabinet(-0.6))),
        {"a/cabinet", "b/cabinet"},
        -1.3,
    ),
    "foot in a part at rest": (
        cell_of(arm("a", LOW), arm("b", facing(LOW, 2.0)), part=fixed_part(BIG, pose((1.2, 0.0, 0.2)))),
        {"b/foot", "part"},
        0.4,
    ),
    "plinth in a part at rest": (
        cell_of(
            arm("a", LOW), arm("b", facing(HIGH, 2.0), pedestal=COLUMN), part=fixed_part(BIG, pose((1.2, 0.0, 0.2)))
        ),
        {"b/pedestal", "part"},
        0.25,
    ),
}


def verdict(cell: Cell) -> bool:
    """What the checks say of a cell at rest."""
    scene = Scene.from_cell(cell)
    return certify(scene, AT_REST).is_met and all(check.passed for check in check_mounting(scene, AT_REST))


@pytest.mark.parametrize("kind", KINDS)
def test_what_stands_in_another_thing_fails_the_checks_and_falls_short_of_its_distance(kind: str) -> None:
    cell, names, apart = KINDS[kind]
    variables, sign = BaseOfB(cell), 1.0 if apart > 0.0 else -1.0
    distances = CellDistances.of(Scene.from_cell(cell), variables)
    for deep in (-0.02, 0.03):
        x = np.array([-apart - sign * deep, 0.0, 0.0])
        near = distances.near(x, AT_REST[:1], 0.1)
        short = near.distances < distances.demands[near.rows]
        failing = [set(distances.pairs[row].names) for row in near.rows[short].tolist()]
        assert verdict(variables.placed(x)) is (deep < 0.0)
        assert failing == ([names] if deep > 0.0 else [])


@pytest.mark.parametrize(("height", "reach"), [(0.0, 0.0), (0.5, 0.3)])
def test_bases_and_columns_keep_out_of_areas_by_their_footprints(height: float, reach: float) -> None:
    area = KeepOut(name="aisle", shape=Box((0.4, 2.0, 1.0)), X_WS=pose((1.0, 0.0, 0.5)))
    cell = cell_of(arm("a", LOW), arm("b", facing(pose((0.0, 0.0, height)), 2.0), pedestal=COLUMN))
    cell = replace(cell, layout=LayoutSettings(ranges=(), keep_out=(area,)))
    variables = BaseOfB(cell)
    distances = CellDistances.of(Scene.from_cell(cell), variables)
    for apart in (0.05, -0.04):
        near = distances.near(np.array([apart + reach - 0.8, 0.0, 0.0]), AT_REST[:1], 0.1)
        distances_by_name = {
            distances.pairs[pair].names[1]: (float(d), slope)
            for pair, d, slope in zip(
                near.rows.tolist(),
                near.distances,
                distances.derivatives(near, np.zeros(3), np.zeros((1, 12, 3))),
                strict=True,
            )
            if distances.pairs[pair].names[0] == "keep_out.aisle"
        }
        distance, slope = distances_by_name["b/pedestal" if reach else "b/base"]
        assert distance == pytest.approx(apart, abs=1e-5)
        np.testing.assert_allclose(slope, (1.0, 0.0, 0.0), atol=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_the_distances_of_what_stands_change_with_the_base_as_differences_say(kind: str) -> None:
    cell, names, apart = KINDS[kind]
    variables = BaseOfB(cell)
    distances = CellDistances.of(Scene.from_cell(cell), variables)
    x = np.array([np.copysign(0.01, apart) - apart, 0.01, 0.02])
    near = distances.near(x, AT_REST[:1], 0.1)
    exact = distances.derivatives(near, x, np.zeros((1, cell.joint_count, 3)))
    row = next(row for row, pair in enumerate(near.rows.tolist()) if set(distances.pairs[pair].names) == names)
    step = 1e-5
    for variable in range(3):
        results = []
        for sign in (step, -step):
            other = distances.near(x + sign * np.eye(3)[variable], AT_REST[:1], 0.2)
            results.append(float(other.distances[other.rows == near.rows[row]][0]))
        assert exact[row, variable] == pytest.approx((results[0] - results[1]) / (2.0 * step), abs=1e-4)
