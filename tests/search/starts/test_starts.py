"""Starts of a search: repeatable, spread, judged as the cell is, and with a reason where there is none."""

import re

import numpy as np
import pytest

from cellplan import load_cell, solve
from cellplan.model.seeds import generator
from cellplan.search.programs.improve import improve
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.objective import Demands, Effort, Objective
from cellplan.search.starts import generator as pools
from cellplan.search.starts.combined import judged
from cellplan.search.starts.effort import StartEffort
from cellplan.search.starts.generator import StartGenerator, StartOrigin
from cellplan.search.starts.problem import Contacts, StartProblem
from cellplan.search.variables.variables import Variables
from tests.search.starts.conftest import CELLS, DRAWS, prepared

SHORT = {
    "motion.duration_s": 2,
    "motion.step_s": 0.02,
    "tasks.circle.tolerance": {"position_mm": 0.5, "orientation_deg": 0.1},
}
ARM = {"model": "planar_3r", "start_deg": "auto", "tool": {"xyz_mm": [0, 0, 40]}}
SMALL = {"robot": "right", "tool_x": "-x", "axes": ["x", "y", "rz"]}
VARY = {"x_mm": [500, 2500], "yaw_deg": [-180, 180]}
MIRRORED = {
    "robots.right": {**ARM, "base": {"xyz_mm": [1900, 5000, 500]}},
    "robots.other": {**ARM, "base": {"xyz_mm": [1900, -5000, 500]}},
    "tasks.circle": SMALL
    | {"path": {"circle": {"radius_mm": 30, "center_mm": [40, 100], "plane": "xy"}, "project": "+z"}},
    "tasks.ring": SMALL
    | {
        "robot": "other",
        "path": {"circle": {"radius_mm": 30, "center_mm": [40, -100], "plane": "xy"}, "project": "+z"},
    },
    "layout": {
        "vary": {"right.base": VARY | {"y_mm": [200, 5000]}, "other.base": VARY | {"y_mm": [-5000, -200]}},
        "mirrored": [{"bases": ["right.base", "other.base"], "plane": "xz"}],
    },
}
AT_REST = {
    "part.held_by": [],
    "part.at": {"xyz_mm": [9000, 0, 435], "rpy_deg": [0, 0, 0]},
    "layout": {"vary": {"part.at": {"x_mm": [0, 9000], "y_mm": [-500, 1000], "yaw_deg": [-180, 180]}}},
}


@pytest.fixture
def sampled(turntable):
    return StartGenerator(turntable, seed=3).at(1)


def test_a_sampled_start_without_violation_passes_solve_and_is_the_same_again(turntable, sampled):
    again, other = (StartGenerator(turntable, seed=seed).at(1) for seed in (3, 4))
    best = sampled.starts[0]

    assert best.origin is StartOrigin.SAMPLED
    assert best.violation == 0.0
    assert solve(turntable.variables.cell(best.x, best.start)).passed
    assert [start.x.tobytes() for start in again] == [start.x.tobytes() for start in sampled]
    assert [start.start.tobytes() for start in again] == [start.start.tobytes() for start in sampled]
    assert other.starts[0].x.tobytes() != best.x.tobytes()


def test_the_given_layout_is_the_first_start(turntable):
    (given,) = StartGenerator(turntable, seed=0).at(0)

    assert given.origin is StartOrigin.GIVEN
    assert given.violation == 0.0
    np.testing.assert_allclose(given.x, turntable.variables.given, atol=1e-9)


def test_a_layout_beyond_its_limits_has_a_violation_and_is_a_start_all_the_same(four_robots):
    (given,) = StartGenerator(four_robots, seed=0).at(0)

    assert given.violation > 0.0


def test_a_layout_of_another_file_is_a_start(four_robots):
    other = load_cell(CELLS / "four_robots.yaml")
    x = four_robots.variables.read_from(other)
    start = np.concatenate([robot.start for robot in other.robots])
    (tried,) = StartGenerator(four_robots, seed=0, tries=[("four_robots.yaml", x, start)]).at(1)

    assert tried.origin is StartOrigin.TRY
    assert tried.text == "layout of four_robots.yaml"


