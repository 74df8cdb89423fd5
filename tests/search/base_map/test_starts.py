"""Starts at places of a base: residuals by the placed robot, and all postures of a planar arm in closed form."""

from dataclasses import replace

import numpy as np

from cellplan.geometry.transforms import inverse
from cellplan.jobs.base_map.prepared import PreparedMap, _goal
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.search.base_map.places import Places
from cellplan.search.base_map.starts import starts_at

FINE = (np.arange(1000.0, 2801.0, 150.0), np.arange(-300.0, 901.0, 150.0))  # [mm]: most places are reached from others
LINKS = (0.5, 0.4)  # [m] of the first two links of the arm


def test_every_start_brings_the_tool_of_the_robot_that_stands_there_to_the_start_of_its_path(
    ready: PreparedMap,
) -> None:
    ((q, at),) = ready.starts()
    goal = _goal(ready.jobs[0])
    desired = goal.X_WR @ goal.X_RT

    assert len(q) > 10
    assert np.all(np.diff(at) >= 0)
    for start, place in zip(q, at.tolist(), strict=True):
        robot = replace(goal.robot, X_WB=ready.jobs[0].places.X_WB[place])
        tool = ScrewChain(robot).tool_poses(start[None])[0]
        np.testing.assert_allclose(tool[:2], desired[:2], atol=1e-8)  # position in the plane, and the turn about z


def test_a_planar_arm_has_both_elbows_wherever_its_wrist_is_within_reach_and_none_elsewhere(ready: PreparedMap) -> None:
    goal = _goal(ready.jobs[0])
    places = Places.of(goal.robot.X_WB, *FINE)
    q, at = starts_at(goal, places, goal.robot.model, goal.robot.X_WB, seed=ready.cell.solver.seed)
    X_WT = goal.X_WR @ goal.X_RT
    X_FT = goal.robot.tool.X_FT
    wrists = inverse(places.X_WB) @ X_WT @ inverse(X_FT) @ inverse(goal.robot.model.X_BF)
    wrist = (wrists @ [*_wrist(goal.robot.model), 1.0])[:, :2]
    reach = np.linalg.norm(wrist, axis=1)

    expected = np.where((reach < sum(LINKS)) & (reach > LINKS[0] - LINKS[1]), 2, 0)

    assert set(expected.tolist()) == {0, 2}
    assert np.bincount(at, minlength=len(places)).tolist() == expected.tolist()
    elbow = np.arccos((reach[at] ** 2 - LINKS[0] ** 2 - LINKS[1] ** 2) / (2.0 * LINKS[0] * LINKS[1]))
    np.testing.assert_allclose(np.abs(q[:, 1]), elbow, atol=1e-7)


def _wrist(model: RobotModel) -> list[float]:
    """The last axis at the reference configuration, in the base frame."""
    point: list[float] = model.joints[2].point_B.tolist()
    return point


def test_the_same_seeds_give_the_same_starts_whatever_part_of_the_world_the_cell_stands_in(ready: PreparedMap) -> None:
    ((q, at),) = ready.starts()
    goal, job = _goal(ready.jobs[0]), ready.jobs[0]
    X = np.eye(4)
    X[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    X[:3, 3] = [3.0, -1.0, 0.5]
    robot = replace(goal.robot, X_WB=X @ goal.robot.X_WB)
    moved_goal = replace(goal, robot=robot, chain=ScrewChain(robot), X_WR=X @ goal.X_WR)

    moved = starts_at(
        moved_goal,
        replace(job.places, X_WB=X @ job.places.X_WB),
        robot.model,
        robot.X_WB,
        seed=ready.cell.solver.seed,
    )

    np.testing.assert_array_equal(moved[1], at)
    np.testing.assert_allclose(moved[0], q, atol=1e-9)
