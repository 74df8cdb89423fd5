"""Contacts and smallest distances over a motion: the same as asking for every pair at every sample."""

import numpy as np
import pytest
from scene_builders import random_pose

from cellplan.collision.bodies import BodyPoses, checked_poses, prepare
from cellplan.collision.curve import nearest_at_each
from cellplan.collision.engine import Engine
from cellplan.collision.inside import is_inside
from cellplan.collision.measure import measure
from cellplan.collision.nearest import find_nearest
from cellplan.collision.relative import RelativeMotion
from cellplan.collision.sweep import first_touching, sphere_bounds, sweep
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from cellplan.geometry.tessellation import tessellate
from cellplan.geometry.transforms import Array, pose, pose_from, rotation_exp

EXACT = 1e-4  # [m] promised accuracy of a smallest distance
ROOM = 1e-9  # [m] rounding


def tumbling(rng: np.random.Generator, samples: int, *, reach: float) -> Array:
    """A smooth motion of one body: a straight flight with a slow turn."""
    start, end = random_pose(rng, reach=reach), random_pose(rng, reach=reach)
    s = np.linspace(0.0, 1.0, samples)[:, None]
    R = start[:3, :3] @ rotation_exp(s * rng.normal(size=3))
    return pose_from(R, (1.0 - s) * start[:3, 3] + s * end[:3, 3])


def random_scene(seed: int, *, samples: int = 120) -> tuple[Engine, BodyPoses, list[tuple[int, int]]]:
    rng = np.random.default_rng(seed)
    table = tessellate(Box((0.3, 0.2, 0.1)))
    corner = Mesh(
        vertices=np.concatenate([table.vertices, table.vertices[:, [2, 1, 0]] + np.array([0.1, 0.0, 0.15])]),
        faces=np.concatenate([table.faces, table.faces[:, ::-1] + len(table.vertices)]),
        source="corner",
        is_closed=True,
    )
    shapes = [Box((0.3, 0.1, 0.2)), Cylinder(0.08, 0.4), Capsule(0.06, 0.3), Sphere(0.1), corner, table]
    engine = Engine([prepare(f"body {k}", shape) for k, shape in enumerate(shapes)])
    poses = checked_poses([tumbling(rng, samples, reach=0.7) for _ in shapes])
    return engine, poses, [(a, b) for a in range(len(shapes)) for b in range(a + 1, len(shapes))]


def brute_force(engine: Engine, poses: BodyPoses, pairs: list[tuple[int, int]]) -> tuple[Array, np.ndarray]:
    """Distance and contact of every pair at every sample, one by one."""
    distance, touching = np.zeros((len(pairs), poses.p.shape[1])), np.zeros((len(pairs), poses.p.shape[1]), dtype=bool)
    for row, pair in enumerate(pairs):
        for k in range(poses.p.shape[1]):
            reading = measure(engine, pair, poses, sample=k)
            touching[row, k] = reading.touches or is_inside(engine, pair, poses, sample=k)
            distance[row, k] = 0.0 if touching[row, k] else reading.bound
    return distance, touching


@pytest.mark.parametrize("seed", range(4))
def test_sweep_finds_every_contact_of_the_brute_force_search_and_no_other(seed: int) -> None:
    engine, poses, pairs = random_scene(seed)

    found = sweep(engine, pairs, poses)
    distance, touching = brute_force(engine, poses, pairs)

    np.testing.assert_array_equal(found.touching, touching)
    assert touching.any()
    assert np.all(found.lower <= distance + EXACT)


@pytest.mark.parametrize("seed", range(4))
def test_smallest_distance_is_that_of_the_brute_force_search(seed: int) -> None:
    engine, poses, pairs = random_scene(seed)
    found = sweep(engine, pairs, poses)
    free = [row for row in range(len(pairs)) if not found.touching[row].any()]
    distance, _ = brute_force(engine, poses, [pairs[row] for row in free])

    nearest = find_nearest(engine, [pairs[row] for row in free], poses, lower=found.lower[free])

    assert distance.min() - EXACT <= nearest.proved <= distance.min() + EXACT / 2
    assert nearest.proved <= nearest.measured <= nearest.proved + EXACT
    assert abs(distance[nearest.row, nearest.sample] - nearest.measured) <= EXACT


@pytest.mark.parametrize("seed", range(2))
def test_the_curve_is_the_smallest_distance_at_each_sample(seed: int) -> None:
    engine, poses, pairs = random_scene(seed, samples=40)
    distance, touching = brute_force(engine, poses, pairs)

    lower = np.maximum(sphere_bounds(engine, pairs, poses), 0.0)
    curve = nearest_at_each(engine, pairs, poses, lower=np.where(touching, 0.0, lower), touching=touching)

    assert np.all(curve <= distance.min(axis=0) + EXACT / 2)
    assert np.all(curve >= distance.min(axis=0) - 2 * EXACT)


@pytest.mark.parametrize("seed", range(6))
def test_what_one_reading_proves_elsewhere_is_never_above_the_distance_there(seed: int) -> None:
    engine, poses, pairs = random_scene(seed, samples=40)
    for pair in pairs:
        motion = RelativeMotion(engine, pair, poses)
        lower = np.full(40, -np.inf)
        reading = measure(engine, pair, poses, sample=13)

        motion.carry(reading, 13, others=np.arange(40), lower=lower)

        for k in range(0, 40, 3):
            there = measure(engine, pair, poses, sample=k)
            assert lower[k] <= there.bound + EXACT or (there.touches and lower[k] <= ROOM)


def test_nothing_travels_between_bodies_that_move_together() -> None:
    rng = np.random.default_rng(5)
    carrier = tumbling(rng, 50, reach=1.0)
    engine = Engine([prepare("a", Box((0.1, 0.2, 0.3))), prepare("b", Cylinder(0.1, 0.2))])
    poses = checked_poses([carrier, carrier @ pose((0.5, 0.1, 0.0), (0.3, 0.2, 0.1))])

    assert RelativeMotion(engine, (0, 1), poses).travel(0, np.arange(50)).max() < 1e-12  # rounding


def test_a_body_that_dives_into_a_closed_mesh_touches_until_it_comes_out() -> None:
    engine = Engine([prepare("tank", tessellate(Box((1.0, 1.0, 1.0)))), prepare("ball", Sphere(0.05))])
    x = np.linspace(-1.0, 1.0, 401)
    flight = pose_from(np.broadcast_to(np.eye(3), (401, 3, 3)), np.stack([x, 0 * x, 0 * x], axis=1))
    poses = checked_poses([np.broadcast_to(np.eye(4), (401, 4, 4)), flight])

    touching = sweep(engine, [(0, 1)], poses).touching[0]

    clear = np.abs(np.abs(x) - 0.55) > 1e-6  # at the very border both answers are right
    np.testing.assert_array_equal(touching[clear], (np.abs(x) < 0.55)[clear])


def test_first_touching_is_none_or_a_pair_that_touches() -> None:
    engine, poses, pairs = random_scene(1, samples=60)
    _, touching = brute_force(engine, poses, pairs)
    for k in range(60):
        place = first_touching(engine, np.array(pairs), poses, sample=k)
        assert touching[place, k] if place is not None else not touching[:, k].any()


def test_a_scene_without_pairs_has_no_nearest() -> None:
    engine, poses, _ = random_scene(0, samples=5)

    nearest = find_nearest(engine, [], poses, lower=np.empty((0, 5)))

    assert nearest.row == -1
    assert nearest.proved == np.inf
