"""Least singular values of arms: as the checks have them, and by central differences, in cells of every kind."""

import numpy as np
import pytest
from builders.batch_cells import CELLS, configurations
from search.kernel.test_derivatives import displaced, one_node

from cellplan.checks.tools.conditioning import conditioning
from cellplan.geometry.arrays import Array
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.screws import Directions
from cellplan.search.kernel.singular_values import SingularValues, arms

STEP = 1e-6


@pytest.mark.parametrize("name", CELLS)
def test_derivatives_are_those_of_the_values(name: str) -> None:
    cell = CELLS[name]
    q, nq, robots = configurations(cell, 1, seed=2), cell.joint_count, len(cell.robots)
    job, rng = one_node(cell, q, seed=4), np.random.default_rng(5)
    layout, directions = Layouts.of([cell], q.T), Directions.none(job, 3)
    directions.base[:], directions.tool[:] = rng.normal(size=(2, robots, 6, 3))
    moved = rng.normal(size=(1, nq, 5))
    result = SingularValues.of(job, layout, q.T, lambda: directions)
    count = len(arms(job))
    assert_as_the_checks_have_them(job, q, result)

    by = result.derivatives(np.zeros(count, dtype=np.intp), np.arange(count), moved)

    sides = []
    for step in (STEP, -STEP):
        layouts = [layout, layout, *(displaced(layout, directions, step).of_places([at]) for at in range(3))]
        there = np.moveaxis(q.T[..., None] + step * moved, 2, 0)
        at_ends = [SingularValues.of(job, *both, lambda: directions) for both in zip(layouts, there, strict=True)]
        sides.append(np.array([one.values[0] for one in at_ends]).T)
    expected = (sides[0] - sides[1]) / (2.0 * STEP)
    np.testing.assert_allclose(by, expected, atol=1e-6 * max(1.0, np.abs(expected).max()))


def assert_as_the_checks_have_them(job: Job, q: Array, values: SingularValues) -> None:
    """The checks state 0 for a robot with fewer joints than its task has components."""
    cell = job.cell
    chains = {robot.name: ScrewChain(robot) for robot in cell.robots}
    positions = {robot.name: q.T[:, cell.columns(robot.name)] for robot in cell.robots}
    X_WP = np.eye(4)[None]
    if cell.carrier is not None:
        name = cell.robots[cell.carrier].name
        X_WP = chains[name].tool_poses(positions[name]) @ cell.part.X_CP
    still = {"V_PT_P": np.zeros((1, 6)), "travelled": np.zeros(1), "length": 1.0, "end": 1.0}
    X = np.moveaxis(job.X, (0, 1), (2, 3))
    tasks = tuple(TaskSchedule(task=task, X_PT=at, **still) for task, at in zip(cell.tasks, X, strict=False))
    schedule = Schedule(times=np.zeros(1), tasks=tasks)
    by_robot = conditioning(cell, schedule, chains, q=positions, X_WP=X_WP, moving=job.moving).robots
    for name, value, place in zip(values.names, values.values[0], arms(job), strict=True):
        if len(cell.robot(name).model.joints) >= job.constraints.constrained[place].sum():
            assert value == pytest.approx(by_robot[name][0], abs=1e-7)
