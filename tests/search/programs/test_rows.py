"""Rows of a small cell: derivatives of the measures themselves, and nothing dropped that a step could bind."""

from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.arrays import Array
from cellplan.planning.path.build import build_toolpath
from cellplan.planning.timing.schedule import schedule_tasks
from cellplan.scene.scene import Scene
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Job
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.measures import MeasureKind, Measures
from cellplan.search.programs.objective import CycleTiming, Demands, Effort, Objective, Reserve
from cellplan.search.programs.problem import Point
from cellplan.search.programs.rows import ConstraintRows, Linear, PacedRows
from cellplan.search.variables.variables import Variables

CELL = Path(__file__).resolve().parents[3] / "cells" / "planar_pair.yaml"
SETTINGS = {
    "robots.right.start_deg": [-20.5, 84.0, 8.0],
    "motion.duration_s": 2.0,
    "motion.time_law": "quintic",
    "layout": {"vary": {"right.base": {"x_mm": [1500, 2300], "y_mm": [0, 600], "yaw_deg": [150, 210]}}},
}
STEP = 1e-5  # [-] usual steps of the differences
ROUGH = 1e-3  # [-] of the largest slope: 48 nodes; of accelerations, which are differences between these, five times
EFFORT = Effort(within=0.4)  # so that most pairs have rows
TIMINGS = (CycleTiming.LAWS, CycleTiming.RETIMED)
CASES = (
    (Objective.CYCLE, CycleTiming.LAWS),
    (Objective.CLEARANCE, CycleTiming.LAWS),
    (Objective.CYCLE, CycleTiming.RETIMED),
    (Objective.CHANGE, CycleTiming.RETIMED),
)


@cache
def small() -> tuple[LayoutProblem, Point]:
    """The planar pair with its right base free, and a point of it off the given one."""
    variables = Variables.of(load_cell(CELL).with_values(SETTINGS))
    base = variables.base
    schedule = schedule_tasks(base, [build_toolpath(task, base.part) for task in base.tasks])
    problem = LayoutProblem(
        job=Job.of(base, schedule, moving=[robot.name for robot in base.robots], nodes=48),
        variables=variables,
        bodies=CellDistances.of(Scene.from_cell(base), variables),
        acceleration=np.append(6.0 * base.joint_limits.velocity[:5], np.inf),
    )
    start = np.concatenate([robot.start for robot in base.robots if robot.start is not None])
    x = problem.given + 0.3 * problem.scale * np.random.default_rng(2).uniform(-1.0, 1.0, len(problem.given))
    point = problem.evaluate(np.clip(x, problem.lower, problem.upper), start)
    assert point is not None
    return problem, point


def demands_of(objective: Objective, timing: CycleTiming) -> Demands:
    duration = None if objective is Objective.CYCLE else 1.2
    return Demands(
        objective=objective, timing=timing, margin=np.full(6, 0.3), duration=duration, singular=np.full(1, 0.3)
    )


@cache
def stood(objective: Objective, timing: CycleTiming) -> tuple[Measures, list[ConstraintRows]]:
    """Measures of the point, and its rows in a region in which every row may bind."""
    problem, point = small()
    demands = demands_of(objective, timing)
    measures = Measures.of(problem, point, demands, EFFORT)
    count = len(problem.names) + (0 if measures.pace is None else len(measures.pace.inner))
    return measures, Linear.of(problem, measures).rows(demands, EFFORT.reserve, np.full(count, 20.0))


@pytest.mark.parametrize(("objective", "timing"), CASES)
def test_gradients_are_the_differences_of_what_is_measured(objective: Objective, timing: CycleTiming) -> None:
    problem, point = small()
    here, rows = stood(objective, timing)
    demands = demands_of(objective, timing)
    n = len(problem.names)
    z = np.random.default_rng(4).uniform(-1.0, 1.0, rows[0].gradients.shape[1])
    sides = []
    for sign in (-STEP, STEP):
        there = problem.evaluate(point.x + sign * z[:n] * problem.scale, point.start, point)
        assert there is not None
        sides.append(Measures.of(problem, there, demands, EFFORT))

    assert {row.kind for row in rows} >= set(MeasureKind) - {MeasureKind.DURATION, MeasureKind.CYCLE}
    for row in rows:
        if row.kind not in {MeasureKind.DURATION, MeasureKind.CYCLE}:  # see below
            before, after = (row.bends(here, side, sign * z) for side, sign in zip(sides, (-STEP, STEP), strict=True))
            missed = np.abs(after - before) / (2.0 * STEP)  # of the central difference, beyond the row
            rough = 5.0 * ROUGH if row.kind is MeasureKind.ACCELERATION else ROUGH
            assert missed.max() <= rough * max(1.0, np.abs(row.gradients @ z).max()), row.kind


