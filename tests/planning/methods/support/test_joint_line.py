"""The cost along one joint: its closed form against the cost itself, its minimum against a fine grid."""

from dataclasses import replace

import numpy as np
import pytest
from builders.random_cells import make_task, random_cell
from builders.search_arms import FOUR_LINKS, arm_cell, dh_arm

from cellplan.geometry.transforms import pose_from, rotation_exp
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.planning.methods.support.joint_line import joint_lines
from cellplan.planning.methods.support.search_cost import SearchCost
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.planning.tracking.problem import TrackingProblem

GRID = np.linspace(-np.pi, np.pi, 2001)  # [rad]


def far_goals(cell, rng):
    """A goal for each task, far from everything."""
    tasks = []
    for task in cell.tasks:
        X = pose_from(rotation_exp(rng.normal(size=3)), rng.normal(size=3))
        X_PT = np.stack([X, X])
        tasks.append(
            TaskSchedule(task=task, X_PT=X_PT, V_PT_P=np.zeros((2, 6)), travelled=np.zeros(2), length=1.0, end=1.0)
        )
    return Schedule(times=np.array([0.0, 1.0]), tasks=tuple(tasks))


def cost_of(cell, seed):
    rng = np.random.default_rng(seed)
    problem = TrackingProblem(
        MotionTask(cell, far_goals(cell, rng), [robot.name for robot in cell.robots], np.zeros(cell.joint_count))
    )
    cost = SearchCost(problem)
    q = rng.uniform(-1, 1, cell.joint_count)
    cost.aim(1, q)
    return problem, cost, q


def with_tasks(cell, **changes):
    return replace(cell, tasks=tuple(make_task(task.robot, **changes) for task in cell.tasks))


CELLS = {
    "poses": random_cell(1, operators=2),
    "fixed part": random_cell(2, operators=1, held=False),
    "free spin": with_tasks(random_cell(3, operators=2), axes=(0, 1, 2), is_spin_free=True),
    "points": with_tasks(random_cell(4, operators=2), axes=(0, 1, 2)),
    "two axes": with_tasks(random_cell(5, operators=2), axes=(0, 1)),
    "one axis and turns": with_tasks(random_cell(6, operators=1), axes=(2, 3, 4, 5)),
    "planar": arm_cell(dh_arm(FOUR_LINKS), method="heuristic_search", axes=(0, 1)),
    "planar with turn": arm_cell(dh_arm(FOUR_LINKS), method="heuristic_search", axes=(0, 1, 5)),
}


@pytest.mark.parametrize("name", CELLS)
def test_closed_form_is_the_cost_itself_along_every_joint(name):
    _, cost, q = cost_of(CELLS[name], 11)
    expansion = cost.expand(q)
    lines = joint_lines(expansion)
    for i in range(len(q)):
        for theta in (-2.0, -0.3, 1e-3, 0.9, 3.0):
            along = q.copy()
            along[i] += theta
            expected = expansion.cost - cost.expand(along).cost
            gain = lines.gain(np.full(len(q), theta))[i]
            assert gain == pytest.approx(expected, abs=1e-12 * max(1.0, expansion.cost))  # rounding of sums of squares


@pytest.mark.parametrize("name", CELLS)
def test_best_move_is_the_lowest_point_of_a_fine_grid(name):
    _, cost, q = cost_of(CELLS[name], 12)
    expansion = cost.expand(q)
    lines = joint_lines(expansion)
    everywhere = np.full(len(q), np.inf)
    best = lines.best(-everywhere, everywhere)

    on_grid = np.array([lines.gain(np.full(len(q), theta)) for theta in GRID]).max(axis=0)

    assert np.all(lines.gain(best) >= on_grid - 1e-12)
    missed = 1e-4  # by a grid of 3 mrad
    assert np.all(lines.gain(best)[expansion.turns] <= on_grid[expansion.turns] + missed)


def test_error_of_the_cost_is_the_sum_of_squares_of_the_paper():
    r"""``e_p^T e_p + gamma tr(e_o^T e_o)`` (Eqs. 3.1-3.3) summed over the tasks, from the poses themselves."""
    cell = CELLS["poses"]
    problem, cost, q = cost_of(cell, 13)
    state = problem.state(q)
    X_PT = np.linalg.inv(state.X_WP) @ state.X_WT[problem.constraints.operators]
    gamma = cell.solver.search.orientation_weight_m2
    difference = problem.desired[1] - X_PT
    expected = np.sum(difference[:, :3, 3] ** 2) + gamma * np.sum(difference[:, :3, :3] ** 2)
    assert cost.expand(q).cost == pytest.approx(expected, rel=1e-12)


def test_bounds_stop_a_move_and_a_move_that_costs_more_is_none():
    _, cost, q = cost_of(CELLS["poses"], 14)
    lines = joint_lines(cost.expand(q))
    free = lines.best(np.full(len(q), -np.inf), np.full(len(q), np.inf))
    held = lines.best(np.full(len(q), -0.01), np.full(len(q), 0.01))
    np.testing.assert_array_equal(held, np.clip(free, -0.01, 0.01))
    assert np.all(lines.gain(held) >= 0.0)


def test_derivatives_also_hold_through_linkages():
    """Central differences of the errors; with followers on the way a joint's way is no circle, but has a tangent."""
    cell = random_cell(7, operators=2, joints=6, with_follower=True)
    _, cost, q = cost_of(cell, 15)
    expansion, h = cost.expand(q), 1e-6
    for i in range(len(q)):
        step = np.zeros(len(q))
        step[i] = h
        slope = -(cost.expand(q + step).e - cost.expand(q - step).e) / (2 * h)
        np.testing.assert_allclose(expansion.a[:, i], slope, atol=1e-8)  # differences of 1e-16 over 2e-6, and h^2
    assert not expansion.turns[cell.columns("op0").start + 1]
