"""Paths laid on a part lie on its surface, with its true normals."""

import numpy as np
import pytest

from cellplan.geometry.curves.curve import CircleCurve
from cellplan.geometry.curves.surface_patch import Ball, Cap, Face, Patch, ProjectedCurve, Wall, patches_facing
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import Array, inverse, pose, transform_points

X = pose([0.3, -0.2, 0.5], [0.4, -0.7, 1.1])
TILTED = np.array([0.48, -0.36, 0.8])


def _points(seed: int = 1) -> Array:
    return X[:3, 3] + 0.05 * np.random.default_rng(seed).uniform(-1.0, 1.0, (200, 3))


def _distance_from_surface(shape: Box | Cylinder | Sphere, points: Array) -> Array:
    local = np.abs(transform_points(inverse(X), points))
    match shape:
        case Sphere(radius):
            return np.linalg.norm(local, axis=1) - radius
        case Cylinder(radius, length):
            return np.maximum(np.hypot(local[:, 0], local[:, 1]) - radius, local[:, 2] - 0.5 * length)
        case Box(size):
            return np.max(local - 0.5 * np.asarray(size), axis=1)


@pytest.mark.parametrize("shape", [Box((0.3, 0.2, 0.4)), Cylinder(0.15, 0.4), Sphere(0.2)], ids=str)
def test_every_line_through_the_inside_meets_the_surface_once_on_the_facing_side(
    shape: Box | Cylinder | Sphere,
) -> None:
    rng = np.random.default_rng(7)
    for direction in rng.normal(size=(20, 3)):
        d = direction / np.linalg.norm(direction)
        points = _points()
        held = np.zeros(len(points), dtype=int)
        for patch in patches_facing(shape, X, d):
            hits = patch.hits(points, d)
            on = patch.covers(hits)
            held += on
            assert np.abs(_distance_from_surface(shape, hits[on])).max(initial=0.0) <= 1e-15 * 10
            assert np.all(patch.normals(hits[on]) @ d >= 0.0)
            assert np.abs(np.cross(hits[on] - points[on], d)).max(initial=0.0) <= 1e-15
        assert np.all(held == 1)  # convex: one facing patch, none of the points is on an edge


@pytest.mark.parametrize("direction", np.vstack([np.eye(3), -np.eye(3)]), ids=str)
def test_a_direction_along_an_axis_sees_only_the_sides_that_face_it(direction: Array) -> None:
    upright = np.eye(4)

    assert [type(patch) for patch in patches_facing(Box((1.0, 2.0, 3.0)), upright, direction)] == [Face]
    expected = [Cap] if direction[2] else [Wall]
    assert [type(patch) for patch in patches_facing(Cylinder(1.0, 2.0), upright, direction)] == expected


def test_lines_beside_a_round_body_do_not_hit() -> None:
    wall = Wall(centre=np.zeros(3), axis=np.eye(3)[2], radius=0.1, half_length=0.2)
    ball = Ball(centre=np.zeros(3), radius=0.1)
    origin = np.array([[0.0, 0.1 + 1e-9, 0.0]])

    for patch in (wall, ball):
        hits = patch.hits(origin, np.eye(3)[0])
        assert np.all(np.isnan(hits))
        assert not patch.covers(hits)[0]


@pytest.mark.parametrize("shape", [Box((0.3, 0.3, 0.4)), Cylinder(0.15, 0.4), Sphere(0.2)], ids=str)
def test_projected_curves_move_within_the_surface_and_their_normals_turn_as_stated(
    shape: Box | Cylinder | Sphere,
) -> None:
    circle = CircleCurve(centre=X[:3, 3], first=np.array([0.03, 0.01, 0.0]), second=np.array([0.0, 0.02, 0.04]))
    u, h, whole = np.linspace(0.0, 6.0, 41), 1e-5, (0.0, 2.0 * np.pi)
    for patch in patches_facing(shape, X, TILTED):
        curve = ProjectedCurve(curve=circle, patch=patch, direction=TILTED)
        p, dp = curve.evaluate(u, whole)
        above, below = curve.evaluate(u + h, whole)[0], curve.evaluate(u - h, whole)[0]
        steady = np.all(np.isfinite(p), axis=1) & (patch.normals(p) @ TILTED > 0.1)
        rates = patch.normal_rates(p, dp)
        turned = (patch.normals(above) - patch.normals(below)) / (2.0 * h)
        # truncation h^2 times the third derivative, rounding 1e-16 / h
        assert np.abs((above - below) / (2.0 * h) - dp)[steady].max(initial=0.0) <= 2e-9
        assert np.abs(turned - rates)[steady].max(initial=0.0) <= 2e-8
        assert np.abs(np.sum(patch.normals(p) * dp, axis=1))[steady].max(initial=0.0) <= 1e-15


def test_a_point_on_the_border_belongs_to_both_sides() -> None:
    d = np.array([0.6, 0.0, 0.8])
    edge = np.array([[0.5, 0.1, 0.5]])

    patches: tuple[Patch, ...] = patches_facing(Box((1.0, 1.0, 1.0)), np.eye(4), d)

    assert len(patches) == 2
    assert all(patch.covers(patch.hits(edge, d))[0] for patch in patches)
