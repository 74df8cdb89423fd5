"""The check of moves says free only where the certificate does, and misses nothing that keeps some more distance."""

import numpy as np
import pytest
from builders.scene_builders import demanding, held_part, make_cell, placed, slide_model, thing
from builders.transfer_cells import CHECKS, arm, scene_of

from cellplan.certify.certify import certify
from cellplan.geometry.shapes import Box, Cylinder, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.planning.transfer.blended_lines import BlendedLine, joint_path
from cellplan.planning.transfer.move_check import MoveCheck, Others
from cellplan.scene.scene import Scene

RESERVE = 0.002  # [m]
LOWEST, HIGHEST = np.radians([[-80.0, -60.0, -10.0, -90.0, 0.0, -90.0], [80.0, 30.0, 60.0, 90.0, 90.0, 90.0]])


@pytest.fixture(scope="module")
def among_posts() -> Scene:
    posts = [thing(f"post{k}", Cylinder(0.06, 2.0), pose((0.8, y, 1.0))) for k, y in enumerate((-0.5, 0.5))]
    return scene_of(arm("kuka", "kuka_kr6"), things=[*posts, thing("ball", Sphere(0.15), pose((0.7, 0.0, 1.3)))])


def straight(first: Array, second: Array) -> Array:
    return first + np.linspace(0.0, 1.0, 33)[:, None] * (second - first)


def test_moves_are_free_where_the_certificate_says_so(among_posts: Scene) -> None:
    rng = np.random.default_rng(3)
    check = MoveCheck(among_posts, "kuka", Others.moving(among_posts, np.zeros((1, 6))), reserve=RESERVE)
    verdicts = []
    for _ in range(10):
        middle, move = rng.uniform(LOWEST, HIGHEST), 0.3 * rng.normal(size=6)
        ends = middle - move, middle + move
        is_free, q = check.is_free(*ends), straight(*ends)
        verdicts.append(is_free)
        # what is refused lacks the reserve at a sample: it may keep the demand, but not much more
        demand = CHECKS.clearance_mm.si if is_free else CHECKS.clearance_mm.si + 2.0 * RESERVE
        assert certify(demanding(among_posts, demand), q, with_minimum=False).is_met is is_free

    assert 2 <= sum(verdicts) <= 8


def test_what_a_holder_carries_moves_with_it() -> None:
    part = held_part(Box((0.1, 0.6, 0.1)), "slide", np.eye(4))
    post = thing("post", Sphere(0.05), pose((0.5, 0.3, 0.0)))
    holder = placed("slide", slide_model(Sphere(0.05)))
    scenes = [Scene.from_cell(make_cell(holder, part=held, things=(post,), checks=CHECKS)) for held in (part, None)]

    free = [
        MoveCheck(scene, "slide", Others.moving(scene, np.zeros((1, 1))), reserve=RESERVE).is_free(
            np.array([0.0]), np.array([1.0])
        )
        for scene in scenes
    ]

    assert free == [False, True]


def test_another_robot_counts_where_it_is_at_that_time() -> None:
    robots = [placed("a", slide_model(Sphere(0.1))), placed("b", slide_model(Sphere(0.1), axis=(0.0, 1.0, 0.0)))]
    scene = Scene.from_cell(make_cell(*robots, checks=CHECKS))
    times = np.linspace(0.0, 1.0, 401)
    crossing = np.stack([np.full(401, 9.0), 2.0 * times - 1.0], axis=1)  # b passes the origin at half time
    check = MoveCheck(scene, "a", Others.moving(scene, crossing), reserve=RESERVE)

    at_once = check.are_free((2.0 * times - 1.0)[:, None], np.arange(401))
    later = check.are_free(np.maximum(-1.0, 4.0 * times - 3.0)[:, None], np.arange(401))

    assert (at_once, later) == (False, True)
    assert check.refused == {("a/block", "b/block"): 1}


def test_a_blended_line_has_continuous_accelerations_and_stays_in_its_triangles() -> None:
    via = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [3.0, 2.0]])
    line = BlendedLine.through(slice(0, 2), np.array([0.0, 1.0, 3.0, 4.0]), via)
    path = joint_path(via[0], [line])
    inner = path.breaks[1:-1]

    for derivative in range(3):
        before, after = path.at(inner, derivative), path.at(inner + 2e-9, derivative)
        np.testing.assert_allclose(before, after, atol=1e-6)
        for end in path.breaks[[0, -1]]:
            rates = path.at(np.array([end]), derivative)[0]
            assert derivative == 0 or np.abs(rates).max() < 1e-9
    assert np.array_equal(path.at(path.breaks[[0, -1]]), via[[0, -1]])
    q = path.at(np.linspace(0.0, path.end, 500))
    corners = (q[:, 0] <= 1.0 + 1e-12) | (q[:, 1] >= 1.0 - 1e-12)  # right of the second edge only above its middle
    assert corners.all()
    assert np.all((q >= -1e-12) & (q <= [3.0 + 1e-12, 2.0 + 1e-12]))
