"""What a certificate says of a motion does not depend on where the cell stands or how its rows are written."""

from dataclasses import replace

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies, program
from builders.scene_builders import body, demanding, displaced, joint, make_cell, placed, slide_model, thing

from cellplan.certify.bound import Bound, PairBound
from cellplan.certify.certify import certify
from cellplan.certify.pair_state import PairState
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.pairs import Rule
from cellplan.scene.scene import Scene

EXACT = 1e-4  # [m] a smallest distance is known to this
X = pose((0.7, -1.2, 0.4), (0.3, -0.8, 2.0))


def smallest(bound: Bound) -> list[float]:
    """Smallest proved distance of each class in [m]."""
    classes = [bound.of_class(kind) for kind in ClearanceClass]
    return [min(pair.proved for pair in pairs if pair.keeps_clearance) for pairs in classes if pairs]


def wandering(seed: int) -> tuple[Scene, Array]:
    scene = Scene.from_cell(cell_with_bodies(seed, joints=2))
    return scene, program(scene.cell, seed, samples=3, stride=0.1)


@pytest.mark.parametrize("seed", [2, 5])
def test_a_motion_has_the_same_distances_elsewhere_backwards_and_with_more_rows(seed: int) -> None:
    scene, q = wandering(seed)
    finer = np.stack([np.interp(np.arange(0.0, 2.1, 0.5), np.arange(3), column) for column in q.T], axis=1)
    elsewhere = Scene.from_cell(displaced(scene.cell, X))

    here = smallest(certify(scene, q, with_curves=False))

    assert max(here) > 0.01
    for other_scene, rows in ((elsewhere, q), (scene, q[::-1]), (scene, finer)):
        other = certify(other_scene, rows, with_curves=False)
        np.testing.assert_allclose(smallest(other), here, atol=EXACT)


def test_the_nearest_points_of_two_balls_lie_on_the_line_of_their_centres() -> None:
    post = np.array([0.5, 0.2, 0.15])
    cell = make_cell(
        placed("ball", slide_model(Sphere(0.1))),
        things=(thing("post", Sphere(0.05), pose(tuple(post))),),
        checks=ChecksEntry(clearance_mm=1.0, contact_zone_mm=0.0),
    )
    gap = float(np.hypot(0.2, 0.15)) - 0.15

    for place in (np.eye(4), X):
        bound = certify(Scene.from_cell(displaced(cell, place)), np.linspace(0.0, 0.9, 8)[:, None])
        (pair,) = [pair for pair in bound.pairs if bound.names(pair) == ("ball/block", "post")]
        points = bound.nearest_points(pair)
        assert points is not None
        ball = np.array([0.9 * pair.at / 7.0, 0.0, 0.0])
        along = (post - ball) / np.linalg.norm(post - ball)
        expected = np.array([ball + 0.1 * along, post - 0.05 * along]) @ place[:3, :3].T + place[:3, 3]
        np.testing.assert_allclose(points, expected, atol=5e-4)  # of a ball all points near the nearest are as near
        assert gap - EXACT <= pair.proved <= gap


def test_a_box_that_passes_a_box_keeps_the_gap_of_their_faces_while_they_overlap() -> None:
    cell = make_cell(
        placed("box", slide_model(Box((0.2, 0.2, 0.2)))),
        things=(thing("post", Box((0.3, 0.1, 0.4)), pose((1.0, 0.25, 0.0))),),
        checks=ChecksEntry(clearance_mm=50.0, contact_zone_mm=0.0),
    )
    x = np.linspace(0.0, 2.0, 9)

    bound = certify(Scene.from_cell(cell), x[:, None])

    (pair,) = [pair for pair in bound.pairs if bound.names(pair) == ("box/block", "post")]
    gaps = np.maximum(np.abs(x - 1.0) - 0.25, 0.0)  # [m] along the rail from face to face
    nearest = np.hypot(np.minimum(gaps[:-1], gaps[1:]), 0.1)
    nearest[(x[:-1] < 1.25) & (x[1:] > 0.75)] = 0.1
    assert np.all(pair.low <= nearest + 1e-9)
    assert pair.lowest >= 0.1 - EXACT
    assert bound.is_met


@pytest.mark.parametrize(
    ("rule", "known", "is_met", "is_open"),
    [
        (Rule.CLEARANCE, {"distance": 0.03}, True, False),
        (Rule.CLEARANCE, {"distance": 0.0199}, False, False),
        (Rule.CLEARANCE, {"distance": 0.03, "touches": [2.0]}, False, False),
        (Rule.CLEARANCE, {"distance": 0.03, "unproved": [2.0]}, False, True),
        (Rule.PROCESS, {"distance": 0.0199}, True, False),
        (Rule.PROCESS, {"distance": 0.03, "unproved": [2.0]}, False, True),
        (Rule.PROCESS, {"distance": 0.0, "touches": [2.0]}, False, False),
    ],
)
def test_a_demand_is_met_by_what_is_proved_alone(
    rule: Rule, known: dict[str, object], is_met: bool, is_open: bool
) -> None:
    scene, _ = wandering(3)
    pair = replace(scene.pairs[0], rule=rule, demand=0.02)
    state = PairState(demand=0.02, **known)  # type: ignore[arg-type]
    proved = 0.0 if "unproved" in known else state.distance

    bound = PairBound.of(0, pair, state, low=np.array([proved, 1.0]), lowest=proved, span=None)

    assert (bound.is_met, bound.is_open) == (is_met, is_open)
    assert bound.proved <= min(bound.lowest, bound.nearest)


@pytest.mark.parametrize("place", [np.eye(4), X])
def test_an_arm_that_stretches_out_and_draws_back_within_one_step_is_as_near_as_when_it_is_stretched(
    place: Array,
) -> None:
    """Its ball is at one place in both rows, and in between 79 mm farther out, where it all but reaches the post."""
    joints = (joint("shoulder", -1), joint("elbow", 0, point=(0.5, 0.0, 0.0)))
    ball = body("ball", 1, shape=Sphere(0.05), at=(1.0, 0.0, 0.0))
    model = RobotModel(name="arm", source="test", joints=joints, flange_link=1, X_BF=np.eye(4), bodies=(ball,))
    gap, checks = 0.02, ChecksEntry(clearance_mm=10.0, contact_zone_mm=0.0)
    post = thing("post", Sphere(0.05), pose((1.1 + gap, 0.0, 0.0)))
    scene = Scene.from_cell(displaced(make_cell(placed("arm", model), things=(post,), checks=checks), place))
    q = np.array([[-0.4, 0.8], [0.4, -0.8]])

    bound = certify(scene, q)

    assert gap - EXACT <= bound.minimum <= gap
    for demand, is_met in ((gap - EXACT, True), (gap + 0.01, False)):
        assert certify(demanding(scene, demand), q, with_minimum=False).is_met is is_met
