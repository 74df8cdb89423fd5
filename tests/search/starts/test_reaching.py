"""Robots brought to their paths by joints and base: residuals by the kinematics of the placed robot."""

from dataclasses import replace

import numpy as np
import pytest

from cellplan.geometry.transforms import inverse, pose
from cellplan.model.seeds import generator
from cellplan.planning.start.inverse_kinematics import reaching_configurations, within_limits
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.starts.at_rest import pool, settings
from cellplan.search.starts.generator import branches
from cellplan.search.starts.reaching import BaseBounds, PlacedDraws, followed, matched, reached
from tests.search.starts.conftest import DRAWS

COUNT = 60


@pytest.fixture(scope="module")
def abb(four_robots):
    """The ABB with its goal, its part where the file has it, and draws with its base anywhere near."""
    problem = four_robots
    index = problem.cell.index("abb")
    layouts = problem.variables.layouts(problem.variables.given[None], problem.start[None])
    goal = problem.goal(index, problem.part_pose(layouts))
    arm, rng = problem.arms[index], generator("draws")
    draws = PlacedDraws(
        q=rng.uniform(arm.lower, arm.upper, (COUNT, 6)),
        X_WB=np.array([pose((0.0, 0.0, 0.3), (0.0, 0.0, yaw)) for yaw in rng.uniform(-3.0, 3.0, COUNT)]),
        X_FT=np.tile(layouts.X_FT[0, index], (COUNT, 1, 1)),
    )
    return problem, index, goal, arm, draws


def bounds(*free):
    return BaseBounds(is_free=np.array(free), lower=np.array([0.5, -1.5, 0.0]), upper=np.array([4.0, 1.5, 0.6]))


def residuals(problem, index, goal, placed, q, node):
    """Largest difference of any entry of the tool poses from those of the path, by a chain of the placed robot."""
    results = []
    for X_WB, X_FT, row in zip(placed.X_WB, placed.X_FT, q, strict=True):
        robot = problem.cell.robots[index]
        robot = replace(robot, X_WB=X_WB, tool=replace(robot.tool, X_FT=X_FT))
        X_RT = inverse(goal.X_WR) @ ScrewChain(robot).tool_poses(row[None])[0]
        results.append(np.abs(X_RT - goal.X_RT[node]).max())
    return np.array(results)


def test_joints_and_base_bring_the_tool_to_the_start(abb):
    problem, index, goal, arm, draws = abb
    free = bounds(True, True, True, True)
    X_WB, _ = matched(goal, free, arm.flanges(draws.q) @ draws.X_FT, draws.X_WB)
    placed, has_arrived = reached(arm, goal, free, replace(draws, X_WB=X_WB))
    at = placed.of_places(has_arrived)

    assert has_arrived.sum() >= COUNT // 10
    assert residuals(problem, index, goal, at, at.q, 0).max() < 1e-6
    assert np.all((at.q >= arm.lower) & (at.q <= arm.upper))
    assert np.all((at.X_WB[:, :3, 3] >= free.lower) & (at.X_WB[:, :3, 3] <= free.upper))
    np.testing.assert_allclose(at.X_WB[:, :3, 2], np.tile([0.0, 0.0, 1.0], (len(at.q), 1)), atol=1e-12)


def test_what_is_fixed_of_a_base_stays(abb):
    _, _, goal, arm, draws = abb
    fixed = bounds(True, False, False, False)
    X_WB, _ = matched(goal, fixed, arm.flanges(draws.q) @ draws.X_FT, draws.X_WB)
    placed, _ = reached(arm, goal, fixed, replace(draws, X_WB=X_WB))

    np.testing.assert_array_equal(placed.X_WB[:, 1:3, 3], draws.X_WB[:, 1:3, 3])
    np.testing.assert_array_equal(placed.X_WB[:, :3, :3], draws.X_WB[:, :3, :3])


def test_a_configuration_on_the_path_matches_with_no_miss(abb):
    problem, index, goal, arm, draws = abb
    start = problem.start[problem.cell.columns("abb")][None]
    tool = arm.flanges(start) @ draws.X_FT[:1]
    elsewhere = pose((3.0, 1.0, 0.4), (0.0, 0.0, 2.0))[None]
    X_WB, miss = matched(goal, bounds(True, True, True, True), tool, elsewhere)

    assert miss[0] < 1e-5
    np.testing.assert_allclose(X_WB[0], problem.cell.robots[index].X_WB, atol=1e-5)


def test_the_tool_follows_the_whole_path_round_its_corners(abb):
    problem, index, goal, arm, draws = abb
    start = problem.start[problem.cell.columns("abb")][None]
    placed = PlacedDraws(q=start, X_WB=problem.cell.robots[index].X_WB[None], X_FT=draws.X_FT[:1])
    q, has_followed = followed(arm, goal, placed)

    assert has_followed.all()
    for node in range(1, len(goal.X_RT)):
        assert residuals(problem, index, goal, placed, q[:, node], node).max() < 1e-4


def test_branches_are_those_of_the_inverse_kinematics_that_stay_within_limits_on_the_path(abb):
    problem, index, goal, arm, draws = abb
    robot = problem.cell.robots[index]
    result = branches(problem, index, problem.variables.given, problem.start, generator("branches"))
    seeds = generator("others").uniform(arm.lower, arm.upper, (200, 6))
    q = reaching_configurations(ScrewChain(robot), goal.relation, goal.X_RT[0], X_WP=goal.X_WR, seeds=seeds)
    q = within_limits(robot.model, q)
    bases, tools = np.tile(robot.X_WB, (len(q), 1, 1)), np.tile(draws.X_FT[0], (len(q), 1, 1))
    path, has_followed = followed(arm, goal, PlacedDraws(q=q, X_WB=bases, X_FT=tools))
    stays = has_followed & np.all((path >= arm.lower) & (path <= arm.upper), axis=(1, 2))

    assert len(result) == stays.sum() >= 1
    for entry in q[stays]:
        assert np.abs(result - entry).max(axis=1).min() < 1e-4


def test_a_pool_has_bases_that_reach_and_says_what_became_of_the_others(turntable):
    problem, rng = turntable, generator("pool")
    (setting, *_), _ = settings(problem, rng, 1)
    (robot, *_) = problem.operators
    result = pool(problem, robot, setting, rng)
    layouts = problem.variables.layouts(result.x, np.tile(problem.start, (len(result.x), 1)))
    goal = problem.goal(robot, setting.X_WP)
    placed = PlacedDraws(q=result.q, X_WB=layouts.X_WB[:, robot], X_FT=layouts.X_FT[:, robot])
    X_WT = placed.X_WB @ problem.arms[robot].flanges(placed.q) @ placed.X_FT

    assert 0 < len(result.q) <= 40
    np.testing.assert_allclose(X_WT[:, :3, 3], np.tile((goal.X_WR @ goal.X_RT[0])[:3, 3], (len(X_WT), 1)), atol=1e-6)
    assert np.all((result.x >= problem.variables.lower) & (result.x <= problem.variables.upper))
    assert result.drops.total() < DRAWS
