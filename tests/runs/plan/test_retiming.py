"""Retiming: how the demands on rows scale with time, and that the shortest times are the limits of the checks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import make_cell
from builders.transfer_cells import gantry
from builders.uncertified import uncertified

from cellplan import Solution, load_cell
from cellplan.model.motion.joint_path import JointPath
from cellplan.model.settings.checks import ChecksEntry
from cellplan.runs.plan.retiming import RowLimits, joint_bounds, joint_path, row_limits, transfer_retimer
from cellplan.scene.scene import Scene

CELL = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
FASTEST = {
    "motion.timing": "fastest",
    "motion.step_s": 0.004,
    "acceleration": {"full_speed_in_s": [0.25, 0.2, 0.15]},
    "tasks.circle.tolerance.between_rows_mm": 10,  # so that joints bind, not the errors between rows
    "tasks.circle.tolerance.between_rows_deg": 10,
}
SPANS = np.array([0.6, -0.3])  # [m] of both slides
SLOW = 0.01  # [s] between rows


@pytest.fixture(scope="module")
def fastest() -> Solution:
    return uncertified(load_cell(CELL).with_values(FASTEST))


@pytest.fixture
def limits(fastest: Solution) -> RowLimits:
    return row_limits(Scene.from_cell(fastest.cell), fastest.runs[0].schedule)


@pytest.mark.parametrize("factor", [1.5, 2.0, 4.0])
def test_rows_that_are_slower_by_a_factor_need_to_be_slower_by_that_much_less(
    limits: RowLimits, fastest: Solution, factor: float
) -> None:
    """Velocities fall with 1/k, accelerations with 1/k^2, jerks with 1/k^3; windows of a cycle are as long as a row."""
    motion = fastest.motion
    slow = replace(limits, step=factor * limits.step)

    at_rows, when_slower = (entry.shares(np.arange(len(motion.q)) * entry.step, motion.q) for entry in (limits, slow))

    for power, share, slower in zip((1, 2), at_rows[:2], when_slower[:2], strict=True):
        np.testing.assert_allclose(slower, share / factor**power, rtol=2e-2)


def test_the_shortest_time_keeps_all_limits_and_uses_one_of_them_up(limits: RowLimits, fastest: Solution) -> None:
    motion = fastest.motion
    needed = limits.slower(motion.sigma, motion.q)

    assert 0.97 <= needed <= 1.0
    faster = replace(limits, step=0.95 * limits.step)
    assert faster.slower(motion.sigma, motion.q) > 1.0


def test_the_joints_between_the_rows_are_those_of_the_rows_at_these(fastest: Solution) -> None:
    """And their derivative is that of differences."""
    run = fastest.runs[0]
    path = joint_path(run.motion)
    sigma, step = run.motion.sigma, 1e-6
    inner = sigma[5:-6:7] + 0.37 * np.diff(sigma)[5:-5:7]  # between knots, where the second derivative may jump

    np.testing.assert_allclose(path.at(run.motion.sigma), run.motion.q, atol=1e-9)
    differences = (path.at(inner + step) - path.at(inner - step)) / (2.0 * step)
    np.testing.assert_allclose(path.at(inner, 1), differences, atol=1e-4)


def test_a_joint_without_a_stated_acceleration_is_bound_by_what_the_cell_assumes(fastest: Solution) -> None:
    cell = fastest.cell
    bounds = joint_bounds(cell)
    unlimited = joint_bounds(load_cell(CELL))

    np.testing.assert_array_equal(bounds.velocity, [j.velocity for robot in cell.robots for j in robot.model.joints])
    np.testing.assert_allclose(bounds.acceleration, bounds.velocity / np.tile([0.25, 0.2, 0.15], 2), rtol=1e-12)
    assert np.all(np.isinf(unlimited.acceleration))


def slides(velocity: float, acceleration: float, **checks: float) -> Scene:
    """Two slides with stated limits, and no limit of jerk."""
    robot = gantry("a")
    joints = tuple(replace(joint, velocity=velocity, acceleration=acceleration) for joint in robot.model.joints)
    robot = replace(robot, model=replace(robot.model, joints=joints))
    cell = make_cell(robot, checks=ChecksEntry(**checks))  # type: ignore[arg-type]
    return Scene.from_cell(replace(cell, motion=replace(cell.motion, step=SLOW, build_up=None)))


def bowed() -> JointPath:
    """A path of both slides that is bent, from rest to rest over 2 s of nominal time."""
    times = np.linspace(0.0, 2.0, 81)
    u = 0.5 * (1.0 - np.cos(0.5 * np.pi * times))
    return JointPath.through(times, np.stack([SPANS[0] * u, SPANS[1] * np.sin(0.5 * np.pi * u) ** 2], axis=1))


def seconds(scene: Scene) -> float:
    return SLOW * transfer_retimer(scene).fastest(bowed()).steps


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_the_duration_falls_with_the_velocities_and_with_the_root_of_the_accelerations(factor: float) -> None:
    by_velocity = [seconds(slides(0.4 * k, 1e3)) for k in (1.0, factor)]
    by_acceleration = [seconds(slides(1e3, 0.4 * k)) for k in (1.0, factor)]

    for (plain, other), power in ((by_velocity, 1.0), (by_acceleration, 0.5)):
        assert other == pytest.approx(plain / factor**power, abs=2.0 * SLOW, rel=2e-3)


@pytest.mark.parametrize(("velocity", "acceleration"), [(0.3, 1.0), (1.0, 0.4)])
def test_retimed_rows_lie_on_the_path_keep_all_limits_and_use_one_up_nearly_always(
    velocity: float, acceleration: float
) -> None:
    scene, path = slides(velocity, acceleration), bowed()
    sigma = transfer_retimer(scene).fastest(path).sigma

    q = path.at(sigma)

    u = q[:, 0] / SPANS[0]
    np.testing.assert_allclose(q[:, 1], SPANS[1] * np.sin(0.5 * np.pi * u) ** 2, atol=2e-5)  # of the spline through it
    assert np.all(np.diff(sigma) > 0.0)
    speeds = np.abs(np.diff(q, axis=0)) / SLOW / velocity
    rates = np.abs(np.diff(q, 2, axis=0)) / SLOW**2 / acceleration
    assert max(speeds.max(), rates.max()) <= 1.0 + 1e-6
    used = np.maximum(np.maximum(speeds[1:], speeds[:-1]), rates).max(axis=1)
    assert np.quantile(used, 0.1) > 0.9
    row = RowLimits(scene, (), joint_bounds(scene.cell), SLOW)
    needed = row.slower(sigma, q)
    assert needed == pytest.approx(max(speeds.max(), rates.max() ** 0.5), abs=5e-3)
    assert replace(row, step=0.4 * SLOW).slower(sigma, q) == pytest.approx(needed / 0.4, rel=0.02)


@pytest.mark.parametrize(("checks", "limit"), [({"tool_speed_mm_s": 100.0}, 0.1), ({}, np.inf)])
def test_a_limit_of_tools_in_the_world_binds_their_rows(checks: dict[str, float], limit: float) -> None:
    scene, path = slides(0.5, 2.0, **checks), bowed()
    motion = transfer_retimer(scene).fastest(path)

    tips = np.linalg.norm(np.diff(path.at(motion.sigma), axis=0), axis=1) / SLOW

    assert tips.max() <= min(limit, 0.5 * np.sqrt(2.0)) + 1e-9
    assert tips.max() == pytest.approx(min(limit, tips.max()), rel=0.02)
    row = RowLimits(scene, (), joint_bounds(scene.cell), SLOW)
    needed = [row.slower(sigma, path.at(sigma)) for sigma in (motion.sigma, motion.sigma[::2])]
    assert needed[0] <= 1.0 < needed[1]
