"""Obstacles below varied bases become pedestals of their robots."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.search.variables.variables import Variables

CELLS = Path(__file__).resolve().parents[3] / "cells"
BARE = {f"robots.{name}.pedestal": None for name in ("reis", "kuka", "abb", "staubli")}
BASE = {"x_mm": [0, 3000], "y_mm": [-2000, 2000], "z_mm": [0, 600], "yaw_deg": [-360, 360]}


@pytest.fixture(scope="module")
def plain() -> Cell:
    return load_cell(CELLS / "four_robots.yaml")


def plinth(cell: Cell, name: str, *, turned: float = 0.0, box: bool = False) -> dict[str, object]:
    """An obstacle on which the base of a robot stands."""
    x, y, z = (1000.0 * cell.robot(name).X_WB[:3, 3]).round(6).tolist()
    at = {"xyz_mm": [x, y, 0.5 * z], "rpy_deg": [0, 0, turned]}
    shape = {"box": {"size_mm": [500, 300, z]}} if box else {"cylinder": {"radius_mm": 230, "length_mm": z}}
    return {**shape, "at": at}


def test_an_obstacle_below_a_varied_base_becomes_its_pedestal(plain: Cell) -> None:
    stands = {"environment.block": plinth(plain, "kuka"), "environment.stool": plinth(plain, "reis")}
    ranges = {"layout.vary": {"kuka.base": BASE}}
    cell = plain.with_values({**BARE, **stands, **ranges})
    variables = Variables.of(cell)
    assert [obstacle.name for obstacle in variables.base.obstacles] == ["floor", "stool"]
    assert variables.remarks == (
        "environment.block is the pedestal of 'kuka' here: it moves with the base and reaches down to 0 mm",
    )
    before, robot = cell.obstacles[-2], variables.base.robot("kuka")
    assert robot.pedestal is not None
    after = robot.pedestal.solid(robot.X_WB)
    assert after is not None
    assert after[0] == before.shape
    assert np.abs(robot.X_WB @ after[1] - before.X_WS)[:3, 2:].max() <= 1e-12  # axis and middle
    written = variables.cell(variables.given, np.concatenate([robot.start for robot in cell.robots]))
    assert [obstacle.name for obstacle in written.obstacles] == ["floor", "stool"]


def test_an_excluded_obstacle_stays(plain: Cell) -> None:
    pair = {"bodies": ["kuka/foot", "block"], "reason": "bolted down"}
    stands = {"environment.block": plinth(plain, "kuka"), "checks.exclude": [pair]}
    variables = Variables.of(plain.with_values({**BARE, **stands, "layout.vary": {"kuka.base": BASE}}))
    assert [obstacle.name for obstacle in variables.base.obstacles] == ["floor", "block"]
    assert variables.remarks == (
        "environment.block stays where it is, as an exclusion names it, although 'kuka' stands on it",
    )


@pytest.mark.parametrize(("turn", "sides"), [(-105.0, [0.5, 0.3]), (-15.0, [0.3, 0.5]), (0.0, None)])
def test_a_box_becomes_a_pedestal_where_its_sides_are_those_of_the_base(
    plain: Cell, turn: float, sides: list[float] | None
) -> None:
    stands = {"environment.block": plinth(plain, "kuka", turned=turn, box=True)}
    base = Variables.of(plain.with_values({**BARE, **stands, "layout.vary": {"kuka.base": BASE}})).base
    pedestal = base.robot("kuka").pedestal
    assert (None if pedestal is None else pedestal.size) == (None if sides is None else pytest.approx(tuple(sides)))


def test_a_plate_below_two_bases_stays(plain: Cell) -> None:
    plate = {"cylinder": {"radius_mm": 4000, "length_mm": 500}, "at": {"xyz_mm": [1175, 775, 250]}}
    level = {"environment.plate": plate, "robots.abb.base.z_mm": 500}
    variables = Variables.of(plain.with_values({**BARE, **level, "layout.vary": {"kuka.base": BASE, "abb.base": BASE}}))
    assert [obstacle.name for obstacle in variables.base.obstacles] == ["floor", "plate"]
