"""Nearest points of two bodies against closed forms and against the measured distance."""

from itertools import product

import numpy as np
import pytest
from builders.scene_builders import random_pose

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import pose
from cellplan.scene.collision.bodies import checked_poses, prepare
from cellplan.scene.collision.distance import measure, nearest_points, point_above
from cellplan.scene.collision.engine import Engine

ACCURACY = 1e-4  # [m] what the distances of the engine are good for
SHAPES = [Box((0.2, 0.3, 0.1)), Cylinder(0.1, 0.3), Capsule(0.08, 0.2), Sphere(0.1), tessellate(Box((0.2, 0.1, 0.2)))]


def placed(first: Solid, second: Solid, X_first, X_second):
    engine = Engine([prepare("first", first), prepare("second", second)])
    return engine, checked_poses([X_first[None], X_second[None]])


def hollow() -> Mesh:
    """Two plates 0.4 m apart, one body: its hull fills the gap."""
    plate, shift = tessellate(Box((0.4, 0.4, 0.02))), np.array([0.0, 0.0, 0.2])
    vertices = np.concatenate([plate.vertices + shift, plate.vertices - shift])
    faces = np.concatenate([plate.faces, plate.faces + len(plate.vertices)])
    return Mesh(vertices=vertices, faces=faces, source="plates", is_closed=True)


def test_two_balls_are_nearest_on_the_line_between_them() -> None:
    engine, poses = placed(Sphere(0.1), Sphere(0.2), pose((1.0, 2.0, 3.0)), pose((1.0, 3.0, 3.0)))
    nearest = nearest_points(engine, (0, 1), poses, sample=0)
    assert nearest.distance == pytest.approx(0.7, abs=1e-6)
    np.testing.assert_allclose(nearest.first, [1.0, 2.1, 3.0], atol=1e-6)
    np.testing.assert_allclose(nearest.second, [1.0, 2.8, 3.0], atol=1e-6)
    np.testing.assert_allclose(nearest.normal, [0.0, 1.0, 0.0], atol=1e-6)


@pytest.mark.parametrize(("first", "second"), list(product(SHAPES, SHAPES)), ids=lambda shape: type(shape).__name__)
def test_points_are_as_far_apart_as_the_bodies(first: Solid, second: Solid) -> None:
    """And each lies on its body: no point of the pair of lesser distance is left of it."""
    rng = np.random.default_rng(1)
    for _ in range(10):
        engine, poses = placed(first, second, random_pose(rng, reach=0.3), random_pose(rng, reach=0.5))
        reading = measure(engine, (0, 1), poses, sample=0)
        nearest = nearest_points(engine, (0, 1), poses, sample=0)
        assert nearest.distance == pytest.approx(reading.bound, abs=ACCURACY)
        assert np.linalg.norm(nearest.normal) == pytest.approx(1.0)
        if reading.touches:
            assert nearest.distance == 0.0
        else:
            assert np.linalg.norm(nearest.second - nearest.first) == pytest.approx(nearest.distance)
            for point, body in ((nearest.first, 0), (nearest.second, 1)):
                probe = Engine([engine.bodies[body], prepare("probe", Sphere(2 * ACCURACY))])
                at = pose(tuple(point))[None]
                X = np.concatenate([poses.R[body, 0], poses.p[body, 0][:, None]], axis=1)
                X = np.concatenate([X, [[0.0, 0.0, 0.0, 1.0]]])[None]
                assert probe.surface_distance(0, 1, checked_poses([X, at]), sample=0) <= ACCURACY


def test_aligned_boxes_have_points_on_the_faces_that_meet() -> None:
    """Where FCL's proposal for two boxes with parallel faces is not the nearest one, the surfaces are."""
    rng = np.random.default_rng(2)
    for _ in range(40):
        gap = rng.uniform(0.3, 0.6, 3) * rng.choice([-1.0, 1.0], 3)
        gap[rng.integers(3)] = 0.0
        engine, poses = placed(Box((0.2, 0.3, 0.1)), Box((0.2, 0.3, 0.1)), pose(), pose(tuple(gap)))
        outside = np.maximum(np.abs(gap) - [0.2, 0.3, 0.1], 0.0)
        nearest = nearest_points(engine, (0, 1), poses, sample=0)
        assert nearest.distance == pytest.approx(float(np.linalg.norm(outside)), abs=ACCURACY)


def test_body_between_two_plates_is_measured_to_the_plates_and_not_to_their_hull() -> None:
    engine, poses = placed(hollow(), Sphere(0.05), pose(), pose((0.0, 0.0, 0.1)))
    nearest = nearest_points(engine, (0, 1), poses, sample=0)
    assert nearest.distance == pytest.approx(0.04, abs=1e-6)
    np.testing.assert_allclose(nearest.normal, [0.0, 0.0, -1.0], atol=1e-6)


@pytest.mark.parametrize("outer", [Sphere(0.3), tessellate(Box((0.6, 0.6, 0.6)))], ids=["ball", "mesh"])
def test_bodies_that_touch_or_hold_each_other_are_pushed_along_their_middles(outer: Solid) -> None:
    engine, poses = placed(outer, Sphere(0.05), pose(), pose((0.0, 0.1, 0.0)))
    nearest = nearest_points(engine, (0, 1), poses, sample=0)
    assert nearest.distance == 0.0
    np.testing.assert_allclose(nearest.normal, [0.0, 1.0, 0.0], atol=1e-12)


def test_bodies_with_one_middle_still_have_a_direction() -> None:
    engine, poses = placed(Sphere(0.3), Sphere(0.05), pose(), pose())
    assert np.linalg.norm(nearest_points(engine, (0, 1), poses, sample=0).normal) == 1.0


def test_point_above_a_sloping_plane() -> None:
    engine, poses = placed(Sphere(0.1), Sphere(0.1), pose((0.0, 0.0, 1.0)), pose())
    X_WS = pose((0.0, 0.0, 0.5), (np.pi / 4, 0.0, 0.0))
    nearest = point_above(engine, 0, poses, X_WS=X_WS, sample=0)
    assert nearest.distance == pytest.approx(0.5 / np.sqrt(2.0) - 0.1)
    np.testing.assert_allclose(nearest.second - nearest.first, nearest.distance * nearest.normal, atol=1e-12)
    np.testing.assert_allclose(nearest.normal, -X_WS[:3, 2])


def test_body_in_the_ground_has_no_distance() -> None:
    engine, poses = placed(Sphere(0.1), Sphere(0.1), pose(), pose())
    nearest = point_above(engine, 0, poses, X_WS=pose(), sample=0)
    assert nearest.distance == 0.0
    np.testing.assert_array_equal(nearest.normal, [0.0, 0.0, -1.0])
