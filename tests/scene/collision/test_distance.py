"""Distances of two bodies: never above the truth, near it, and never "free" for rubbish."""

import coal
import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies, program
from builders.scene_builders import random_pose
from coal_shapes import coal_shape

from cellplan.errors import CellplanError
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.transforms import pose
from cellplan.scene.collision.bodies import BodyPoses, CollisionBody, checked_poses, prepare
from cellplan.scene.collision.distance import Reading, first_touching, measure, quick_reading
from cellplan.scene.collision.engine import Engine
from cellplan.scene.collision.hull_cache import convex_hull
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.collision.separation import heights
from cellplan.scene.scene import Scene

EXACT = 1e-4  # [m] promised accuracy of a measured distance
ROUNDING = 1e-9  # [m] coal's own tolerance of 1e-10 and the size of the scene
STATES = 1000  # [-] random states of each pair of shapes
SHAPES: dict[str, Solid] = {
    "box": Box((0.5, 0.2, 0.3)),
    "cylinder": Cylinder(0.15, 0.6),
    "capsule": Capsule(0.1, 0.5),
    "sphere": Sphere(0.2),
}


def between(first: Solid, second: Solid, X_first, X_second) -> Reading:
    engine = Engine((prepare("first", first), prepare("second", second)))
    return measure(engine, (0, 1), checked_poses([X_first[None], X_second[None]]), sample=0)


def rock(seed: int) -> Mesh:
    """A convex mesh with twenty corners."""
    points = np.random.default_rng(seed).normal(size=(20, 3)) * (0.1, 0.15, 0.2)
    loose = Mesh(
        vertices=points,
        faces=np.array([[i, (i + 1) % 20, (i + 2) % 20] for i in range(20)]),
        source="rock",
        is_closed=False,
    )
    return convex_hull(loose)


def horseshoe() -> Mesh:
    """A closed mesh that is not convex: an L of two boxes."""
    low, high = tessellate(Box((0.6, 0.2, 0.1))), tessellate(Box((0.1, 0.2, 0.6)))
    vertices = np.concatenate([low.vertices, high.vertices + np.array([0.35, 0.0, 0.25])])
    return Mesh(
        vertices=vertices, faces=np.concatenate([low.faces, high.faces + len(low.vertices)]), source="L", is_closed=True
    )


def coal_distances(first: Solid, second: Solid, poses: BodyPoses) -> np.ndarray:
    """Second opinion: signed distances by coal at its finest settings."""
    a, b = coal_shape(first), coal_shape(second)
    request = coal.DistanceRequest()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-10, 1000
    return np.array(
        [
            coal.distance(
                a,
                coal.Transform3s(poses.R[0, k], poses.p[0, k]),
                b,
                coal.Transform3s(poses.R[1, k], poses.p[1, k]),
                request,
                coal.DistanceResult(),
            )
            for k in range(poses.p.shape[1])
        ]
    )


def random_states(seed: int, count: int, *, reach: float = 0.5) -> BodyPoses:
    rng = np.random.default_rng(seed)
    return checked_poses([np.array([random_pose(rng, reach=reach) for _ in range(count)]) for _ in range(2)])


@pytest.mark.parametrize("axis", [1, 2])
def test_unit_boxes_three_metres_apart_have_two_metres_between_them(axis: int) -> None:
    place = np.zeros(3)
    place[axis] = 3.0

    reading = between(Box((1.0, 1.0, 1.0)), Box((1.0, 1.0, 1.0)), np.eye(4), pose(place))

    assert not reading.touches
    assert 2.0 - EXACT <= reading.bound <= 2.0


def test_aligned_gripper_fingers_are_measured_right() -> None:
    for gap in (1e-3, 5.5e-3, 0.05, 0.105):
        reading = between(Box((0.02, 0.03, 0.1)), Box((0.02, 0.03, 0.1)), np.eye(4), pose((0.02 + gap, 0.0, 0.0)))
        assert gap - EXACT <= reading.bound <= gap + 1e-12  # rounding of the support functions


@pytest.mark.parametrize("tilt", [0.0, 1e-9, 1e-4, 0.3])
def test_parallel_and_nearly_parallel_cylinders_are_measured_right(tilt: float) -> None:
    first, second = Cylinder(0.1, 1.0), Cylinder(0.05, 0.4)
    X = pose((0.0, 0.3, 0.05), (0.0, tilt, 0.0))  # turned about the line between the axes: the distance stays

    reading = between(first, second, np.eye(4), X)

    assert 0.15 - EXACT <= reading.bound <= 0.15 + 1e-12


def test_box_inside_a_box_touches() -> None:
    assert between(Box((1.0, 1.0, 1.0)), Box((0.1, 0.1, 0.1)), np.eye(4), pose((0.1, 0.0, 0.0))).touches


@pytest.mark.parametrize("inner", [Sphere(0.05), Box((0.05, 0.05, 0.05)), tessellate(Box((0.05, 0.05, 0.05)))])
def test_a_body_wholly_inside_a_closed_mesh_is_found_either_way_round(inner: Solid) -> None:
    outer = tessellate(Box((1.0, 1.0, 1.0)))
    for bodies in ((outer, inner), (inner, outer)):
        engine = Engine([prepare("body", body) for body in bodies])
        at = checked_poses([pose((0.2, 0.1, 0.0))[None]] * 2)
        apart = checked_poses([np.eye(4)[None], pose((0.7, 0.0, 0.0))[None]])

        assert is_inside(engine, (0, 1), at, sample=0)
        assert not is_inside(engine, (0, 1), apart, sample=0)


