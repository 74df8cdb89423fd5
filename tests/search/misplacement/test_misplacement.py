"""Displaced bases of two planar arms: derivatives by differences, and corners as the product solves them."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.jobs.layout.request import LayoutRequest
from cellplan.jobs.layout.trials.prepared import PreparedSearch, values_of
from cellplan.jobs.layout.trials.searched import searched_cell
from cellplan.model.cell.cell import Cell
from cellplan.model.settings.layout import MisplacementEntry
from cellplan.search.misplacement.corners import judged, tolerances
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import guarded
from cellplan.search.misplacement.robust import RobustSearch, ScenarioProblem, robust_layout, seeded_signs, worst
from cellplan.search.programs.measures import Measures
from cellplan.search.programs.objective import Demands, Effort, Objective

CELLS = Path(__file__).resolve().parents[3] / "cells"
SETTINGS = ("motion.duration_s=2", "motion.step_s=0.02", "checks.clearance_mm=10")
AMOUNTS = MisplacementEntry(position_mm=2.0, orientation_deg=0.2)


def displaced_cell(cell: Path, settings: tuple[str, ...] = ()) -> SimpleNamespace:
    request = LayoutRequest(cell=cell, settings=settings)
    ready = PreparedSearch.of(request, searched_cell(request))
    of = BaseDisplacements.of(ready.variables, ready.variables.given, AMOUNTS)
    problem = guarded(ready.problem(33)).of_variables(of)
    point = problem.evaluate(of.given, ready.given_start)
    assert point is not None
    demands = Demands(objective=Objective.CYCLE, margin=np.zeros(len(point.start)))
    return SimpleNamespace(of=of, problem=problem, point=point, demands=demands, ready=ready)


def displaced(case: SimpleNamespace, d: np.ndarray, start: np.ndarray) -> Cell:
    return case.of.cell(d, values_of(case.ready, case.of.x, start))


@pytest.fixture(scope="module")
def pair() -> SimpleNamespace:
    return displaced_cell(CELLS / "planar_pair.yaml", SETTINGS)


def test_all_bases_are_displaced_along_the_axes_of_the_world(pair: SimpleNamespace) -> None:
    given, d = pair.ready.variables.base, np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, -1.0]) * pair.of.amounts

    cell = displaced(pair, d, pair.point.start)
    placed = pair.of.placed(d)

    for robot, sign in zip(given.robots, (1.0, -1.0), strict=True):
        name = robot.name
        by = cell.robot(name).X_WB[:3, 3] - robot.X_WB[:3, 3]
        np.testing.assert_allclose(by, sign * np.array([0.002, -0.002, 0.002]), atol=1e-9)
        turn = np.radians(0.2) * sign
        Z = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        np.testing.assert_allclose(cell.robot(name).X_WB[:3, :3], Z @ robot.X_WB[:3, :3], atol=1e-8)
        np.testing.assert_allclose(placed.robot(name).X_WB, cell.robot(name).X_WB, atol=1e-8)


def test_a_base_on_the_floor_is_not_lowered() -> None:
    cell = load_cell(CELLS / "planar_pair.yaml").with_values({"environment.floor": {"plane": {"z_mm": 500}}})
    variables = SimpleNamespace(base=cell, placed=lambda _: cell)

    result = BaseDisplacements.of(variables, np.zeros(0), AMOUNTS)  # type: ignore[arg-type] # all that it asks for

    assert [name for name in result.names if name.endswith("z_mm")] == []
    assert len(result.names) == 6


def test_displacements_take_the_sum_of_absolute_differences(pair: SimpleNamespace) -> None:
    problem, point, step = pair.problem, pair.point, 1e-3
    result = worst(problem, point, pair.demands, Effort(keys=5))

    q, qd = np.zeros_like(point.q), np.zeros_like(point.q)
    for unit in np.diag(problem.upper):
        forward, back = (problem.evaluate(side * step * unit, point.start) for side in (1.0, -1.0))
        q += np.abs(forward.q - back.q) / (2.0 * step)
        qd += np.abs(forward.qd - back.qd) / (2.0 * step)
    np.testing.assert_allclose(result.margins, q, atol=2e-3 * q.max())
    np.testing.assert_allclose(result.speeds, qd / problem.limits.velocity, atol=5e-3 * result.speeds.max())


def scenarios_of(pair: SimpleNamespace) -> ScenarioProblem:
    signs = np.where(np.arange(16).reshape(2, 8) % 3, 1.0, -1.0)
    d = np.concatenate([np.zeros((1, 8)), signs * pair.of.amounts])
    return ScenarioProblem.of(pair.ready.problem(33), pair.of, d)


def test_scenarios_are_the_motions_of_displaced_layouts(pair: SimpleNamespace) -> None:
    problem = scenarios_of(pair)
    point = problem.evaluate(pair.of.x, pair.point.start)
    corners = judged(pair.problem, problem.d, pair.point.start, pair.demands, Effort(keys=5))

    result = Measures.of(problem, point, pair.demands, Effort(keys=5))

    assert result.cycle == pytest.approx(max(corner.cycle for corner in corners), rel=1e-9)
    beyond = np.maximum(result.lower.value.max(axis=0), result.upper.value.max(axis=0))
    np.testing.assert_allclose(-beyond, np.min([corner.margins for corner in corners], axis=0), atol=1e-9)
    again = problem.evaluate(pair.of.x, pair.point.start, point)
    for d, near, q in zip(problem.d, np.split(point.q, 3), np.split(again.q, 3), strict=True):
        alone = pair.problem.evaluate(d, near[0], replace(point, q=near))
        np.testing.assert_allclose(q, alone.q, atol=1e-9)


def test_scenarios_have_the_derivatives_of_their_differences(pair: SimpleNamespace) -> None:
    problem, step = scenarios_of(pair), 1e-4
    x = pair.of.x
    by = problem.derivatives(problem.evaluate(x, pair.point.start))
    assert by.q.shape == (len(problem.times), 6, len(x))

    unit = problem.scale * np.where(np.arange(len(x)) % 2, 1.0, -0.5)
    forward, back = (problem.evaluate(x + side * step * unit, pair.point.start) for side in (1.0, -1.0))

    for derivatives, sides in ((by.q, (forward.q, back.q)), (by.qd, (forward.qd, back.qd))):
        differences = (sides[0] - sides[1]) / (2.0 * step)
        np.testing.assert_allclose(derivatives @ unit, differences, atol=5e-3 * np.abs(differences).max())


@pytest.mark.slow
def test_a_robust_layout_keeps_its_demands_in_all_corners(pair: SimpleNamespace) -> None:
    search = RobustSearch(
        problem=guarded(pair.ready.problem(33)),
        displacements=pair.of,
        demands=pair.demands,
        effort=Effort(iterations=3, keys=5),
    )
    begin = pair.of.x, pair.point.start
    signs = seeded_signs(np.random.default_rng(1), 8)[:6]
    before = Measures.of(scenarios_of(pair), scenarios_of(pair).evaluate(*begin), pair.demands, Effort(keys=5))

    robust = robust_layout(search, begin, signs=signs, rounds=2)

    assert robust is not None
    assert robust.is_met
    assert len(robust.corners) == robust.worst_ones + robust.ends + len(signs)
    assert robust.nominal <= robust.cycle < before.cycle
    finer = search.finer(guarded(pair.ready.problem(49)), robust, Effort(iterations=1, keys=5))
    assert finer.once(robust.improved.x, robust.improved.start) is not None


def test_a_corner_moves_as_the_product_solves_it(pair: SimpleNamespace) -> None:
    d = np.where(np.arange(8) % 3 == 0, -1.0, 1.0) * pair.of.amounts
    corner = judged(pair.problem, d[None], pair.point.start, pair.demands, Effort(keys=9))[0]

    solution = solve(displaced(pair, d, corner.start))

    limits = pair.problem.limits
    q = solution.motion.q
    margins = np.minimum(q - limits.lower, limits.upper - q).min(axis=0)
    np.testing.assert_allclose(corner.margins, margins, atol=2e-3)
    ratio = max(use.peak_velocity / use.velocity_limit for run in solution.runs for use in run.report.joints)
    assert corner.cycle == pytest.approx(2.0 * ratio, rel=0.01)


@pytest.mark.slow
def test_tolerances_are_where_a_demand_is_missed(pair: SimpleNamespace) -> None:
    effort = Effort(keys=5, within=0.003)
    nominal = Measures.of(pair.problem, pair.point, pair.demands, effort)
    cycle = 1.002 * nominal.cycle

    limits = tolerances(pair.problem, pair.point.start, pair.demands, effort, cycle)

    limited = [entry for entry in limits if entry.first]
    assert limited
    for entry in limited[:3]:
        unit = np.array([entry.sign if name == entry.name else 0.0 for name in pair.problem.names])
        inside, outside = judged(
            pair.problem,
            np.array([entry.extent * unit, entry.missed * unit]),
            pair.point.start,
            pair.demands,
            effort,
        )
        assert inside.keeps(cycle)
        assert not outside.keeps(cycle)


def test_singular_values_of_arms_and_their_derivatives() -> None:
    six = displaced_cell(CELLS / "find_a_layout.yaml", ("robots.abb.base.x_mm=2400",))
    problem, point = six.problem, six.point
    nodes = np.array([0, 11], dtype=np.intp)
    result = problem.distances(point, nodes, 0.01)
    is_arm = result.pairs >= len(problem.bodies.pairs)
    by = problem.distance_derivatives(point, result, problem.derivatives(point))[is_arm]

    assert [problem.pair_names(int(pair))[0] for pair in result.pairs[is_arm][:3]] == ["kuka", "abb", "staubli"]
    model = six.ready.variables.base.robot("kuka").model
    assert len(model.joints) == 6
    unit = problem.upper * np.where(np.arange(len(problem.upper)) % 2, 1.0, -1.0)
    sides = [problem.distances(problem.evaluate(s * unit, point.start, point), nodes, 0.01) for s in (1e-3, -1e-3)]
    values = [side.values[side.pairs >= len(problem.bodies.pairs)] for side in sides]
    np.testing.assert_allclose(by @ unit, (values[0] - values[1]) / 2e-3, atol=1e-5)
