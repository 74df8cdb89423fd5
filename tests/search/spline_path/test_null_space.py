"""The null-space problem: its motion is the one that is solved, its derivatives, two rails in closed form."""

from pathlib import Path

import numpy as np
import pytest

from cellplan import LayoutRequest, Stop, load_cell, search_layout, solve
from cellplan.geometry.arrays import Array
from cellplan.jobs.layout.trials.prepared import PreparedSearch, prepared
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.search.programs.improve import improve
from cellplan.search.programs.objective import Effort
from cellplan.search.programs.problem import Point
from cellplan.search.spline_path.spline_problem import SplineProblem

FOUR = Path(__file__).resolve().parents[3] / "cells" / "four_robots.yaml"
FREED = ("motion.step_s=0.004", "solver.gain_per_s=200", "tasks.circle.free=[spin]")
RAIL = """\
robot: rail
source: closed form
joints:
  X: {type: prismatic, axis: [1, 0, 0], point_mm: [0, 0, 0], lower_mm: -2000, upper_mm: 2000, velocity_mm_s: VELOCITY}
flange: {xyz_mm: [0, 0, 0], rpy_deg: [0, 0, 0]}
"""
RAILS = """\
cellplan: 1
name: rails
robots:
  slow: {model: slow.yaml, start: {X_mm: 0}}
  quick: {model: quick.yaml, base: {xyz_mm: [0, 0, 500], rpy_deg: [0, 180, 0]}, start: {X_mm: 0}}
part:
  geometry: {box: {size_mm: [10, 10, 10]}}
  held_by: [{robot: slow}]
tasks:
  line: {robot: quick, path: {polyline: {points_mm: [[0, 0, 500], [1000, 0, 500]]}}, tool_axis: -z, axes: [x]}
motion: {duration_s: 10, step_s: 0.02, time_law: {trapezoid: {ramp: 0.25}}}
acceleration: unlimited
"""


def rails(folder: Path) -> Path:
    for name, velocity in (("slow", "100"), ("quick", "300")):
        (folder / f"{name}.yaml").write_text(RAIL.replace("VELOCITY", velocity), encoding="utf-8")
    file = folder / "rails.yaml"
    file.write_text(RAILS, encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def ready() -> PreparedSearch:
    vary = ("null_space={coefficients: 8}", "reis.start_deg", "reis.weights", "kuka.weights")
    return prepared(LayoutRequest(cell=FOUR, settings=FREED, vary=vary, margin=5.0))


@pytest.fixture(scope="module")
def problem(ready: PreparedSearch) -> SplineProblem:
    assert isinstance(ready.coarse, SplineProblem)
    return ready.coarse


@pytest.fixture(scope="module")
def point(ready: PreparedSearch, problem: SplineProblem) -> Point:
    """A point with other weights than the cell has, and with motion in the null space."""
    away = 0.2 * problem.scale * np.random.default_rng(1).normal(size=len(problem.names))
    point = problem.evaluate(np.clip(problem.given + away, problem.lower, problem.upper), ready.given_start)
    assert point is not None
    return point


def test_derivatives_are_those_of_central_differences(problem: SplineProblem, point: Point) -> None:
    slopes, step = problem.derivatives(point), 1e-5
    along = np.random.default_rng(3).normal(size=len(problem.names)) * problem.scale
    ends = [problem.evaluate(point.x + side * step * along, point.start) for side in (1.0, -1.0)]

    for name in ("q", "qd"):
        ahead, behind = (getattr(end, name) for end in ends if end is not None)
        expected = (ahead - behind) / (2.0 * step)
        error = np.linalg.norm(getattr(slopes, name) @ along - expected)
        assert error < 0.005 * np.linalg.norm(expected), name  # as those of runs without it


def test_the_motion_is_the_one_that_the_written_cell_is_solved_to(
    ready: PreparedSearch, problem: SplineProblem, point: Point
) -> None:
    cell = ready.cell.with_values(problem.values(point.x, point.start))
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])

    motion = plan_motion(MotionTask(cell, ready.schedule, [robot.name for robot in cell.robots], start))

    assert motion.path is not None
    np.testing.assert_allclose(motion.path.at(problem.times), point.q, rtol=0.0, atol=2e-3)  # nodes 0.06 s apart
    assert np.abs(point.q - joints_without(ready, problem, point)).max() > 0.03


def joints_without(ready: PreparedSearch, problem: SplineProblem, point: Point) -> Array:
    """The joints of the same layout without motion in the null space."""
    x = point.x.copy()
    x[: len(problem.path.names)] = 0.0
    without = problem.evaluate(x, ready.given_start)
    assert without is not None
    return without.q


def test_two_rails_share_a_feed_as_their_top_speeds_do(tmp_path: Path) -> None:
    """The pseudo-inverse halves the feed: 200 mm/s at best. Shared as 100 to 300 it is 400 mm/s."""
    ready = prepared(LayoutRequest(cell=rails(tmp_path), free=("path",)))
    problem = ready.coarse
    begin = improve(problem, problem.given, ready.given_start, ready.demands(), Effort(iterations=0))

    best = improve(problem, problem.given, ready.given_start, ready.demands(), Effort())

    feed = 1000.0 / 7.5 * 10.0  # the plateau of the trapezoid in 1 s
    assert begin is not None
    assert best is not None
    assert feed / begin.cycle == pytest.approx(200.0, rel=0.01)  # parabolas through three nodes pass corners by 0.8 %
    assert 394.0 < feed / best.cycle <= 400.0 * (1.0 + 1e-6)  # likewise, and the reserve of a program of 0.2 %


def test_what_the_cell_states_is_solved_and_written(tmp_path: Path) -> None:
    cell = load_cell(rails(tmp_path)).with_values(
        {"robots.slow.null_space": {"coefficients": [{"X_mm": 0}, {"X_mm": 0}, {"X_mm": 60}, {"X_mm": 60}]}}
    )

    solution = solve(cell)

    assert solution.passed
    q = 1e3 * solution.motion.q
    np.testing.assert_allclose(q[-1], [-500.0 + 30.0, -500.0 - 30.0], atol=1e-6)  # half of what is asked moves no tool


@pytest.mark.slow
def test_a_motion_that_was_searched_passes_and_is_searched_further(tmp_path: Path) -> None:
    tolerance = "tasks.circle.tolerance={position_mm: 2, orientation_deg: 2}"
    settings = (tolerance, "motion.duration_s=2", "motion.step_s=0.02")
    request = LayoutRequest(cell=FOUR.parent / "planar_pair.yaml", settings=settings, free=("path",))

    record = search_layout(request, tmp_path / "study", stop=Stop(trials=1)).record

    best = tmp_path / "study" / "best.yaml"
    solution, again = solve(load_cell(best)), prepared(LayoutRequest(cell=best, free=("path",)))
    point = again.coarse.evaluate(again.coarse.given, again.given_start)
    assert record["status"] == "certified"
    assert record["best"] is not None
    assert record["given"]["cycle_s"] is not None
    assert record["best"]["cycle_s"] < record["given"]["cycle_s"]
    assert solution.passed
    assert point is not None
    np.testing.assert_allclose(point.q[-1], solution.motion.q[-1], atol=1e-3)
