"""Tool error by the skew of two clocks: bounds by the way of the tool, against errors at shifted times."""

from dataclasses import replace

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies, program
from builders.scene_builders import work

from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.certify.lever_arms import LeverArms
from cellplan.checks.tools.skew import ErrorGrowth, Mover, ShiftedTool
from cellplan.geometry.transforms import inverse
from cellplan.measures.tool_errors import errors_on_part
from cellplan.scene.scene import Scene

SPEED = 0.5  # [m/s]
TIMES = 0.01 * np.arange(101)


def steady(error: float, limit: float) -> ErrorGrowth:
    """What a tool of constant speed makes."""
    still = np.zeros(len(TIMES))
    sums = SPEED * TIMES
    return ErrorGrowth(times=TIMES, sums=sums, turns=still, whole=sums, rows=TIMES, errors=still + error, limit=limit)


@pytest.mark.parametrize("error", [0.0, 3e-5])
def test_a_tool_of_constant_speed_allows_what_is_left_of_its_tolerance(error: float) -> None:
    growth = steady(error, limit=1e-4)

    allowed, at_s = growth.allowed()

    assert allowed == pytest.approx((1e-4 - error) / SPEED, rel=1e-9)
    assert at_s is not None
    assert growth.largest(allowed) == pytest.approx(1e-4)
    assert growth.largest(2e-3) == pytest.approx(error + 2e-3 * SPEED)


def test_an_error_beyond_the_tolerance_allows_nothing() -> None:
    assert steady(2e-4, limit=1e-4).allowed()[0] == 0.0


def test_a_way_that_is_shorter_than_the_tolerance_allows_any_skew() -> None:
    assert steady(0.0, limit=SPEED + 1e-6).allowed() == (np.inf, None)


def test_a_tool_that_moves_for_a_while_only_is_limited_there() -> None:
    still = np.zeros(len(TIMES))
    sums = SPEED * np.clip(TIMES - 0.4, 0.0, 0.1)  # 50 mm from 0.4 to 0.5 s
    growth = ErrorGrowth(times=TIMES, sums=sums, turns=still, whole=sums, rows=TIMES, errors=still, limit=0.01)

    allowed, at_s = growth.allowed()

    assert allowed == pytest.approx(0.02)
    assert at_s is not None
    assert 0.4 <= at_s <= 0.5
    assert growth.largest(0.3) == pytest.approx(0.05)


def test_twice_the_time_allows_twice_the_skew() -> None:
    still, sums = np.zeros(len(TIMES)), 0.1 * np.sin(0.5 * np.pi * TIMES)
    growth = ErrorGrowth(times=TIMES, sums=sums, turns=still, whole=sums, rows=TIMES, errors=still, limit=1e-3)
    slower = replace(growth, times=2.0 * TIMES, rows=2.0 * TIMES)

    assert slower.allowed()[0] == pytest.approx(2.0 * growth.allowed()[0])


@pytest.mark.parametrize("axes", [(0, 1, 2, 3, 4, 5), (0, 2, 5), (0, 1, 2, 3, 4), (1,)])
@pytest.mark.parametrize("seed", [1, 2])
def test_no_error_at_a_shifted_time_is_above_its_bound(seed: int, axes: tuple[int, ...]) -> None:
    cell = cell_with_bodies(seed)
    scene = Scene.from_cell(cell)
    stacked = program(cell, seed, samples=12, stride=0.08)
    q = {robot.name: stacked[:, cell.columns(robot.name)] for robot in cell.robots}
    times, motion, arms = 0.1 * np.arange(12), FreeMotion(scene, stacked), LeverArms(scene, stacked)
    assert cell.carrier is not None
    carrier = cell.robots[cell.carrier].name
    robot = next(robot.name for robot in cell.robots if robot.name != carrier)
    movers = {n: Mover.of(scene, arms, n, q=q[n], steps=arms.steps(stacked)) for n in (carrier, robot)}
    X_CP, tool = cell.part.X_CP, scene.chains[robot]
    rows = np.arange(12)
    desired = inverse(scene.chains[carrier].tool_poses(q[carrier]) @ X_CP) @ tool.tool_poses(q[robot])
    desired = np.roll(desired, 1, axis=0)
    desired[0] = desired[1]  # an error without a skew
    relation = replace(work(robot), axes=axes, is_spin_free=axes == (0, 1, 2, 3, 4))
    shifted = ShiftedTool(
        relation=relation, mover=movers[robot], carrier=movers[carrier], X_CP=X_CP, desired=desired, limits=(0.3, 0.3)
    ).travel(times)

    for skew in (0.01, 0.07, 0.25):
        for share in (-1.0, -0.6, 0.3, 1.0):
            at = np.clip((times + share * skew) / 0.1, 0.0, 11.0)
            X_PT = inverse(scene.chains[carrier].tool_poses(q[carrier]) @ X_CP) @ tool.tool_poses(
                motion.positions(robot, at)
            )
            errors = errors_on_part(X_PT, desired, relation)
            position, orientation = (np.linalg.norm(part, axis=1) for part in (errors[:, :3], errors[:, 3:]))
            assert np.all(position <= shifted.position.errors + shifted.position.growth(skew) + 1e-12)
            assert np.all(orientation <= shifted.orientation.errors + shifted.orientation.growth(skew) + 1e-7)
    assert len(rows) == len(shifted.position.rows)


@pytest.mark.parametrize("seed", [3])
def test_the_bound_of_a_small_skew_is_near_the_way_of_the_tool(seed: int) -> None:
    cell = cell_with_bodies(seed)
    scene = Scene.from_cell(cell)
    ends = program(cell, seed, samples=2, stride=0.3)
    stacked = ends[0] + np.linspace(0.0, 1.0, 201)[:, None] * (ends[1] - ends[0])
    q = {robot.name: stacked[:, cell.columns(robot.name)] for robot in cell.robots}
    assert cell.carrier is not None
    carrier = cell.robots[cell.carrier].name
    robot = next(robot.name for robot in cell.robots if robot.name != carrier)
    arms = LeverArms(scene, stacked)
    movers = {n: Mover.of(scene, arms, n, q=q[n], steps=arms.steps(stacked)) for n in (carrier, robot)}
    X_WT, times = scene.chains[robot].tool_poses(q[robot]), 0.005 * np.arange(201)
    desired = inverse(scene.chains[carrier].tool_poses(q[carrier]) @ cell.part.X_CP) @ X_WT
    tool = ShiftedTool(
        relation=work(robot),
        mover=movers[robot],
        carrier=movers[carrier],
        X_CP=cell.part.X_CP,
        desired=desired,
        limits=(1e-3, 1.0),
    )

    fastest = np.linalg.norm(np.diff(X_WT[:, :3, 3], axis=0), axis=1).max() / 0.005

    assert fastest <= tool.travel(times).speed <= 1.01 * fastest
    assert tool.travel(times).position.allowed()[0] == pytest.approx(1e-3 / fastest, rel=0.01)