@pytest.mark.parametrize(
    "X",
    [
        np.full((4, 4), np.nan),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.diag([2.0, 2.0, 2.0, 1.0]),
        pose((np.inf, 0.0, 0.0)),
        pose((0.0, np.nan, 0.0)),
    ],
)
def test_poses_that_are_not_rigid_are_refused(X: np.ndarray) -> None:
    good = np.broadcast_to(np.eye(4), (3, 4, 4))
    bad = good.copy()
    bad[1] = X

    with pytest.raises(CellplanError, match="not finite or not a rigid displacement"):
        checked_poses([good, bad])


def test_height_above_the_floor_is_exact_for_every_shape() -> None:
    rng = np.random.default_rng(0)
    for shape in (*SHAPES.values(), rock(0)):
        around = tessellate(shape, 120).vertices
        for _ in range(20):
            X, ground = random_pose(rng, reach=1.0), random_pose(rng, reach=0.2)
            surface = around @ X[:3, :3].T + X[:3, 3]
            lowest = float(((surface - ground[:3, 3]) @ ground[:3, 2]).min())

            height = heights(shape, X[None, :3, :3], X[None, :3, 3], X_WS=ground)[0]

            assert lowest - 1e-9 <= height <= lowest + 3e-4  # the fine mesh lies round the true shape


@pytest.mark.parametrize(("first", "second"), [(a, b) for a in SHAPES for b in SHAPES if a <= b])
def test_primitives_agree_with_a_second_engine(first: str, second: str) -> None:
    a, b = SHAPES[first], SHAPES[second]
    engine, poses = Engine((prepare("a", a), prepare("b", b))), random_states(len(first) * 31 + len(second), STATES)

    truth = coal_distances(a, b, poses)

    _compare(engine, poses, truth)


@pytest.mark.parametrize("second", [*SHAPES, "rock", "horseshoe"])
@pytest.mark.parametrize("mesh", ["rock", "horseshoe"])
def test_meshes_agree_with_a_second_engine(mesh: str, second: str) -> None:
    meshes = {"rock": rock(3), "horseshoe": horseshoe()}
    a, b = meshes[mesh], SHAPES.get(second) or meshes[second]
    engine, poses = Engine((prepare("a", a), prepare("b", b))), random_states(7, STATES // 5, reach=0.8)

    truth = coal_distances(a, b, poses)

    _compare(engine, poses, truth)


@pytest.mark.slow
def test_the_certificate_is_never_above_a_second_engine_in_many_states() -> None:
    """At least 100,000 pair states: the proved distance is never above the true one, and tight in nearly all."""
    shapes = [*SHAPES.values(), rock(3), rock(4)]
    pairs = [(a, b) for i, a in enumerate(shapes) for b in shapes[i:]]
    states, tight = 0, 0
    for number, (a, b) in enumerate(pairs):
        engine, poses = Engine((prepare("a", a), prepare("b", b))), random_states(1000 + number, 6000, reach=0.8)
        truth = coal_distances(a, b, poses)
        for k in np.flatnonzero(truth > 1e-7):  # on the border both answers are right
            bound = quick_reading(engine, (0, 1), poses, sample=int(k)).bound
            assert bound <= truth[k] + ROUNDING
            tight += bound >= truth[k] - EXACT
            states += 1
    assert states >= 100_000
    assert tight >= 0.98 * states


def _compare(engine: Engine, poses: BodyPoses, truth: np.ndarray) -> None:
    """Touching where the truth is below zero; elsewhere never above it and near it; a quick reading never above it."""
    for k, distance in enumerate(truth):
        if abs(distance) < 1e-7:
            continue  # on the border both answers are right
        cheap, exact = quick_reading(engine, (0, 1), poses, sample=k), measure(engine, (0, 1), poses, sample=k)
        assert exact.touches == (distance <= 0.0), f"state {k}, distance {distance}"
        if distance > 0.0:
            assert cheap.bound <= distance + ROUNDING
            assert distance - EXACT <= exact.bound <= distance + ROUNDING


def test_an_engine_can_be_sent_to_another_process() -> None:
    import pickle

    bodies: list[CollisionBody] = [prepare("a", Sphere(0.1)), prepare("b", rock(1))]
    engine = Engine(bodies)
    poses = checked_poses([np.eye(4)[None], pose((1.0, 0.0, 0.0))[None]])
    before = measure(engine, (0, 1), poses, sample=0).bound

    assert measure(pickle.loads(pickle.dumps(engine)), (0, 1), poses, sample=0).bound == before  # noqa: S301


def test_flat_meshes_are_bodies_too() -> None:
    sheet = Mesh(
        vertices=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        faces=np.array([[0, 1, 2]]),
        source="sheet",
        is_closed=False,
    )

    reading = between(sheet, Sphere(0.1), np.eye(4), pose((0.2, 0.2, 0.5)))

    assert 0.4 - EXACT <= reading.bound <= 0.4


def test_first_touching_is_none_or_a_pair_that_touches() -> None:
    answers = set()
    for seed in range(8):
        scene = Scene.from_cell(cell_with_bodies(seed))
        poses = scene.body_poses(program(scene.cell, seed, samples=6, stride=0.5))
        pairs = scene.solid_pairs[np.random.default_rng(seed).permutation(len(scene.solid_pairs))[: 4 + 6 * seed]]
        for k in range(6):
            touching = [
                measure(scene.engine, (int(a), int(b)), poses, sample=k).touches
                or is_inside(scene.engine, (int(a), int(b)), poses, sample=k)
                for a, b in pairs
            ]

            place = first_touching(scene.engine, pairs, poses, sample=k)

            assert place == (touching.index(True) if any(touching) else None)
            answers.add(place is None)
    assert answers == {True, False}