def test_what_reaches_nothing_is_named_with_the_reason():
    cell = load_cell(CELLS / "turntable.yaml")
    (operator, *_) = [robot.name for robot in cell.robots if robot.name not in cell.positioners]
    away = {f"robots.{operator}.base.x_mm": 9000.0, "layout": {"vary": {f"{operator}.base": {"x_mm": [8900, 9100]}}}}
    problem = prepared(cell.with_values(away))
    result = StartGenerator(problem, seed=0).at(1)

    assert result.starts == ()
    reason, far = f"'{operator}' follows its path from none of {DRAWS} bases: ", "does not reach the start of its path"
    assert re.fullmatch(re.escape(reason + far) + rf", stays more than [6-8]\d00 mm away \({DRAWS}\)", result.reason)


def test_mirrored_operators_are_sampled_together(monkeypatch):
    monkeypatch.setattr(pools, "EFFORT", StartEffort(leading=3))
    cell = load_cell(CELLS / "planar_pair.yaml").with_values(SHORT | MIRRORED)
    problem = prepared(cell)
    assert problem.freedom.groups(problem.operators) == [(1, 2)]
    result = StartGenerator(problem, seed=0).at(1).starts[0]

    assert result.violation == 0.0
    first, second = (problem.variables.placed(result.x).robot(name).X_WB for name in ("right", "other"))
    np.testing.assert_allclose(second[:3, 3] * [1.0, -1.0, 1.0], first[:3, 3], atol=1e-12)


def test_a_part_at_rest_is_sampled_where_it_can_be_reached():
    cell = load_cell(CELLS / "planar_pair.yaml").with_values(SHORT | AT_REST)
    problem = prepared(cell)
    result = StartGenerator(problem, seed=0).at(1).starts[0]

    assert result.violation == 0.0
    assert solve(problem.variables.cell(result.x, result.start)).passed


def test_first_distances_are_those_of_the_moved_scene(four_robots):
    problem, rng = four_robots, generator("contacts")
    names = [robot.name for robot in problem.cell.robots]
    contacts, scene = Contacts(problem.scene, names), problem.scene
    for _ in range(3):
        X_WB = np.array([robot.X_WB for robot in problem.cell.robots])
        X_WB[1:, :2, 3] += rng.uniform(-0.2, 0.2, (len(names) - 1, 2))
        result = contacts.shortfalls(X_WB[None], problem.start[None])
        near = scene.moved(dict(zip(names, X_WB, strict=True))).near(problem.start[None], 0.01)
        short = [
            scene.pairs[row].demand - distance
            for row, distance in zip(near.rows, near.distances, strict=True)
            if scene.pairs[row].rule == "clearance"
        ]
        assert max(0.0, result.worst[0]) == pytest.approx(max([0.0, *short]), abs=1e-6)


def test_candidates_that_lose_their_path_are_dropped(four_robots):
    start = np.tile(four_robots.start, (2, 1))
    x = np.tile(four_robots.variables.given, (2, 1))
    x[1, four_robots.variables.names.index("robots.kuka.base.x_mm")] += 10.0
    judgement = judged(four_robots, x, start)

    assert len(judgement.x) == 1
    assert judgement.drops["loses a path"] == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["real_arms_corners", "real_arms_tight"])
def test_real_arms_find_a_layout_from_the_corners_of_the_floor(name, shared_robots, tmp_path):
    file = tmp_path / "cell.yaml"
    text = (CELLS.parent / "benchmarks" / "cells" / f"{name}.yaml").read_text()
    file.write_text(text.replace("{robots}", str(shared_robots)))
    variables = Variables.of(load_cell(file, allow_dirs=[shared_robots]))
    problem = StartProblem.of(variables.base, variables, margin=variables.margin)
    starts = StartGenerator(problem, seed=2)

    assert starts.at(0).starts == ()
    assert starts.at(0).reason.startswith("the given layout: 'abb' follows its path from no configuration")
    layout = LayoutProblem(
        job=problem.job, variables=variables, bodies=problem.distances, acceleration=problem.acceleration
    )
    demands = Demands(objective=Objective.CONFORMING, margin=variables.margin, duration=float(problem.job.times[-1]))
    result = (start for index in range(1, 5) for start in starts.at(index).starts[:2])
    improved = (improve(layout, start.x, start.start, demands, Effort(iterations=25)) for start in result)
    assert any(entry is not None and entry.is_conforming for entry in improved)
