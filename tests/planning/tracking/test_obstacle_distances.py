"""Pairs that are near each other: which they are, how far apart, and what each joint does about it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders.scene_builders import (
    arm_model,
    body,
    fixed_part,
    floor,
    held_part,
    make_cell,
    placed,
    slide_model,
    stick,
    thing,
    work,
)

from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Capsule, Sphere
from cellplan.geometry.transforms import pose
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import BASE, FollowerJoint, JointKind
from cellplan.planning.tracking.obstacle_distances import ClosestPairs
from cellplan.scene.collision.distance import measure
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

FOLDER = Path(__file__).parents[3] / "cells"
H = 1e-4  # [rad] or [m]: distances of round bodies are good to 1e-8 m, so differences are good to 1e-4


def round_arm():
    """The elbow arm with round bodies only, a lever beside its way that the second joint drives."""
    model = arm_model()
    lever = FollowerJoint(
        name="lever",
        kind=JointKind.REVOLUTE,
        parent=0,
        axis_B=np.array([0.0, 1.0, 0.0]),
        point_B=np.array([0.0, 0.1, 0.5]),
        leader=1,
        ratio=-0.6,
        offset=0.1,
    )
    bodies = (
        body("upper_arm", 1, shape=Capsule(0.06, 0.4), at=(0.0, 0.0, 0.7)),
        body("forearm", 2, shape=Capsule(0.05, 0.2), at=(0.18, 0.0, 1.0), rpy=(0.0, np.pi / 2, 0.0)),
        body("wrist", 4, shape=Sphere(0.045), at=(0.6, 0.0, 1.0)),
        body("lever", 6, shape=Sphere(0.05), at=(0.1, 0.15, 0.6)),
    )
    return replace(model, bodies=bodies, followers=(lever,))


def round_cell():
    """Two arms, one holds a ball, and a ball and a floor as surroundings."""
    return make_cell(
        placed("left", round_arm()),
        placed("right", round_arm(), base=pose((1.5, 0.2, 0.0), (0.0, 0.0, 3.0)), tool=stick(0.2, 0.02)),
        part=held_part(Sphere(0.1), "left", pose((-0.15, 0.0, 0.0))),
        things=(thing("ball", Sphere(0.2), pose((0.5, 0.6, 0.9))), floor()),
    )


def differences(pairs: ClosestPairs, q: np.ndarray, within: float) -> dict[int, np.ndarray]:
    """Derivatives of all distances by central differences, by the row of the pair."""
    columns = []
    for e in np.eye(len(q)):
        ahead, behind = (
            {pair.row: pair.distance for pair in pairs.at(q + sign * H * e, within=within)} for sign in (1.0, -1.0)
        )
        columns.append({row: (ahead[row] - behind[row]) / (2 * H) for row in ahead.keys() & behind.keys()})
    rows = set.intersection(*(set(column) for column in columns))
    return {row: np.array([column[row] for column in columns]) for row in rows}


def test_gradients_are_the_derivatives_of_the_distances() -> None:
    """Links, tools, the held part, followers, surroundings and the floor."""
    cell = round_cell()
    pairs = ClosestPairs(Scene.from_cell(cell))
    seen = set()
    rng = np.random.default_rng(0)
    for _ in range(4):
        q = rng.uniform(-0.5, 0.5, cell.joint_count)
        expected = differences(pairs, q, 0.7)
        for pair in pairs.at(q, within=0.6):
            if pair.distance > 0.01:
                seen |= set(pairs.names(pair))
                np.testing.assert_allclose(
                    pair.gradient, expected[pair.row], atol=2e-3
                )  # normals of FCL are good to 1e-3
    assert {"left/lever", "right/tool", "part", "ball", "floor"} <= seen


def test_only_joints_before_the_link_move_its_body() -> None:
    cell = round_cell()
    pairs = ClosestPairs(Scene.from_cell(cell))
    result = {pairs.names(pair): pair for pair in pairs.at(np.zeros(12), within=0.8)}
    of_forearm = result["left/forearm", "ball"].gradient
    assert np.all(of_forearm[3:] == 0.0)
    assert np.any(of_forearm[:3] != 0.0)
    of_lever = result["left/lever", "ball"].gradient
    assert np.all(np.delete(of_lever, [0, 1]) == 0.0)
    assert of_lever[1] != 0.0  # the second joint drives it


def test_slide_towards_a_ball_shortens_the_distance_one_to_one() -> None:
    cell = make_cell(
        placed("slide", slide_model(Sphere(0.1))), things=(thing("ball", Sphere(0.2), pose((1.0, 0.0, 0.0))),)
    )
    (pair,) = ClosestPairs(Scene.from_cell(cell)).at(np.array([0.5]), within=0.3)
    assert pair.distance == pytest.approx(0.2, abs=1e-6)
    np.testing.assert_allclose(pair.gradient, [-1.0], atol=1e-6)
    np.testing.assert_allclose(pair.point_a, [0.6, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(pair.point_b, [0.8, 0.0, 0.0], atol=1e-6)


def test_bodies_that_overlap_are_pushed_apart_by_their_depth() -> None:
    cell = make_cell(
        placed("slide", slide_model(Sphere(0.1))), things=(thing("ball", Sphere(0.2), pose((1.0, 0.0, 0.0))),)
    )
    (pair,) = ClosestPairs(Scene.from_cell(cell)).at(np.array([0.9]), within=0.3)
    assert pair.distance == pytest.approx(-0.2, abs=1e-9)
    np.testing.assert_allclose(pair.gradient, [-1.0], atol=1e-12)


def test_nothing_near_gives_nothing() -> None:
    cell = make_cell(
        placed("slide", slide_model(Sphere(0.1))), things=(thing("ball", Sphere(0.2), pose((1.0, 0.0, 0.0))),)
    )
    assert ClosestPairs(Scene.from_cell(cell)).at(np.array([-5.0]), within=0.3) == ()


def test_tool_at_work_and_the_robot_itself_are_left_out() -> None:
    cell = make_cell(
        placed("arm", arm_model(), tool=stick()),
        part=fixed_part(Sphere(0.1), pose((0.75, 0.0, 0.9))),
        tasks=(work("arm"),),
        things=(floor(),),
    )
    scene = Scene.from_cell(cell)
    result = [scene.pairs[pair.row] for pair in ClosestPairs(scene).at(np.zeros(6), within=5.0)]
    assert result
    assert all(pair.rule is Rule.CLEARANCE for pair in result)
    assert ClearanceClass.SELF not in {pair.clearance_class for pair in result}
    self_pairs = ClosestPairs(scene, classes=frozenset({ClearanceClass.SELF})).at(np.zeros(6), within=5.0)
    assert {scene.pairs[pair.row].clearance_class for pair in self_pairs} == {ClearanceClass.SELF}


@pytest.mark.parametrize(
    "name", ["mesh_part_csv", *(pytest.param(name, marks=pytest.mark.slow) for name in ("four_robots", "dual_arm"))]
)
def test_no_near_pair_is_missed(name: str) -> None:
    """Against the distance of every pair, measured without spheres or boxes."""
    cell = load_cell(FOLDER / f"{name}.yaml")
    scene = Scene.from_cell(cell)
    pairs, within = ClosestPairs(scene), 0.3
    rng = np.random.default_rng(1)
    start = np.concatenate([np.zeros(len(r.model.joints)) if r.start is None else r.start for r in cell.robots])
    for _ in range(2):
        q = start + rng.normal(size=len(start)) * 0.2
        poses = scene.body_poses(q[None])
        result = {pair.row: pair.distance for pair in pairs.at(q, within=within)}
        assert result
        for row, (a, b) in zip(scene.solid_rows, scene.solid_pairs, strict=True):
            pair = scene.pairs[row]
            if pair.rule is not Rule.CLEARANCE or pair.clearance_class is ClearanceClass.SELF:
                assert row not in result
                continue
            distance = measure(scene.engine, (int(a), int(b)), poses, sample=0).bound
            assert max(result.get(row, within), 0.0) == pytest.approx(
                min(distance, within), abs=1e-4
            )  # the engine's accuracy
        for row in scene.ground_rows:
            height = float(scene.ground_heights(scene.pairs[row], poses)[0])
            expected = min(max(height, 0.0), within)
            if scene.pairs[row].rule is Rule.CLEARANCE:
                assert max(result.get(int(row), within), 0.0) == pytest.approx(expected, abs=1e-9)


def test_a_cell_without_pairs_has_no_near_ones() -> None:
    model = replace(slide_model(Sphere(0.1)), bodies=())
    cell = make_cell(placed("slide", model))
    assert ClosestPairs(Scene.from_cell(cell)).at(np.zeros(1), within=1.0) == ()


def test_foot_of_a_robot_does_not_move() -> None:
    model = replace(slide_model(Sphere(0.1)), bodies=(body("foot", BASE, shape=Sphere(0.1)),))
    base = pose((0.5, 0.0, 0.0))
    cell = make_cell(placed("foot", model, base=base), placed("slide", slide_model(Sphere(0.1))))
    (pair,) = ClosestPairs(Scene.from_cell(cell)).at(np.array([3.0, 0.1]), within=0.3)
    assert pair.distance == pytest.approx(0.2, abs=1e-6)
    np.testing.assert_allclose(pair.gradient, [0.0, -1.0], atol=1e-6)