def test_the_row_of_the_duration_is_the_derivative_of_the_times_between_the_nodes() -> None:
    problem, _ = small()
    measures, rows = stood(Objective.CHANGE, CycleTiming.RETIMED)
    (row,) = [row for row in rows if row.kind is MeasureKind.DURATION]
    pace, n = measures.pace, len(problem.names)
    assert pace is not None
    z = np.random.default_rng(6).uniform(-1.0, 1.0, len(pace.inner))

    def seconds(step: float) -> float:
        squares = pace.squares.copy()
        squares[pace.inner] *= 1.0 + step * z
        ends = np.cumsum([0, *(len(stretch.nodes) for stretch in pace.stretches)])
        speeds = [np.sqrt(squares[a:b]) for a, b in pairwise(ends.tolist())]
        both = zip(pace.stretches, speeds, strict=True)
        return sum(float((2.0 * stretch.steps / (v[1:] + v[:-1])).sum()) for stretch, v in both)

    per_second = 1.0 / (float(problem.times[-1] - problem.times[0]) * row.units[0])
    assert seconds(0.0) == pytest.approx(pace.seconds, rel=1e-12)
    assert np.all(row.gradients[0, :n] == 0.0)
    assert row.gradients[0, n:] @ z == pytest.approx(
        (seconds(STEP) - seconds(-STEP)) / (2.0 * STEP) * per_second, rel=1e-6
    )


@pytest.mark.parametrize("timing", TIMINGS)
def test_violations_are_what_is_measured_beyond_the_demand_and_the_reserve(timing: CycleTiming) -> None:
    measures, rows = stood(Objective.CHANGE, timing)
    least = EFFORT.reserve
    bounds = {
        MeasureKind.LOWER_LIMIT: -least.margin,
        MeasureKind.UPPER_LIMIT: -least.margin,
        MeasureKind.SINGULAR: -least.singular,
        MeasureKind.DURATION: 1.2 / 2.0 / (1.0 + least.time),
        MeasureKind.SPEED: 1.2 / 2.0 / (1.0 + least.time),
        MeasureKind.ACCELERATION: 1.2 / 2.0 / (1.0 + least.time),
    }
    loads = [row.violations.max() for row in rows if isinstance(row, PacedRows)]
    assert max(loads, default=0.0) == pytest.approx(0.0, abs=1e-9)  # the profile uses a limit up, and exceeds none
    for row in (row for row in rows if not isinstance(row, PacedRows)):
        measured = measures.values(row.kind, row.subjects, row.nodes)
        bound = bounds.get(row.kind, -least.distance)
        if row.kind is MeasureKind.DISTANCE:
            is_within = measures.distances.within_robot[_places(measures, row)]
            bound = np.where(is_within, -least.within_robot, -least.distance)
        np.testing.assert_allclose(row.violations, (measured - bound) / row.units, atol=1e-9)


def _places(measures: Measures, row: ConstraintRows) -> Array:
    """Where the pairs and nodes of rows stand among all distances."""
    known = list(zip(measures.distances.pairs.tolist(), measures.distances.nodes.tolist(), strict=True))
    return np.array([known.index(key) for key in zip(row.subjects.tolist(), row.nodes.tolist(), strict=True)])


@pytest.mark.parametrize(("objective", "timing"), CASES)
def test_no_step_of_the_region_binds_a_row_that_was_left_out(objective: Objective, timing: CycleTiming) -> None:
    _, rows = stood(objective, timing)
    rng = np.random.default_rng(5)
    dropped = 0
    for row in rows:
        box = rng.uniform(0.0, 0.2, row.gradients.shape[1])
        inside = row.that_can_bind(box)
        is_left_out = ~np.isin(np.arange(len(row.units)), _numbers(row, inside))
        steps = box * rng.uniform(-1.0, 1.0, (200, len(box)))
        reached = row.violations + steps @ row.gradients.T
        if row.aim:
            assert np.all(reached[:, is_left_out] <= reached[:, ~is_left_out].max(axis=1)[:, None] + 1e-12)
        else:
            assert np.all(reached[:, is_left_out] <= 0.0)
            corners = inside.violations + np.abs(inside.gradients) @ box
            assert np.all(corners > 0.0)  # each of the others has a corner of the region that binds it
        dropped += int(is_left_out.sum())
    assert dropped > 0


def _numbers(rows: ConstraintRows, inside: ConstraintRows) -> Array:
    """Numbers of some rows among all of them: by their gradients, which differ."""
    known = {gradient.tobytes(): k for k, gradient in enumerate(rows.gradients)}
    return np.array([known[gradient.tobytes()] for gradient in inside.gradients], dtype=np.intp)


def test_a_larger_reserve_tightens_its_rows_by_as_much() -> None:
    problem, _ = small()
    measures, rows = stood(Objective.CHANGE, CycleTiming.LAWS)
    more = replace(EFFORT.reserve, margin=EFFORT.reserve.margin + 0.02, distance=EFFORT.reserve.distance + 0.003)

    tighter = Linear.of(problem, measures).rows(
        demands_of(Objective.CHANGE, CycleTiming.LAWS), more, np.full(len(problem.names), 20.0)
    )

    for row in rows:
        (other,) = [other for other in tighter if other.kind is row.kind]
        known = dict(
            zip(zip(other.subjects.tolist(), other.nodes.tolist(), strict=True), other.violations, strict=True)
        )
        rise = [known[key] for key in zip(row.subjects.tolist(), row.nodes.tolist(), strict=True)] - row.violations
        expected = {MeasureKind.DISTANCE: 1.0, MeasureKind.LOWER_LIMIT: 2.0, MeasureKind.UPPER_LIMIT: 2.0}
        assert rise.max() == pytest.approx(expected.get(row.kind, 0.0), abs=1e-9)
    assert Reserve().distance == EFFORT.reserve.distance
