"""Depth of overlapping solids: closed forms, a second opinion, and never less than the truth."""

import coal
import numpy as np
import pytest
from coal_shapes import coal_shape
from hypothesis import given, settings
from hypothesis import strategies as st

from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.mesh.topology import make_mesh
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Shape, Solid, Sphere
from cellplan.geometry.transforms import Array, pose, rotation_exp
from cellplan.scene.collision.bodies import BodyPoses, prepare
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.overlap.depth import convex_depth, ground_depth, overlap_depth

SHARE = 1e-3  # [-] and
CLOSE = 1e-5  # [m]: what the depth may be above the truth
STRAIGHT = np.eye(3)


def at(*xyz: float) -> Array:
    return np.array(xyz)


def depth(first: Solid, second: Solid, X_AB: Array) -> float:
    engine = Engine([prepare("a", first), prepare("b", second)])
    poses = BodyPoses(np.stack([np.eye(3), X_AB[:3, :3]])[:, None], np.stack([np.zeros(3), X_AB[:3, 3]])[:, None])
    return overlap_depth(engine, (0, 1), poses, sample=0)


@pytest.mark.parametrize(
    ("first", "second", "p", "expected"),
    [
        (Box((1, 1, 1)), Box((1, 1, 1)), at(0.3, 0.1, 0.8), 0.2),
        (Box((1, 1, 1)), Box((1, 1, 1)), at(0.0, 0.0, 1.0), 0.0),
        (Box((1, 1, 1)), Box((0.1, 0.1, 0.1)), at(0.0, 0.2, 0.0), 0.35),
        (Sphere(0.25), Sphere(0.2), at(0.1, 0.1, 0.0), 0.45 - 0.1 * np.sqrt(2.0)),
        (Sphere(0.25), Sphere(0.2), at(0.0, 0.0, 0.0), 0.45),
        (Cylinder(0.25, 0.5), Cylinder(0.2, 0.5), at(0.0, 0.0, 0.0), 0.45),
        (Cylinder(0.25, 0.1), Cylinder(0.2, 0.1), at(0.0, 0.0, 0.03), 0.07),
        (Capsule(0.1, 1.0), Box((4, 4, 0.2)), at(0.0, 0.0, 0.65), 0.05),
        (Box((1, 1, 1)), Box((1, 1, 1)), at(3.0, 0.0, 0.0), 0.0),
    ],
)
def test_depths_of_plain_solids_are_those_of_the_closed_form(
    first: Solid, second: Solid, p: Array, expected: float
) -> None:
    assert expected - 1e-12 <= convex_depth(first, second, STRAIGHT, p) <= expected * (1.0 + SHARE) + CLOSE


