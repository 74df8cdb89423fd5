"""Lever arms and bends of a planar arm: the closed form, and no more than its stretched configuration needs."""

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies
from builders.scene_builders import body, displaced, joint, make_cell, placed

from cellplan.certify.lever_arms import Chain, LeverArms
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Tool
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.scene import Scene

LINKS = np.array([0.5, 0.3, 0.2])  # [m]
RADIUS = 0.04  # [m] of the ball at the tip
LAST = np.array([0.0, 0.0, 1.0])
SWEEP = 1e-3  # [-] of a step, on both sides of the stretched configuration


def stretched_arm() -> Scene:
    """Three joints that turn about parallel axes on a line, and a ball where the line ends."""
    places = np.append(0.0, np.cumsum(LINKS))
    model = RobotModel(
        name="planar",
        source="test",
        joints=tuple(joint(f"q{k}", k - 1, point=(float(places[k]), 0.0, 0.0)) for k in range(3)),
        flange_link=2,
        X_BF=pose((1.0, 0.0, 0.0), (0.0, 0.0, 0.5 * np.pi)),
        bodies=(body("ball", 2, shape=Sphere(RADIUS), at=(1.0, 0.0, 0.0)),),
    )
    return Scene.from_cell(make_cell(placed("arm", model, tool=Tool(X_FT=pose((0.0, -0.1, 0.0)), bodies=()))))


def seen_from_the_world(scene: Scene, q: Array) -> tuple[Chain, LeverArms]:
    arms = LeverArms(scene, q)
    return arms.chain(None, 0), arms


def farthest_point(q: Array) -> Array:
    """The point of the ball farthest along the arm at configurations, shape (N, 3), in closed form."""
    angles, lengths = np.cumsum(q, axis=1), LINKS + RADIUS * LAST
    return np.stack([np.cos(angles) @ lengths, np.sin(angles) @ lengths], axis=1)


def test_levers_of_a_planar_arm_are_the_lengths_of_the_links_beyond_each_joint() -> None:
    chain, arms = seen_from_the_world(stretched_arm(), np.zeros((2, 3)))

    np.testing.assert_allclose(chain.levers, [1.0 + RADIUS, 0.5 + RADIUS, 0.2 + RADIUS], rtol=1e-12)
    np.testing.assert_allclose(arms.tool("arm", seen_by=None).levers, [1.1, 0.6, 0.3], rtol=1e-12)  # 0.1 m beyond


@pytest.mark.parametrize("turned", [(0.3, 0.0, 0.0), (0.2, 0.5, 0.0), (0.1, 0.2, 0.4)])
def test_bend_and_reach_are_those_of_the_stretched_arm(turned: tuple[float, ...]) -> None:
    r"""Stretched out, :math:`|\ddot x| = \sum_k l_k \omega_k^2` with :math:`\omega_k = \sum_{i \le k} \dot q_i`."""
    moved = np.array(turned)
    q = np.stack([-0.5 * moved, 0.5 * moved])
    chain, arms = seen_from_the_world(stretched_arm(), q)
    speeds, lengths = np.cumsum(moved), LINKS + RADIUS * LAST

    before, here, after = farthest_point(np.outer([-SWEEP, 0.0, SWEEP], moved))

    assert chain.bend(arms.steps(q))[0] == pytest.approx(lengths @ speeds**2, rel=1e-12)
    assert chain.reach(arms.steps(q))[0] == pytest.approx(lengths @ speeds, rel=1e-12)
    assert np.linalg.norm(after - 2.0 * here + before) / SWEEP**2 == pytest.approx(lengths @ speeds**2, rel=1e-5)
    assert np.linalg.norm(after - before) / (2.0 * SWEEP) == pytest.approx(lengths @ speeds, rel=1e-5)


@pytest.mark.parametrize("seed", [1, 4])
def test_levers_of_a_cell_elsewhere_are_the_same(seed: int) -> None:
    cell = cell_with_bodies(seed)
    q = np.random.default_rng(seed).uniform(-1.0, 1.0, size=(4, cell.joint_count))
    X = pose((0.7, -1.2, 0.4), (0.3, -0.8, 2.0))
    scenes = [Scene.from_cell(one) for one in (cell, displaced(cell, X))]
    arms = [LeverArms(scene, q) for scene in scenes]

    for pair in scenes[0].solid_pairs[::7].tolist():
        here, there = (arm.chain(*pair) for arm in arms)
        np.testing.assert_array_equal(here.axes, there.axes)
        np.testing.assert_allclose(here.levers, there.levers, rtol=1e-9)


def test_a_tool_seen_from_the_flange_of_another_robot_travels_no_farther_than_its_reach() -> None:
    cell = cell_with_bodies(2)
    scene = Scene.from_cell(cell)
    q = np.random.default_rng(5).uniform(-1.0, 1.0, size=(2, cell.joint_count)) * [[0.0], [0.4]]
    rows = q[0] + np.linspace(0.0, 1.0, 400)[:, None] * (q[1] - q[0])
    arms = LeverArms(scene, q)
    tips = scene.chains["op0"].tool_poses(rows[:, cell.columns("op0")])[:, :3, 3]
    other = cell.robot("op1")
    flange = scene.chains["op1"].tool_poses(rows[:, cell.columns("op1")]) @ np.linalg.inv(other.tool.X_FT)

    seen = np.einsum("nij,ni->nj", flange[:, :3, :3], tips - flange[:, :3, 3])
    for viewer, path in ((None, tips), ("op1", seen)):
        travelled = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        bound = float(arms.tool("op0", seen_by=viewer).reach(arms.steps(q))[0])
        assert 0.05 * bound < travelled <= bound
