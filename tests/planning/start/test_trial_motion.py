"""Start postures tried on a coarse clock against the full motion of the reference cell."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import pose
from cellplan.model.cell.cell import Obstacle
from cellplan.model.cell.name_order import NameOrder
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.start.near_ties import best_first
from cellplan.planning.start.trial_motion import StartTrials
from cellplan.planning.timing.schedule import clock_paths
from cellplan.runs.overrides import with_overrides
from cellplan.scene.scene import Scene

pytestmark = pytest.mark.usefixtures("stored_solutions")


@pytest.fixture(scope="module")
def cell(cells):
    return load_cell(cells / "four_robots.yaml")


def trials_of(cell):
    toolpaths = {task.name: build_toolpath(task, cell.part) for task in cell.tasks}
    return StartTrials(Scene.from_cell(cell), clock_paths(cell, toolpaths.values()))


def start_of(cell):
    """In the order of names, as trials have it."""
    return np.concatenate([robot.start for robot in sorted(cell.robots, key=lambda robot: robot.name)])


def share_left_free(report, robots):
    """Smallest share of half a joint range or of a joint speed that the full motion leaves free."""
    used = [use for use in report.joints if use.robot in robots]
    ranges = min(use.margin / (0.5 * (use.upper - use.lower)) for use in used)
    return min(ranges, *(1 - use.peak_velocity / use.velocity_limit for use in used))


def test_the_coarse_clock_forestates_what_the_full_motion_leaves_free(cell):
    trial = trials_of(cell).judge(start_of(cell))

    np.testing.assert_array_equal(trial.start, start_of(cell))  # given configurations stay on their turn
    expected = share_left_free(solve(cell).runs[0].report, {robot.name for robot in cell.robots})
    assert trial.shares[0] == pytest.approx(expected, abs=0.02)  # 160 samples against 4001
    assert trial.is_sound

    closely = trials_of(cell).looked_at_closely([trial, trial])[0]

    assert closely.shares[0] == pytest.approx(expected, abs=1e-3)


@pytest.mark.slow
def test_an_operator_judged_alone_is_judged_as_in_a_run_of_its_own(cell):
    task = cell.task("rectangle")
    holder = cell.robot("reis").start

    quality = trials_of(cell).judge_alone(task, cell.robot("staubli").start, holder)[0]

    run = solve(with_overrides(cell, mode="pairwise"), task="rectangle").runs[0]
    assert quality == pytest.approx(share_left_free(run.report, {"reis", "staubli"}), abs=0.02)


def test_a_collision_on_the_way_costs_more_than_any_limit(cell):
    """A block where the part swings to, clear of everything at the start; one start is open, so its pairs count."""
    reach = solve(cell).runs[0].report.q["kuka"]
    moved = Scene.from_cell(cell).chains["kuka"].axis_points(reach)[:, 2]
    farthest = moved[np.argmax(np.linalg.norm(moved - moved[0], axis=1))]
    outward = (farthest - moved[0]) / np.linalg.norm(farthest - moved[0])
    block = Obstacle(name="block", shape=Box((0.02, 0.02, 0.02)), X_WS=pose(farthest + 0.12 * outward))
    blocked = replace(
        cell,
        obstacles=(*cell.obstacles, block),
        robots=tuple(replace(r, start=None) if r.name == "kuka" else r for r in cell.robots),
    )
    assert Scene.from_cell(blocked).touching(np.concatenate([robot.start for robot in cell.robots])) is None

    free = trials_of(cell).judge(start_of(cell))
    colliding = trials_of(blocked).judge(start_of(cell))

    assert free.is_sound
    assert not colliding.is_sound
    np.testing.assert_array_equal(free.shares, colliding.shares)
    assert best_first(np.array([colliding.figures, free.figures])) == [1, 0]


def test_a_lost_path_is_worth_nothing(cell):
    start = start_of(cell)
    start[NameOrder.of(cell).cell.columns("kuka")] += 2.0
    trial = trials_of(cell).judge(start)
    assert not trial.is_followed
    assert not trial.is_sound
