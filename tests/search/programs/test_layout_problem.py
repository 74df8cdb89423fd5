"""The layout problem of the cell that breaks its limits: rows by differences, and the way to a conforming layout."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Job
from cellplan.search.programs.improve import improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.measures import MeasureKind, Measures
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.programs.rows import Linear
from cellplan.search.variables.variables import Variables

CELL = Path(__file__).resolve().parents[3] / "cells" / "four_robots_initial.yaml"
STEP = 1e-4  # [-] usual steps of the differences


@pytest.fixture(scope="module")
def initial() -> SimpleNamespace:
    variables = Variables.of(load_cell(CELL))
    base = variables.base
    schedule = schedule_tasks(base, [build_toolpath(task, base.part) for task in base.tasks])
    job = Job.of(base, schedule, moving=[robot.name for robot in base.robots], nodes=64)
    limits = base.joint_limits
    problem = LayoutProblem(
        job=job,
        variables=variables,
        bodies=CellDistances.of(Scene.from_cell(base), variables),
        acceleration=4.0 * limits.velocity,
    )
    start = np.concatenate([robot.start for robot in base.robots if robot.start is not None])
    point = problem.evaluate(variables.given, start)
    return SimpleNamespace(problem=problem, start=start, point=point, schedule=schedule)


def test_rows_are_the_derivatives_of_what_is_measured(initial: SimpleNamespace) -> None:
    problem, point, effort = initial.problem, initial.point, Effort()
    demands = Demands(objective=Objective.CYCLE, margin=np.full(24, 0.2), singular=np.full(3, 0.2))
    here = Measures.of(problem, point, demands, effort)
    count = len(problem.names)
    rows = Linear.of(problem, here).rows(demands, effort.reserve, np.full(count, 0.5))
    assert {row.kind for row in rows} == set(MeasureKind) - {MeasureKind.DURATION, MeasureKind.CYCLE}
    z = np.random.default_rng(1).uniform(-1.0, 1.0, count)
    sides = []
    for sign in (1.0, -1.0):
        x = np.clip(point.x + sign * STEP * z * problem.scale, problem.lower, problem.upper)
        there = problem.evaluate(x, point.start, point)
        sides.append(Measures.of(problem, there, demands, effort))
    z = (sides[0].point.x - sides[1].point.x) / (2.0 * STEP * problem.scale)
    for row in rows:
        before, after = (side.values(row.kind, row.subjects, row.nodes) for side in reversed(sides))
        seen = (after - before) / (2.0 * STEP * row.units)
        is_smooth = ~np.isnan(seen) & (
            (row.violations < 10.0) | (row.kind is not MeasureKind.DISTANCE)
        )  # none deep inside
        errors = np.abs(seen - row.gradients @ z)[is_smooth]
        assert len(errors) >= 4
        assert np.quantile(errors, 0.9) <= 0.02 * np.abs(seen[is_smooth]).max()


def test_the_failing_layout_conforms_after_few_programs(initial: SimpleNamespace) -> None:
    problem = initial.problem
    demands = Demands(objective=Objective.CONFORMING, margin=np.zeros(24), duration=4.0)
    assert not _keeps(initial, initial.point, demands)
    improvement = improve(problem, problem.given, initial.start, demands)
    assert improvement is not None
    assert improvement.is_conforming
    assert len(improvement.history) <= 6
    again = problem.evaluate(improvement.x, improvement.start)  # node after node, not from the last nominal motion
    assert _keeps(initial, again, demands)
    np.testing.assert_allclose(again.q, improvement.point.q, atol=np.radians(0.1))


def _keeps(initial: SimpleNamespace, point: object, demands: Demands) -> bool:
    measures = Measures.of(initial.problem, point, demands, Effort())
    limits, q = initial.problem.limits, measures.point.q
    return bool(
        (q > limits.lower).all()
        and (q < limits.upper).all()
        and measures.violations.max() < 0.0
        and measures.cycle < 4.0
    )


def test_more_nodes_about_some_times_give_the_same_motion(initial: SimpleNamespace) -> None:
    finer = initial.problem.finer(initial.schedule, nodes=112, denser=(1.0, 2.5))
    near = np.diff(finer.times)[np.searchsorted(finer.times, [1.0, 2.5]) - 1]
    assert near.max() < 0.4 * np.diff(finer.times).max()
    point = finer.evaluate(finer.given, initial.start)
    assert point is not None
    inside = np.interp(1.0, finer.times, point.q[:, 1])
    assert inside == pytest.approx(np.interp(1.0, initial.problem.times, initial.point.q[:, 1]), abs=2e-3)
