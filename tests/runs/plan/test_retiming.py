"""Retiming: how the demands on rows scale with time, and that the shortest times are the limits of the checks."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan import Solution, load_cell, solve
from cellplan.runs.plan.retiming import RowLimits, joint_bounds, joint_path, row_limits
from cellplan.scene.scene import Scene

CELL = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
FASTEST = {
    "motion.timing": "fastest",
    "motion.step_s": 0.004,
    "acceleration": {"full_speed_in_s": [0.25, 0.2, 0.15]},
    "tasks.circle.tolerance.between_rows_mm": 10,  # so that joints bind, not the errors between rows
    "tasks.circle.tolerance.between_rows_deg": 10,
}


@pytest.fixture(scope="module")
def fastest() -> Solution:
    return solve(load_cell(CELL).with_values(FASTEST))


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
