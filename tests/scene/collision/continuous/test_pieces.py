"""Bodies that are not convex, taken apart: the pieces cover the whole, and prove what the whole does."""

import numpy as np
import pytest
from builders.scene_builders import arm_model, make_cell, placed, random_pose, thing

from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_search import SolidSearch
from cellplan.certify.pair_state import PairState
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Mesh, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.collision.bodies import checked_poses, prepare
from cellplan.scene.collision.continuous.pieces import can_be_split, read_piece, split
from cellplan.scene.collision.distance import Reading, measure
from cellplan.scene.collision.engine import Engine
from cellplan.scene.scene import Scene

EXACT = 1e-4  # [m] promised accuracy of a smallest distance


def bowl() -> Mesh:
    """A closed half shell, open side up: its hull is full where the bowl is hollow."""
    outer = tessellate(Capsule(0.3, 0.0), 40)
    top = outer.vertices[:, 2] > 0.0
    moved = outer.vertices.copy()
    moved[top] = outer.vertices[top] * np.array([0.85, 0.85, -0.85])
    return Mesh(vertices=moved, faces=outer.faces, source="bowl", is_closed=True)


def test_pieces_cover_the_surface_and_only_bodies_with_dents_are_taken_apart() -> None:
    body, ball = prepare("bowl", bowl()), prepare("box", Box((0.1, 0.1, 0.1)))
    pieces, is_first = split(Engine((body, ball)), (0, 1))

    assert is_first
    assert can_be_split(body)
    assert not can_be_split(ball)
    assert sum(len(piece.core.faces) for piece in pieces.bodies[1:]) == len(body.core.faces)
    corners = {
        tuple(corner) for piece in pieces.bodies[1:] for corner in piece.core.vertices[piece.core.faces].reshape(-1, 3)
    }
    assert corners == {tuple(corner) for corner in body.core.vertices[body.core.faces].reshape(-1, 3)}


def read_by_pieces(engine: Engine, pair: tuple[int, int], X: tuple[Array, Array]) -> list[Reading]:
    """Readings of the pieces of a body and another one, finer and finer where they are not exact; poses by the pair."""
    pieces, is_first = split(engine, pair)
    whole, other = X if is_first else X[::-1]
    poses = checked_poses([other[None], *[whole[None]] * (len(pieces.bodies) - 1)])
    readings = []
    for k in range(1, len(pieces.bodies)):
        ends = (k, 0) if is_first else (0, k)
        reading, _ = read_piece(pieces, ends, poses, sample=0, goal=np.inf)
        is_done = reading.touches or reading.is_exact
        readings += [reading] if is_done else read_by_pieces(pieces, ends, X)
    return readings


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_the_nearest_piece_is_as_near_as_the_body(order: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    engine = Engine((prepare("bowl", bowl()), prepare("stick", Capsule(0.02, 0.2))))
    for _ in range(10):
        X = pose(), random_pose(rng, reach=0.4)
        truth = measure(engine, (0, 1), checked_poses([X[0][None], X[1][None]]), sample=0)

        readings = read_by_pieces(engine, order, X if order[0] == 0 else X[::-1])

        assert any(reading.touches for reading in readings) == truth.touches
        if not truth.touches:
            assert min(reading.bound for reading in readings) == pytest.approx(truth.bound, abs=EXACT / 2)


def test_a_large_piece_proves_no_more_than_is_true_and_is_not_measured_exactly() -> None:
    engine = Engine((prepare("bowl", bowl()), prepare("stick", Capsule(0.02, 0.2))))
    pieces, _ = split(engine, (0, 1))
    rng = np.random.default_rng(2)
    for _ in range(20):
        X = random_pose(rng, reach=0.6)
        truth = measure(engine, (0, 1), checked_poses([pose()[None], X[None]]), sample=0)
        poses = checked_poses([X[None], *[pose()[None]] * (len(pieces.bodies) - 1)])

        readings = [read_piece(pieces, (k, 0), poses, sample=0, goal=np.inf)[0] for k in range(1, len(pieces.bodies))]

        assert not any(reading.is_exact for reading in readings if not reading.touches)
        assert min(reading.bound for reading in readings) <= truth.bound + EXACT / 2


def test_the_pieces_of_a_body_are_made_once_for_all_its_pairs() -> None:
    engine = Engine((prepare("bowl", bowl()), prepare("stick", Capsule(0.02, 0.2)), prepare("ball", Sphere(0.1))))

    stick_pieces, ball_pieces = split(engine, (0, 1))[0], split(engine, (2, 0))[0]

    assert all(a is b for a, b in zip(stick_pieces.bodies[1:], ball_pieces.bodies[1:], strict=True))


def stirring() -> tuple[Scene, Array, tuple[int, int]]:
    """An arm whose hand moves about in a bowl without touching it."""
    cell = make_cell(
        placed("arm", arm_model()),
        things=(thing("bowl", bowl(), pose((0.68, 0.0, 1.1))),),
        checks=ChecksEntry(clearance_mm=0.0, contact_zone_mm=0.0),
    )
    scene = Scene.from_cell(cell)
    index = {body.name: place for place, body in enumerate(scene.bodies)}
    t = np.linspace(0.0, 2.0, 300)
    q = np.zeros((300, 6))
    q[:, 0], q[:, 1], q[:, 5] = 0.06 * np.sin(4.0 * t), 0.02 * np.sin(7.0 * t), 3.0 * t
    return scene, q, (index["arm/hand"], index["bowl"])


def test_a_search_by_pieces_finds_the_smallest_distance_with_few_questions() -> None:
    scene, q, pair = stirring()
    poses = scene.body_poses(q)
    brute = [measure(scene.engine, pair, poses, sample=k) for k in range(len(q))]
    before = scene.engine.queries.distances

    search = SolidSearch(scene.engine, pair, StraightMotion.of_cell(scene, LeverArms(scene, q), q), state=PairState())
    search.run(np.inf)

    smallest = min(reading.bound for reading in brute)
    assert not search.state.touches
    assert not search.state.unproved
    assert smallest > 0.01
    assert search.low.min() <= smallest + EXACT / 2
    assert smallest - EXACT <= search.low.min()  # the steps are short
    assert scene.engine.queries.distances - before < len(q)
