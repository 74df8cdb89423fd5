"""The entry of the certificate: the verdict alone, the minimum, and a result that nobody can change."""

from dataclasses import FrozenInstanceError

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies
from builders.scene_builders import body, demanding, floor, joint, make_cell, placed, slide_model, thing

from cellplan.certify.certify import certify
from cellplan.geometry.shapes import Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.report.report import ClearanceClass
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.scene import Scene

GAP = 0.05  # [m] that the ball keeps from the post where it passes it
EXACT = 1e-4  # [m] a smallest distance is known to this
STEP = 0.007  # [m] from row to row: the ball passes the post between two rows


def passing_ball(gap: float = GAP) -> tuple[Scene, Array]:
    """A ball that slides along x past another one that stands beside its path, and the rows of its motion."""
    post = thing("post", Sphere(0.1), pose((0.5, 0.2 + gap, 0.0)))
    cell = make_cell(
        placed("ball", slide_model(Sphere(0.1))),
        things=(post,),
        checks=ChecksEntry(clearance_mm=10.0, contact_zone_mm=0.0),
    )
    return Scene.from_cell(cell), STEP * np.arange(150)[:, None]


def wandering(scene: Scene, samples: int) -> Array:
    rng = np.random.default_rng(7)
    steps = rng.normal(scale=0.004, size=(samples, scene.cell.joint_count))
    return rng.uniform(-1.0, 1.0, scene.cell.joint_count) + np.cumsum(steps, axis=0)


def test_the_minimum_of_two_passing_balls_is_the_gap_between_them() -> None:
    scene, q = passing_ball()

    bound = certify(scene, q)

    assert GAP - EXACT <= bound.minimum <= GAP
    (pair,) = [pair for pair in bound.pairs if bound.names(pair) == ("ball/block", "post")]
    assert pair.proved == bound.minimum
    assert STEP * pair.at == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(("demand", "is_met"), [(0.0, True), (GAP - EXACT, True), (GAP + 1e-6, False), (0.2, False)])
@pytest.mark.parametrize("with_minimum", [True, False])
def test_a_demand_is_kept_up_to_the_gap(demand: float, is_met: bool, with_minimum: bool) -> None:
    scene, q = passing_ball()

    assert certify(demanding(scene, demand), q, with_minimum=with_minimum).is_met is is_met


@pytest.mark.parametrize("with_minimum", [True, False])
def test_bodies_that_touch_keep_no_demand(with_minimum: bool) -> None:
    scene, q = passing_ball(gap=-0.01)

    bound = certify(demanding(scene, 0.0), q, with_minimum=with_minimum)

    assert not bound.is_met
    assert bound.minimum == 0.0


@pytest.mark.parametrize("seed", [1, 2])
def test_the_verdict_alone_is_that_of_the_whole_search_with_fewer_queries(seed: int) -> None:
    cell = cell_with_bodies(seed)
    q = wandering(Scene.from_cell(cell), 200)
    whole = Scene.from_cell(cell)
    bound = certify(whole, q)
    is_free = not any(pair.touches for pair in bound.pairs)

    for demand in (0.5 * bound.minimum, 2.0 * bound.minimum + 0.01):
        scene = Scene.from_cell(cell)
        verdict = certify(demanding(scene, demand), q, with_minimum=False).is_met
        assert verdict is (is_free and demand <= bound.minimum)
        assert scene.engine.queries.distances < whole.engine.queries.distances


def test_nothing_is_claimed_of_blocks_after_the_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellplan.certify.certify.MAX_SAMPLES", 16)
    scene, q = passing_ball()

    bound = certify(demanding(scene, 0.2), q, with_minimum=False)

    assert not bound.is_met
    assert np.all(np.isneginf(bound.low[:, -1]))
    assert np.all(np.isfinite(bound.low[:, 0]))


def test_a_result_cannot_be_changed() -> None:
    bound = certify(*passing_ball())

    with pytest.raises(FrozenInstanceError):
        bound.pairs[0].distance = 1.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        bound.low[0, 0] = 1.0


def test_every_pair_of_a_class_is_bounded() -> None:
    scene, q = passing_ball()
    bound = certify(scene, q)
    curves = {kind: bound.lowest_bounds(bound.of_class(kind)) for kind in ClearanceClass if bound.of_class(kind)}

    assert ClearanceClass.ENVIRONMENT in curves
    for kind, curve in curves.items():
        assert curve.min() == min(pair.lowest for pair in bound.of_class(kind))


def test_the_lowest_point_of_a_swing_above_the_floor_is_found_between_two_samples() -> None:
    """A ball on an arm of 0.6 m about a horizontal axis at 1 m: lowest where the arm hangs, in the middle of a step."""
    swing = RobotModel(
        name="swing",
        source="test",
        joints=(joint("s", -1, axis=(0.0, 1.0, 0.0), point=(0.0, 0.0, 1.0)),),
        flange_link=0,
        X_BF=np.eye(4),
        bodies=(body("ball", 0, shape=Sphere(0.05), at=(0.0, 0.0, 0.4)),),
    )
    cell = make_cell(
        placed("arm", swing), things=(floor(),), checks=ChecksEntry(clearance_mm=300.0, contact_zone_mm=0.0)
    )
    q = np.array([[-0.9], [-0.5], [-0.1], [0.3], [0.7]])

    bound = certify(demanding(Scene.from_cell(cell), 0.3), q)

    (pair,) = [pair for pair in bound.pairs if bound.names(pair) == ("arm/ball", "floor")]
    assert 0.35 - EXACT <= pair.lowest <= 0.35
    assert pair.at == pytest.approx(2.25, abs=0.1)
