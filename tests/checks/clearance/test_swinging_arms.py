"""Clearance of arms that swing about each other: the same as asking for every pair, at the samples and between them."""

import numpy as np
import pytest
from builders.scene_builders import (
    arm_model,
    displaced,
    floor,
    held_part,
    make_cell,
    no_tool,
    placed,
    random_pose,
    schedule,
    thing,
)

from cellplan.checks.clearance.check import check_clearance
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Mesh
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.cell import Cell
from cellplan.model.report.report import Check, ClearanceClass, ClearanceReport
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.collision.bodies import BodyPoses
from cellplan.scene.collision.distance import measure
from cellplan.scene.collision.overlap.containment import is_inside
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

MORE = [pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 5)]  # motions drawn like the first ones
EXACT = 1e-4  # [m] promised accuracy of a minimum


def checked(cell: Cell, q: Array) -> tuple[ClearanceReport, tuple[Check, ...]]:
    return check_clearance(Scene.from_cell(cell), schedule(len(q)), q)


def two_arms() -> Cell:
    wedge = tessellate(Box((0.2, 0.1, 0.3)))
    arms = (
        placed("a", arm_model(), tool=no_tool()),
        placed("b", arm_model(), base=pose((1.5, 0.2, 0.0), (0.0, 0.0, np.pi))),
    )
    post = thing(
        "post", Mesh(vertices=wedge.vertices, faces=wedge.faces, source="wedge", is_closed=True), pose((0.7, -0.6, 0.8))
    )
    part = held_part(Capsule(0.05, 0.2), "b", pose((0.0, 0.0, -0.16)))
    return make_cell(
        *arms, part=part, things=(floor(), post), checks=ChecksEntry(clearance_mm=0.0, contact_zone_mm=0.0)
    )


def swinging(seed: int, samples: int) -> Array:
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, samples)[:, None]
    return rng.uniform(-0.5, 0.5, 12) + rng.uniform(-1.0, 1.0, 12) * np.sin(3.0 * t + rng.uniform(0.0, 3.0, 12))


def interpolated(scene: Scene, q: Array, at: float) -> BodyPoses:
    """Poses at an instant counted in samples."""
    k = min(int(at), len(q) - 2)
    return scene.body_poses((q[k] + (at - k) * (q[k + 1] - q[k]))[None])


def distance_of(scene: Scene, pair: ScenePair, poses: BodyPoses, k: int = 0) -> float:
    """Distance of one pair at one sample, zero when it touches."""
    if scene.bodies[pair.second].name == "floor":
        return max(0.0, float(scene.ground_heights(pair, poses)[k]))
    reading = measure(scene.engine, (pair.first, pair.second), poses, sample=k)
    is_hit = reading.touches or is_inside(scene.engine, (pair.first, pair.second), poses, sample=k)
    return 0.0 if is_hit else reading.bound


@pytest.mark.parametrize("seed", [0, *MORE])
def test_every_class_agrees_with_a_brute_force_search(seed: int) -> None:
    """No sample is nearer than the minimum; at its instant the pair is as near as it says, to 0.1 mm."""
    scene, q = Scene.from_cell(two_arms()), swinging(seed, 80)
    report, _ = check_clearance(scene, schedule(80), q)

    poses = scene.body_poses(q)
    smallest = dict.fromkeys(ClearanceClass, np.inf)
    touching: set[tuple[str, str]] = set()
    for pair in scene.pairs:
        distances = [distance_of(scene, pair, poses, k) for k in range(80)]
        if min(distances) == 0.0:
            touching.add(scene.names(pair))
        if pair.rule is Rule.CLEARANCE or min(distances) == 0.0:
            smallest[pair.clearance_class] = min(smallest[pair.clearance_class], *distances)

    by_name = {scene.names(pair): pair for pair in scene.pairs}
    assert {contact.pair for contact in report.contacts} >= touching
    for contact in report.contacts:
        assert distance_of(scene, by_name[contact.pair], interpolated(scene, q, 79 * contact.first_s)) == 0.0
    for kind, at_samples in smallest.items():
        result = report.minima[kind]
        assert result.certified
        assert result.minimum <= at_samples + EXACT / 2
        there = distance_of(scene, by_name[result.pair], interpolated(scene, q, 79 * result.at_s))
        assert result.minimum <= there + 1e-9 <= result.minimum + EXACT  # rounding of the instant


