"""Near pairs against the exact distances of every pair, and their gradients against differences."""

from pathlib import Path

import numpy as np
import pytest

from cellplan.files.cell.load import load_cell
from cellplan.geometry.shapes import Cylinder
from cellplan.geometry.transforms import pose
from cellplan.scene.collision.bodies import checked_poses, prepare
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.signed_distance import _along_centres
from cellplan.scene.near import NearPairs
from cellplan.scene.scene import Scene

CELL = Path(__file__).resolve().parents[2] / "cells" / "four_robots.yaml"
WITHIN = 0.08


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene.from_cell(load_cell(CELL))


@pytest.fixture(scope="module")
def q(scene: Scene) -> np.ndarray:
    start = np.concatenate([robot.start for robot in scene.cell.robots if robot.start is not None])
    return start + np.random.default_rng(0).uniform(-0.05, 0.05, (2, len(start)))


@pytest.fixture(scope="module")
def near(scene: Scene, q: np.ndarray) -> NearPairs:
    return scene.near(q, WITHIN)


def test_all_pairs_that_are_near_are_found_with_their_exact_distances(
    scene: Scene, q: np.ndarray, near: NearPairs
) -> None:
    poses = scene.body_poses(q[:1])
    result = {int(row): d for row, k, d in zip(near.rows, near.samples, near.distances, strict=True) if k == 0}
    centres = scene.engine.sphere_centres(poses, sample=0)
    for row, ends in zip(scene.solid_rows.tolist(), scene.solid_pairs.tolist(), strict=True):
        i, j = ends
        if np.linalg.norm(centres[i] - centres[j]) > scene.engine.radii[[i, j]].sum() + WITHIN:
            assert row not in result
            continue
        exact = measure(scene.engine, (i, j), poses, sample=0)
        if row in result:
            is_convex = scene.engine.bodies[i].is_convex and scene.engine.bodies[j].is_convex
            lowest = exact.bound - 1e-4 if is_convex else 0.0
            assert result[row] <= 0.0 if exact.touches else lowest <= result[row] <= exact.bound + 1e-4
        else:
            assert exact.bound > WITHIN - 1e-4
    for row in scene.ground_rows.tolist():
        height = scene.ground_heights(scene.pairs[row], poses)[0]
        assert (row in result) == (height < WITHIN)
        assert row not in result or result[row] == pytest.approx(height)


def test_normals_go_from_the_first_point_to_the_second(near: NearPairs) -> None:
    assert len(near.rows) > 20
    np.testing.assert_allclose(np.linalg.norm(near.normals, axis=1), 1.0, atol=1e-12)
    np.testing.assert_allclose(near.second - near.first, near.distances[:, None] * near.normals, atol=1e-6)


def test_gradients_are_those_of_differences(scene: Scene, q: np.ndarray, near: NearPairs) -> None:
    rng, step = np.random.default_rng(1), 1e-5
    moved = rng.normal(size=q.shape[1])
    sides = [scene.near(q + sign * step * moved, 2.0 * WITHIN) for sign in (1.0, -1.0)]
    known = [
        {(row, k): d for row, k, d in zip(side.rows.tolist(), side.samples.tolist(), side.distances, strict=True)}
        for side in sides
    ]
    keys = list(zip(near.rows.tolist(), near.samples.tolist(), strict=True))
    result = np.array([(known[0][key] - known[1][key]) / (2.0 * step) for key in keys])
    expected = near.by_joints @ moved
    is_smooth = np.abs(result - expected) < 2e-3 * np.abs(moved).max()
    assert is_smooth.mean() > 0.9  # parallel faces and edges have no gradient: any of their nearest points may count


def test_bodies_that_overlap_have_negative_distances(scene: Scene, q: np.ndarray) -> None:
    kuka, abb = scene.cell.robot("kuka"), scene.cell.robot("abb")
    together = scene.moved({"abb": abb.X_WB @ np.linalg.inv(abb.X_WB) @ kuka.X_WB})
    near = together.near(q[:1], 0.0)
    row = int(np.argmin(near.distances))
    assert near.distances[row] < -0.05
    np.testing.assert_allclose(near.second[row] - near.first[row], near.distances[row] * near.normals[row], atol=1e-6)


def test_an_overlap_that_coal_finds_no_depth_of_is_that_along_the_centres() -> None:
    cylinders = [
        prepare(name, Cylinder(radius, length)) for name, radius, length in (("a", 0.23, 0.35), ("b", 0.25, 0.5))
    ]
    poses = checked_poses([pose((0.0, 0.0, z))[None] for z in (0.0, 0.1)])
    place = (0, 1, 0)
    distance, first, second = _along_centres(*cylinders, poses, place)
    assert distance == pytest.approx(0.1 - 0.175 - 0.25)
    np.testing.assert_allclose(second - first, (0.0, 0.0, distance), atol=1e-12)
