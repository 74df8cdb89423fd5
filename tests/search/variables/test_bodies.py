"""Bodies that variables move: rods, the part and columns by closed forms, and obstacles that become pedestals."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellplan.geometry.shapes import Box, Capsule, Cylinder
from cellplan.geometry.transforms import Array, inverse
from cellplan.io.cell.load import load_cell
from cellplan.model.cell import Cell
from cellplan.search.variables.displaced import BodyFrame
from cellplan.search.variables.variables import Variables

CELLS = Path(__file__).resolve().parents[3] / "cells"
STEP = 1e-6
ROD = {"length_mm": 160, "tilt_deg": 25, "roll_deg": 40, "radius_mm": 12, "holder": {"radius_mm": 40, "length_mm": 60}}
BARE = {f"robots.{name}.pedestal": None for name in ("reis", "kuka", "abb", "staubli")}
BASE = {"x_mm": [0, 3000], "y_mm": [-2000, 2000], "z_mm": [0, 600], "yaw_deg": [-360, 360]}


@pytest.fixture(scope="module")
def plain() -> Cell:
    return load_cell(CELLS / "four_robots.yaml")


def signed_distance(shape: Box | Capsule | Cylinder, p: Array) -> float:
    """Distance of a point outside from a solid, in its own frame."""
    if isinstance(shape, Box):
        return float(np.linalg.norm(np.maximum(np.abs(p) - 0.5 * np.array(shape.size), 0.0)))
    beyond = max(abs(float(p[2])) - 0.5 * shape.length, 0.0)
    across = float(np.hypot(p[0], p[1]))
    if isinstance(shape, Capsule):
        return float(np.hypot(across, beyond)) - shape.radius
    return float(np.hypot(max(across - shape.radius, 0.0), beyond))


def nearest(distance: Callable[[Array], float], p: Array) -> tuple[Array, Array]:
    """Nearest point of a solid to a point outside, and the direction to that point, by differences of the distance."""
    units = np.eye(3)
    n = np.array([distance(p + STEP * unit) - distance(p - STEP * unit) for unit in units]) / (2.0 * STEP)
    return p - distance(p) * n, n


def rate_by_differences(variables: Variables, x: Array, distance: Callable[[Cell], float]) -> Array:
    ends = [[distance(variables.placed(x + sign * unit)) for sign in (1.0, -1.0)] for unit in STEP * np.eye(len(x))]
    return np.array([plus - minus for plus, minus in ends]) / (2.0 * STEP)


def test_distances_from_a_rod_change_as_its_points_say(plain: Cell) -> None:
    cell = plain.with_values({"robots.kuka.tool": {"rod": ROD}, "layout.vary": {"kuka.tool": _tool_ranges()}})
    variables = Variables.of(cell)
    (body,) = variables.displaced(variables.given)
    assert (body.name, body.robot, body.frame) == ("kuka/tool_2", "kuka", BodyFrame.FLANGE)
    for p in ([0.2, 0.1, 0.12], [0.09, 0.08, 0.3], [0.0, 0.0, 0.3], [-0.1, -0.1, 0.0]):

        def distance(cell: Cell, p: list[float] = p) -> float:
            rod = cell.robot("kuka").tool.bodies[1]
            assert isinstance(rod.shape, Capsule)
            return signed_distance(rod.shape, (inverse(rod.X_BS) @ [*p, 1.0])[:3])

        here = variables.placed(variables.given)
        rod = here.robot("kuka").tool.bodies[1]
        on_rod, n = _nearest_in(rod.X_BS, rod.shape, np.array(p))
        exact = -n @ body.velocity(on_rod[None])[0]
        assert exact == pytest.approx(rate_by_differences(variables, variables.given, distance), abs=1e-6)


def _tool_ranges() -> dict[str, list[float]]:
    return {"length_mm": [120, 250], "tilt_deg": [0, 60], "roll_deg": [-180, 180]}


def _nearest_in(X: Array, shape: object, p: Array) -> tuple[Array, Array]:
    """The same as ``nearest`` for a solid at a pose."""
    assert isinstance(shape, Box | Capsule | Cylinder)
    return nearest(lambda at: signed_distance(shape, (inverse(X) @ [*at, 1.0])[:3]), p)


@pytest.mark.parametrize("column", [{"cylinder": {"radius_mm": 230}}, {"box": {"size_mm": [500, 300]}}])
def test_distances_from_a_pedestal_change_as_its_points_say(plain: Cell, column: dict[str, object]) -> None:
    cell = plain.with_values({"robots.abb.pedestal": column, "layout.vary": {"abb.base": BASE}})
    variables = Variables.of(cell)
    (body,) = variables.displaced(variables.given)
    assert (body.name, body.frame) == ("abb/pedestal", BodyFrame.WORLD)
    base = cell.robot("abb").X_WB[:3, 3]
    for beside in ([0.6, 0.1, -0.1], [0.35, 0.3, 0.2], [0.05, 0.02, 0.3], [-0.4, 0.3, -0.35]):
        p = base + beside

        def distance(cell: Cell, p: Array = p) -> float:
            shape, X_WS = _pedestal(cell)
            return signed_distance(shape, (inverse(X_WS) @ [*p, 1.0])[:3])

        shape, X_WS = _pedestal(variables.placed(variables.given))
        on_column, n = _nearest_in(X_WS, shape, p)
        exact = -n @ body.velocity(on_column[None])[0]
        assert exact == pytest.approx(rate_by_differences(variables, variables.given, distance), abs=1e-6)


def _pedestal(cell: Cell) -> tuple[Box | Cylinder, Array]:
    robot = cell.robot("abb")
    assert robot.pedestal is not None
    found = robot.pedestal.solid(robot.X_WB)
    assert found is not None
    shape, X_BS = found
    assert isinstance(shape, Box | Cylinder)
    return shape, robot.X_WB @ X_BS


def test_corners_of_a_slanting_column_move_with_its_base(plain: Cell) -> None:
    tilted = {"robots.abb.pedestal": None, "robots.abb.mount": {"tilted": {"box": {"size_mm": [400, 300]}}}}
    ranges = {"abb.base": {**BASE, "roll_deg": [-30, 30], "pitch_deg": [-30, 30]}}
    variables = Variables.of(plain.with_values({**tilted, "layout.vary": ranges}))
    x = variables.given + np.array([0.02, 0.01, 0.1, 0.2, -0.1, 0.3])

    def corners(cell: Cell) -> Array:
        robot = cell.robot("abb")
        assert robot.pedestal is not None
        found = robot.pedestal.solid(robot.X_WB)
        assert found is not None
        points = np.c_[found[0].vertices, np.ones(8)]
        return (points @ (robot.X_WB @ found[1]).T)[:, :3]

    (body,) = variables.displaced(x)
    exact = body.velocity(corners(variables.placed(x)))
    for column, unit in enumerate(STEP * np.eye(len(x))):
        plus, minus = (corners(variables.placed(x + sign * unit)) for sign in (1.0, -1.0))
        assert np.abs((plus - minus) / (2.0 * STEP) - exact[..., column]).max() <= 1e-8


def test_the_part_moves_with_its_grasp_and_with_the_rod_that_holds_it(plain: Cell) -> None:
    ranges = {"reis.tool": _tool_ranges(), "part.held_by[0].at": {"x_mm": [-300, -200], "pitch_deg": [60, 120]}}
    cell = plain.with_values({"robots.reis.tool": {"rod": ROD}, "layout.vary": ranges})
    variables = Variables.of(cell)
    part = next(body for body in variables.displaced(variables.given) if body.name == "part")
    points = np.random.default_rng(2).uniform(-0.3, 0.3, (4, 3))

    def placed(x: Array) -> Array:
        now = variables.placed(x)
        return now.robot("reis").tool.X_FT @ now.part.X_CP

    X_FP = placed(variables.given)
    exact = part.velocity((X_FP @ np.c_[points, np.ones(4)].T).T[:, :3])
    for column, unit in enumerate(STEP * np.eye(len(variables.given))):
        rate = (placed(variables.given + unit) - placed(variables.given - unit)) / (2.0 * STEP)
        assert np.abs((rate @ np.c_[points, np.ones(4)].T).T[:, :3] - exact[..., column]).max() <= 1e-8


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