SOLIDS = (Box((0.3, 0.2, 0.1)), Cylinder(0.1, 0.3), Capsule(0.05, 0.3), Sphere(0.12), Box((0.5, 0.02, 0.4)))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 4), st.integers(0, 4), st.integers(0, 10**6))
def test_no_direction_separates_sooner_than_the_depth_says_but_for_its_room(i: int, j: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, second = SOLIDS[i], SOLIDS[j]
    R, p = rotation_exp(2.0 * rng.normal(size=3)), rng.uniform(-0.15, 0.15, 3)

    deepest = convex_depth(first, second, R, p)

    request, result = coal.CollisionRequest(), coal.CollisionResult()
    request.enable_contact = True
    X_A, X_B = coal.Transform3s(np.eye(3), np.zeros(3)), coal.Transform3s(R, p)
    coal.collide(coal_shape(first), X_A, coal_shape(second), X_B, request, result)
    theirs = -result.getContact(0).penetration_depth if result.isCollision() else 0.0
    assert deepest <= theirs * (1.0 + SHARE) + 2e-5  # theirs is a way out, though not always the shortest
    if deepest > 1e-4:
        assert result.isCollision()
        assert moved_apart(first, second, R, p, by=1.001 * deepest + CLOSE, hint=result.getContact(0).normal)


def moved_apart(first: Solid, second: Solid, R: Array, p: Array, *, by: float, hint: Array) -> bool:
    """Whether some move of that length separates two solids: along a hint, or in the directions of many proofs."""
    if any(convex_depth(first, second, R, p + 1.05 * by * direction) == 0.0 for direction in (hint, -hint)):
        return True
    angle = np.linspace(0.0, 1.0, 4001)
    height, turn = 1.0 - 2.0 * angle, 4001 * np.pi * (3.0 - np.sqrt(5.0)) * angle
    width = np.sqrt(1.0 - height**2)
    n = np.stack([width * np.cos(turn), width * np.sin(turn), height], axis=1)
    n = np.concatenate([n, np.eye(3), -np.eye(3), R.T, -R.T])
    return bool(
        np.any([convex_depth(first, second, R, p + 1.05 * by * direction) <= 0.1 * by for direction in n[::200]])
    ) or any(convex_depth(first, second, R, p + 1.05 * by * direction) == 0.0 for direction in n)


def test_a_mesh_that_is_convex_is_as_deep_as_the_solid_it_shows() -> None:
    ball = tessellate(Sphere(0.2), 48)

    assert depth(ball, Box((1, 1, 1)), pose((0.0, 0.0, 0.6))) == pytest.approx(
        0.1, abs=1.5e-3
    )  # it lies round the ball


def test_the_ground_is_as_deep_as_the_lowest_point_says() -> None:
    body, poses = prepare("a", Cylinder(0.1, 0.4)), BodyPoses(np.eye(3)[None, None], at(0.0, 0.0, 0.1)[None, None])

    assert ground_depth(body, poses, 0, X_WS=np.eye(4))[0] == pytest.approx(0.1, abs=1e-12)
    assert ground_depth(body, poses, 0, X_WS=pose((0.0, 0.0, -0.2)))[0] == 0.0


def tube(inner: float, outer: float, length: float, sides: int = 24) -> Mesh:
    """A closed mesh of a tube along z."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rows = [(outer, -0.5), (outer, 0.5), (inner, 0.5), (inner, -0.5)]
    vertices = np.concatenate([np.column_stack([r * ring, np.full(sides, h * length)]) for r, h in rows])
    faces = []
    for k in range(4):
        for i in range(sides):
            a, b = k * sides + i, k * sides + (i + 1) % sides
            c, d = (k + 1) % 4 * sides + i, (k + 1) % 4 * sides + (i + 1) % sides
            faces += [(a, b, d), (a, d, c)]
    return make_mesh(vertices, np.array(faces), source="tube")


@pytest.mark.parametrize(
    ("guest", "X", "expected"),
    [
        (Cylinder(0.04, 0.5), pose((0.0, 0.0, 0.0)), 0.0),  # a pin in the bore
        (Cylinder(0.04, 0.5), pose((0.02, 0.0, 0.0)), 0.01),  # the same, pushed into the wall
        (Sphere(0.01), pose((0.075, 0.0, 0.0)), 0.025),  # all inside the wall, round its middle
        (Box((0.4, 0.4, 0.02)), pose((0.0, 0.0, 0.11)), 0.0),  # a plate that lies flat on the end
        (Box((0.4, 0.4, 0.02)), pose((0.0, 0.0, 0.10)), 0.01),
    ],
)
def test_a_pin_in_a_bore_is_not_deep_but_one_in_the_wall_is(guest: Shape, X: Array, expected: float) -> None:
    deepest = depth(tube(0.05, 0.1, 0.2), guest, X)

    assert deepest == pytest.approx(expected, abs=1.5e-3)  # the bore has 24 sides
    assert (deepest > 5e-4) == (expected > 0.0)


def test_an_open_mesh_counts_by_its_surface_only() -> None:
    wall = tube(0.05, 0.1, 0.2)
    open_ = make_mesh(wall.vertices, wall.faces[:-1], source="open tube")

    assert depth(open_, Cylinder(0.04, 0.5), np.eye(4)) == 0.0
    assert depth(open_, Box((1.0, 1.0, 1.0)), pose((0.0, 0.0, 0.58))) == pytest.approx(0.02, abs=1e-3)