@pytest.mark.parametrize("seed", [0, *MORE[:2]])
def test_no_instant_between_the_samples_is_nearer_than_the_minimum(seed: int) -> None:
    scene, q = Scene.from_cell(two_arms()), swinging(seed, 12)  # up to 0.25 rad from sample to sample
    report, _ = check_clearance(scene, schedule(12), q)
    by_name = {scene.names(pair): pair for pair in scene.pairs}
    free = [kind for kind in ClearanceClass if report.minima[kind].minimum]

    for kind in free:
        pair, at = by_name[report.minima[kind].pair], 11 * report.minima[kind].at_s
        for shift in np.linspace(-0.5, 0.5, 101):
            near = interpolated(scene, q, float(np.clip(at + shift, 0.0, 11.0)))
            assert distance_of(scene, pair, near) >= report.minima[kind].minimum - 1e-9
    rng = np.random.default_rng(seed)
    for at in rng.uniform(0.0, 11.0, 60):
        poses = interpolated(scene, q, at)
        for pair in scene.pairs:
            if pair.clearance_class in free and pair.rule is Rule.CLEARANCE:
                assert distance_of(scene, pair, poses) >= report.minima[pair.clearance_class].minimum - 1e-9


def test_points_of_a_minimum_lie_on_its_bodies_as_far_apart_as_it_says() -> None:
    scene, q = Scene.from_cell(two_arms()), swinging(0, 80)
    report, _ = check_clearance(scene, schedule(80), q)
    measured = [value for value in report.minima.values() if value.minimum]

    assert measured
    for entry in measured:
        p, q_ = np.array(entry.points)
        assert entry.minimum - 4e-5 <= np.linalg.norm(q_ - p)  # points of round bodies lie on fine prisms round them
        assert np.linalg.norm(q_ - p) <= entry.minimum + EXACT


def test_the_closest_pairs_are_listed_nearest_first() -> None:
    scene, q = Scene.from_cell(two_arms()), swinging(1, 80)
    report, _ = check_clearance(scene, schedule(80), q)
    distances = [close.distance for close in report.closest]
    poses = scene.body_poses(q)
    listed = {close.pair for close in report.closest}

    assert len(report.closest) == 10
    assert distances == sorted(distances)
    others = [pair for pair in scene.pairs if scene.names(pair) not in listed and pair.rule is Rule.CLEARANCE]
    for pair in others:
        assert min(distance_of(scene, pair, poses, k) for k in range(0, 80, 4)) >= distances[-1] - EXACT


def test_moving_the_whole_cell_changes_nothing() -> None:
    cell, q = two_arms(), swinging(1, 200)
    moved = displaced(cell, random_pose(np.random.default_rng(3), reach=4.0))

    here, checks_here = checked(cell, q)
    there, checks_there = checked(moved, q)

    assert here.contacts == there.contacts
    assert here.exclusions == there.exclusions
    assert [check.passed for check in checks_here] == [check.passed for check in checks_there]
    for kind in ClearanceClass:
        assert here.minima[kind].minimum == pytest.approx(there.minima[kind].minimum, abs=EXACT)


def test_long_motions_are_worked_through_in_pieces_with_the_same_result(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, q = Scene.from_cell(two_arms()), swinging(2, 300)
    whole, _ = check_clearance(scene, schedule(300), q)

    monkeypatch.setattr("cellplan.certify.certify.MAX_SAMPLES", 64)
    pieces, _ = check_clearance(scene, schedule(300), q)

    assert pieces.contacts == whole.contacts
    for kind in ClearanceClass:
        assert pieces.minima[kind].minimum == pytest.approx(whole.minima[kind].minimum, abs=EXACT)


def test_progress_rises_to_one() -> None:
    reported: list[float] = []

    check_clearance(
        Scene.from_cell(two_arms()), schedule(50), swinging(0, 50), progress=lambda _, share: reported.append(share)
    )

    assert reported == sorted(reported)
    assert reported[-1] == 1.0
