"""The path problem: its motion is the one that is solved, its derivatives are those of differences, and it improves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cellplan.errors import InputError
from cellplan.files.cell.load import load_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_limits import acceleration_limits
from cellplan.model.motion.motion import Schedule
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.plan_motion import plan_motion
from cellplan.planning.timing.schedule import clock_paths, schedule_paths
from cellplan.planning.tracking.motion_task import MotionTask
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.programs.improve import improve
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.problem import Point
from cellplan.search.spline_path.nodes import PathNodes
from cellplan.search.spline_path.problem import PathProblem
from cellplan.search.spline_path.variables import PathVariables, first_path
from cellplan.search.variables.variables import Variables

FOUR = Path(__file__).resolve().parents[3] / "cells" / "four_robots.yaml"
COUNT, NODES = 10, 90
VARY = {"reis.path": {"coefficients": COUNT}, "kuka.base": {"x_mm": [500, 1800], "yaw_deg": [-180, 180]}}


def scheduled(cell: Cell) -> Schedule:
    return schedule_paths(cell, list(clock_paths(cell, [build_toolpath(t, cell.part) for t in cell.tasks]).values()))


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load_cell(FOUR).with_values({"layout": {"vary": VARY}})


@pytest.fixture(scope="module")
def problem(cell: Cell) -> PathProblem:
    variables = Variables.of(cell)
    base = variables.base
    start = np.concatenate([robot.start for robot in base.robots if robot.start is not None])
    scene, schedule = Scene.from_cell(base), scheduled(base)
    layout = variables.layouts(variables.given[None], start[None])
    path = first_path(base, schedule, layout, count=COUNT, degree=5)
    assert path is not None
    return PathProblem(
        nodes=PathNodes.of(base, schedule, count=COUNT, degree=5, nodes=NODES),
        path=PathVariables.of(base, "reis", path[0]),
        layout=variables,
        bodies=CellDistances.of(scene, variables),
        acceleration=acceleration_limits(scene.cell),
    )


@pytest.fixture(scope="module")
def point(cell: Cell, problem: PathProblem) -> Point:
    start = np.concatenate([robot.start for robot in cell.robots if robot.start is not None])
    point = problem.evaluate(problem.given, start)
    assert point is not None
    return point


def test_nodes_stand_on_knots_and_either_side(problem: PathProblem) -> None:
    times, end = problem.times, problem.times[-1]
    knots = problem.path.given.knots * end

    at_knots = np.abs(times[:, None] - knots).argmin(axis=0)
    near = np.abs(times[at_knots] - knots) < 0.02 * end
    assert near.all()
    assert np.sum(np.diff(times) == 0.0) >= len(knots)
    assert np.all(np.diff(times) >= 0.0)


def test_the_motion_is_the_one_that_the_written_cell_is_solved_to(
    cell: Cell, problem: PathProblem, point: Point
) -> None:
    written = cell.with_values(problem.values(point.x, point.start))
    start = np.concatenate([robot.start for robot in written.robots if robot.start is not None])

    motion = plan_motion(MotionTask(written, scheduled(written), [robot.name for robot in written.robots], start))

    assert motion.path is not None
    inside = np.append(np.diff(problem.times) > 0.0, True)  # at a break the piece before it counts
    inside &= np.insert(np.diff(problem.times) > 0.0, 0, True)
    times = problem.times[inside]
    np.testing.assert_allclose(motion.path.at(times), point.q[inside], rtol=0.0, atol=1e-5)
    for order, entry in ((1, point.qd), (2, point.qdd)):
        expected = motion.path.at(times, order)
        assert np.linalg.norm(entry[inside] - expected) < 2e-3 * np.linalg.norm(expected)


def test_derivatives_are_those_of_central_differences(problem: PathProblem, point: Point) -> None:
    slopes = problem.derivatives(point)
    count, rng, step = len(problem.path.names), np.random.default_rng(3), 1e-5
    whole = rng.normal(size=len(problem.names)) * problem.scale
    for left_out in (
        slice(0, 0),
        slice(count),
        slice(count, None),
    ):  # all of them; of the layout only; of the path only
        along = whole.copy()
        along[left_out] = 0.0
        ends = [problem.evaluate(point.x + side * step * along, point.start, point) for side in (1.0, -1.0)]
        assert ends[0] is not None
        assert ends[1] is not None
        for name in ("q", "qd", "qdd"):
            expected = (getattr(ends[0], name) - getattr(ends[1], name)) / (2.0 * step)
            error = np.linalg.norm(getattr(slopes, name) @ along - expected)
            assert error < 1e-6 * np.linalg.norm(expected), name


def test_singular_values_change_as_their_derivatives_say(problem: PathProblem, point: Point) -> None:
    result, step = problem.arms(point), 1e-5
    nodes, arms = (part.ravel().astype(np.intp) for part in np.mgrid[0 : len(problem.times) : 20, 0:2])
    gradients = result.derivatives(nodes, arms, problem.derivatives(point).q)
    along = np.random.default_rng(5).normal(size=len(problem.names)) * problem.scale

    ends = [problem.evaluate(point.x + side * step * along, point.start, point) for side in (1.0, -1.0)]
    values = [problem.arms(end).values[nodes, arms] for end in ends if end is not None]
    np.testing.assert_allclose(gradients @ along, (values[0] - values[1]) / (2.0 * step), rtol=1e-4, atol=1e-6)


def test_distances_change_as_their_derivatives_say(problem: PathProblem, point: Point) -> None:
    keys, step = np.arange(0, len(problem.times), 20), 1e-5
    near = problem.distances(point, keys, 0.03)
    gradients = problem.distance_derivatives(point, near, problem.derivatives(point))
    along = np.random.default_rng(4).normal(size=len(problem.names)) * problem.scale

    results = []
    for side in (1.0, -1.0):
        moved = problem.evaluate(point.x + side * step * along, point.start, point)
        assert moved is not None
        other = problem.distances(moved, keys, 0.04)
        places = zip(other.pairs.tolist(), other.nodes.tolist(), strict=True)
        results.append(dict(zip(places, other.values.tolist(), strict=True)))
    rows = list(zip(near.pairs.tolist(), near.nodes.tolist(), strict=True))
    expected = np.array([(results[0][row] - results[1][row]) / (2.0 * step) for row in rows])
    assert len(rows) > 10
    np.testing.assert_allclose(gradients @ along, expected, rtol=1e-3, atol=1e-4)


def test_a_few_programs_make_the_cycle_much_shorter_within_all_demands(problem: PathProblem, point: Point) -> None:
    demands = Demands(objective=Objective.CYCLE, margin=np.full(24, np.radians(10.0)))
    free = replace(problem, acceleration=np.full(24, np.inf))

    improved = improve(free, point.x, point.start, demands, Effort(iterations=8))

    assert improved is not None
    assert improved.is_conforming
    assert improved.cycle < 0.75 * 4.0 * np.abs(point.qd / problem.limits.velocity).max()


def test_a_task_that_leaves_the_spin_open_is_refused(cell: Cell) -> None:
    open_spin = cell.with_values({"tasks.circle.free": ["spin"]})

    with pytest.raises(
        InputError, match=r"robots\.kuka: expected a robot of six joints whose task 'circle' states all"
    ):
        PathNodes.of(open_spin, scheduled(open_spin), count=COUNT, degree=5, nodes=NODES)
