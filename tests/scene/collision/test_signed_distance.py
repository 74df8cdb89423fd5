"""Quick signed distances: overlaps of round bodies are those that many directions show."""

import numpy as np
import pytest
from builders.scene_builders import random_pose

from cellplan.geometry.shapes import Box, Cylinder, Solid
from cellplan.scene.collision.bodies import checked_poses, prepare
from cellplan.scene.collision.separation import separation
from cellplan.scene.collision.signed_distance import SignedDistances

STATES = 16  # [-] of each pair
DIRECTIONS = 300  # [-] at random, then about the best one, in each of the spreads
SPREADS = (10.0, 0.1, 0.03, 0.01, 0.003)  # [-]
ROUNDING = 1e-5  # [m]
COLUMN = Cylinder(0.06, 1.3)


def _separation(body: Solid, pose: np.ndarray) -> float:
    """The largest separation of a body from the column along many directions in [m]."""
    rng, n, best = np.random.default_rng(1), np.zeros(3), -np.inf
    placed = {"X_first": (pose[:3, :3], pose[:3, 3]), "X_second": (np.eye(3), np.zeros(3))}
    for spread in SPREADS:
        for direction in n + spread * rng.normal(size=(DIRECTIONS, 3)):
            value = separation(body, COLUMN, direction, **placed)
            if value > best:
                n, best = direction / np.linalg.norm(direction), value
    return best


def _below(body: Solid, X: np.ndarray, within: float) -> tuple[np.ndarray, np.ndarray]:
    """Distances of a body at some poses, shape (STATES, 4, 4), from the column, and the points of both."""
    column = np.tile(np.eye(4), (STATES, 1, 1))
    samples, ends = np.arange(STATES), np.tile([0, 1], (STATES, 1))
    bodies = (prepare("body", body), prepare("column", COLUMN))
    near, distances, points = SignedDistances().below(bodies, ends, checked_poses([X, column]), samples, within=within)
    assert np.array_equal(near, samples)
    return distances, points


@pytest.mark.parametrize("body", [Cylinder(0.039, 0.027), Box((0.11, 0.126, 0.112))])
def test_overlaps_of_round_bodies_are_the_least_shift_that_ends_them(body: Solid) -> None:
    rng = np.random.default_rng(2)
    X = np.stack([random_pose(rng, reach=0.0) for _ in range(STATES)])
    X[:, :3, 3] = rng.uniform((-0.05, -0.05, -0.4), (0.05, 0.05, 0.4), size=(STATES, 3))

    distances, points = _below(body, X, within=0.0)

    assert np.all(distances >= [_separation(body, pose) - ROUNDING for pose in X])
    X[:, :3, 3] += points[:, 1] - points[:, 0]
    assert np.abs(_below(body, X, within=1.0)[0]).max() <= ROUNDING
