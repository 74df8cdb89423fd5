"""Bounds of the speed of points: never below what many moments show, and close to it."""

import numpy as np
import pytest
from builders.scene_builders import arm_model, held_part, joint, make_cell, placed, stick
from builders.transfer_cells import STEP

from cellplan.certify.point_speeds import PointSpeeds, point_speeds
from cellplan.geometry.arrays import Array
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.robot.robot import BASE, RobotModel
from cellplan.scene.scene import Scene

SPEED = 0.25  # [m/s]


def points_of(robot_model: RobotModel, shape: Solid, at: Array) -> tuple[Scene, PointSpeeds]:
    """A robot with a stick as its tool that carries a part, and its points."""
    part = held_part(shape, "arm", at)
    scene = Scene.from_cell(make_cell(placed("arm", robot_model, base=pose((0.3, -0.2, 0.1)), tool=stick()), part=part))
    return scene, PointSpeeds.of(scene, scene.cell.robots[0], limit=SPEED)


def points_on(shape: Solid, rng: np.random.Generator) -> Array:
    """Points of a solid, many of them on its edges, shape (K, 3)."""
    directions = rng.normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    match shape:
        case Box(size):
            return 0.5 * np.array(size) * np.sign(directions)
        case Cylinder(radius, length):
            round_it = directions[:, :2] / np.linalg.norm(directions[:, :2], axis=1)[:, None]
            return np.column_stack([radius * round_it, 0.5 * length * np.sign(directions[:, 2])])
        case Capsule(radius, length):
            return radius * directions + [0.0, 0.0, 0.5 * length] * np.sign(directions[:, 2:])
        case Sphere(radius):
            return radius * directions
        case _:
            raise TypeError(shape)


@pytest.mark.parametrize("shape", [Box((0.3, 0.2, 0.1)), Cylinder(0.2, 0.1), Capsule(0.05, 0.4), Sphere(0.15)])
def test_no_point_is_faster_than_the_bound_at_any_moment_of_a_step(shape: Solid) -> None:
    rng, X_PT = np.random.default_rng(3), pose((0.1, 0.05, -0.2), (0.3, 0.4, 0.5))
    scene, speeds = points_of(arm_model(), shape, X_PT)
    chain, on_part = scene.chains["arm"], points_on(shape, rng)
    for size in (0.0005, 0.005, 0.4):
        q = rng.uniform(-1.0, 1.0, 6) + np.array([np.zeros(6), size * rng.normal(size=6)])

        bound = speeds.travel(q)[0]

        u = np.linspace(0.0, 1.0, 2001)[:, None]
        line = q[0] + u * (q[1] - q[0])
        X_WT, X_WF = chain.tool_poses(line), chain.flange_poses(line)
        X_WP = X_WT @ np.linalg.inv(X_PT)
        moved = [X_WP[:, :3, :3] @ on_part.T + X_WP[:, :3, 3:], X_WT[:, :3, 3:], X_WF[:, :3, 3:]]
        true = max(float(np.linalg.norm(np.diff(points, axis=0), axis=1).max()) * 2000 for points in moved)
        slack = {0.0005: 1.02, 0.005: 1.1, 0.4: 6.0}[size]  # half of the second derivative, which grows with the step
        round_it = np.sqrt(2.0) if isinstance(shape, Sphere | Capsule) else 1.0  # speed and turning added as if across
        assert true <= bound <= slack * round_it * true


def test_the_rim_of_a_turning_disc_has_radius_times_rate() -> None:
    table = RobotModel(
        name="table", source="test", joints=(joint("turn", BASE),), flange_link=0, X_BF=np.eye(4), bodies=()
    )
    _, speeds = points_of(table, Cylinder(0.5, 0.05), pose((0.0, 0.0, -0.1)))

    travel = speeds.travel(np.array([[0.0], [0.001], [0.003]]))

    np.testing.assert_allclose(travel, [0.0005, 0.001], rtol=2e-3)  # a prism round the rim, and the square of the step


def test_straight_rates_keep_the_limit_in_rows_and_come_near_it() -> None:
    rng = np.random.default_rng(5)
    _, speeds = points_of(arm_model(), Box((0.3, 0.2, 0.1)), pose((0.1, 0.0, -0.2)))
    start = rng.uniform(-1.0, 1.0, (12, 6))
    goal = start + rng.normal(size=(12, 6)) * rng.choice([0.02, 0.3, 1.0], (12, 1))
    goal[0] = start[0]

    rates = speeds.straight_rate(start, goal, STEP)

    assert rates[0] == np.inf
    for a, b, rate in zip(start[1:], goal[1:], rates[1:], strict=True):
        shares = np.append(np.arange(0.0, 1.0, rate * STEP), 1.0)[:, None]
        assert 0.85 * SPEED <= speeds.travel(a + shares * (b - a)).max() / STEP <= SPEED
    table = speeds.straight_rate(start[:, None], goal[None], STEP)
    np.testing.assert_array_equal(np.diagonal(table), rates)


def test_points_among_other_joints_are_the_same_points() -> None:
    arms = [placed(name, arm_model(), base=pose((at, 0.0, 0.0)), tool=stick()) for name, at in (("a", 0.0), ("b", 4.0))]
    scene = Scene.from_cell(make_cell(*arms))
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 12))

    for points in point_speeds(scene, SPEED):
        columns = scene.cell.columns(points.robot)
        np.testing.assert_array_equal(points.among(columns).travel(q[:, columns]), points.travel(q))
    assert point_speeds(scene, None) == ()
