"""Clearance of a motion: contacts to the sample, minima to 0.1 mm, tools at work on the part, and plain verdicts."""

from dataclasses import replace

import numpy as np
import pytest
from scene_builders import (
    arm_model,
    body,
    displaced,
    fixed_part,
    floor,
    held_part,
    make_cell,
    no_tool,
    placed,
    random_pose,
    schedule,
    slide_model,
    thing,
    work,
)

from cellplan.checks.clearance import check_clearance
from cellplan.collision.bodies import BodyPoses
from cellplan.collision.inside import is_inside
from cellplan.collision.measure import measure
from cellplan.geometry.shapes import Box, Capsule, Cylinder, Mesh, Solid, Sphere
from cellplan.geometry.tessellation import tessellate
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell import Cell, CheckSettings, Robot, Tool
from cellplan.model.report import Check, ClearanceClass, ClearanceReport
from cellplan.scene.pairs import Rule, ScenePair
from cellplan.scene.scene import Scene

EXACT = 1e-4  # [m] promised accuracy of a minimum


def checked(cell: Cell, q: Array, *tasks, duration: float = 1.0) -> tuple[ClearanceReport, tuple[Check, ...]]:
    return check_clearance(Scene.from_cell(cell), schedule(len(q), *tasks, duration=duration), q)


def drill(shape: Solid, *, back: float, tip: float) -> Robot:
    """A tool that slides along -z; its solid's middle is ``back`` above the tip, the tip at height ``tip``."""
    tool = Tool(
        X_FT=pose((0.0, 0.0, 0.0), (np.pi, 0.0, 0.0)), bodies=(body("tool", 0, shape=shape, at=(0.0, 0.0, back)),)
    )
    model = replace(slide_model(Sphere(0.01), axis=(0.0, 0.0, -1.0)), bodies=())
    return placed("drill", model, base=pose((0.0, 0.0, tip)), tool=tool)


def failed(checks: tuple[Check, ...], name: str) -> list[str]:
    return [check.message for check in checks if check.name == name and not check.passed]


def test_contacts_are_found_to_the_sample_and_named_with_their_time() -> None:
    sliders = (
        placed("a", slide_model(Box((0.1, 0.1, 0.1))), base=pose((-0.5, 0.0, 0.0))),
        placed("b", slide_model(Box((0.1, 0.1, 0.1)))),
    )
    x = np.linspace(0.0, 1.0, 1001)

    report, checks = checked(make_cell(*sliders), np.stack([x, 0.0 * x], axis=1))

    assert [(c.pair, c.is_allowed) for c in report.contacts] == [(("a/block", "b/block"), False)]
    assert report.contacts[0].first_s == pytest.approx(0.4, abs=1.1e-3)  # the sample of the first touch itself
    assert report.contacts[0].last_s == pytest.approx(0.6, abs=1.1e-3)
    minimum = report.minima[ClearanceClass.ROBOT_ROBOT]
    assert (minimum.minimum, minimum.pair, minimum.certified) == (0.0, ("a/block", "b/block"), True)
    assert minimum.at_s == report.contacts[0].first_s
    first, last = report.contacts[0].first_s, report.contacts[0].last_s
    assert failed(checks, "collision") == [f"collision: a/block touches b/block from {first:.3f} s to {last:.3f} s"]
    assert failed(checks, "clearance") == [
        f"clearance robot_robot: a/block to b/block 0.0 mm at {first:.3f} s, required 5.0 mm"
    ]


def test_a_touch_at_a_single_sample_is_found() -> None:
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-1.0, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01))),
    )
    q = np.zeros((1001, 2))
    q[617, 0] = 1.0

    report, checks = checked(make_cell(*sliders), q)

    assert [(c.first_s, c.last_s) for c in report.contacts] == [(0.617, 0.617)]
    assert failed(checks, "collision") == ["collision: a/block touches b/block at 0.617 s"]


def test_too_little_clearance_names_pair_instant_and_amount() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))
    x = 0.39675 * np.sin(np.pi * np.linspace(0.0, 1.0, 1001))  # nearest at 0.5 s: 3.25 mm, printed as 3.2

    report, checks = checked(make_cell(slider, part=part), x[:, None])

    assert report.minima[ClearanceClass.PART].minimum == pytest.approx(0.00325, abs=EXACT)
    assert report.minima[ClearanceClass.PART].minimum <= 0.00325 + 1e-12  # rounding of the poses
    assert failed(checks, "collision") == []
    assert report.minima[ClearanceClass.PART].at_s == pytest.approx(0.5, abs=0.006)  # where it is 0.05 mm more
    assert failed(checks, "clearance")[0].startswith("clearance part: kuka/block to part 3.2 mm at ")
    assert failed(checks, "clearance")[0].endswith(" s, required 5.0 mm")
    assert report.minima[ClearanceClass.SELF].minimum is None


def test_enough_clearance_passes_every_check() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))

    report, checks = checked(make_cell(slider, part=part), np.linspace(0.0, 0.39, 50)[:, None])

    assert all(check.passed for check in checks)
    assert {(check.name, check.subject) for check in checks} == {("collision", "part"), ("clearance", "part")}
    assert report.contacts == ()


def test_curves_hold_both_ends_and_the_minimum_and_are_kept_all_around_their_instants() -> None:
    slider = placed("kuka", slide_model(Box((0.1, 0.1, 0.1))))
    part = fixed_part(Box((0.1, 0.1, 0.1)), pose((0.5, 0.0, 0.0)))
    x = 0.3968 * np.sin(np.pi * np.linspace(0.0, 1.0, 1001))

    report, _ = checked(make_cell(slider, part=part), x[:, None])
    curve, truth = report.curves[ClearanceClass.PART], 0.4 - x
    at = np.round(report.curve_times * 1000).astype(int)
    lowest = np.array([truth[max(0, k - 5) : k + 6].min() for k in at])

    assert {0, 1000} <= set(at)
    assert report.minima[ClearanceClass.PART].at_s in report.curve_times
    assert np.all(curve <= truth[at] + 1e-12)  # rounding
    assert np.all(curve >= 0.95 * lowest - 0.0011 - 5 * 0.00125)  # promised room, and the way within a stretch
    assert curve.min() == pytest.approx(truth.min(), abs=EXACT)
    assert set(report.curves) == {ClearanceClass.PART}


@pytest.mark.parametrize("depth", [0.0, 0.005, 0.015])
def test_a_tool_at_work_may_touch_the_part_at_its_tip(depth: float) -> None:
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=-depth), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )
    task = work("drill")

    report, checks = checked(replace(cell, tasks=(task,)), np.zeros((11, 1)), task)

    assert all(check.passed for check in checks)
    assert [(c.pair, c.is_allowed, c.first_s, c.last_s) for c in report.contacts] == [
        (("drill/tool", "part"), True, 0.0, 1.0)
    ]
    assert report.contacts[0].reason == "at work, within 20 mm of the tool tip"
    assert ("drill/tool", "part") in {(first, second) for first, second, _ in report.exclusions}


@pytest.mark.parametrize(
    ("shape", "depth"), [(Cylinder(0.01, 0.1), 0.03), (Cylinder(0.03, 0.1), 0.001), (Box((0.01, 0.01, 0.1)), 0.05)]
)
def test_a_tool_that_touches_outside_its_contact_zone_collides(shape: Solid, depth: float) -> None:
    for solid in (Box((0.3, 0.3, 0.2)), tessellate(Box((0.3, 0.3, 0.2)))):
        cell = make_cell(drill(shape, back=0.05, tip=-depth), part=fixed_part(solid, pose((0.0, 0.0, -0.1))))
        task = work("drill")

        _, checks = checked(replace(cell, tasks=(task,)), np.zeros((11, 1)), task)

        assert failed(checks, "collision") == [
            "collision: drill/tool touches part outside the contact zone of the tool at work from 0.000 s to 1.000 s"
        ]


def test_without_a_task_the_same_touch_is_a_collision() -> None:
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=-0.005), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )

    _, checks = checked(cell, np.zeros((11, 1)))

    assert failed(checks, "collision") == ["collision: drill/tool touches part from 0.000 s to 1.000 s"]


def test_a_robot_whose_task_is_not_worked_on_is_left_out_against_the_part_and_says_so() -> None:
    cell = make_cell(
        drill(Cylinder(0.01, 0.1), back=0.05, tip=-0.05), part=fixed_part(Box((0.3, 0.3, 0.2)), pose((0.0, 0.0, -0.1)))
    )

    report, checks = checked(replace(cell, tasks=(work("drill"),)), np.zeros((11, 1)))

    assert all(check.passed for check in checks)
    assert (
        "drill/tool",
        "part",
        "drill stands idle in this run: withdraw it from the part before running it",
    ) in report.exclusions
    in_the_way = [(c.pair, c.first_s, c.last_s) for c in report.contacts if c.is_allowed]
    assert in_the_way == [(("drill/tool", "part"), 0.0, 1.0)]
    assert report.pair_count == 0


def test_a_part_sunk_into_the_floor_is_a_collision() -> None:
    slider = placed("lift", slide_model(Box((0.1, 0.1, 0.1)), axis=(0.0, 0.0, 1.0)), base=pose((0.0, 0.0, 0.5)))
    z = np.linspace(0.0, -0.6, 61)

    report, checks = checked(make_cell(slider, things=(floor(),)), z[:, None])

    assert failed(checks, "collision")[0].startswith("collision: lift/block touches floor from 0.7")
    assert report.minima[ClearanceClass.ENVIRONMENT].minimum == 0.0


def test_height_above_the_floor_is_the_minimum_of_its_class() -> None:
    slider = placed("lift", slide_model(Sphere(0.1), axis=(0.0, 0.0, 1.0)), base=pose((0.0, 0.0, 0.5)))
    post = thing("post", Cylinder(0.05, 1.0), pose((3.0, 0.0, 0.5)))

    report, _ = checked(make_cell(slider, things=(floor(), post)), np.linspace(0.0, -0.375, 40)[:, None])
    minimum = report.minima[ClearanceClass.ENVIRONMENT]

    assert minimum.pair == ("lift/block", "floor")
    assert minimum.minimum == pytest.approx(0.025, abs=1e-12)  # arithmetic only
    assert minimum.at_s == 1.0


def test_a_body_inside_a_closed_mesh_from_the_start_is_a_collision() -> None:
    tank = thing("tank", tessellate(Box((2.0, 2.0, 2.0))))
    slider = placed("a", slide_model(Box((0.1, 0.1, 0.1))))

    report, checks = checked(make_cell(slider, things=(tank,)), np.linspace(0.0, 0.1, 30)[:, None])

    assert failed(checks, "collision") == ["collision: a/block touches tank from 0.000 s to 1.000 s"]
    assert report.minima[ClearanceClass.ENVIRONMENT].minimum == 0.0


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
    return make_cell(*arms, part=part, things=(floor(), post), checks=CheckSettings(clearance=0.0, contact_zone=0.0))


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


@pytest.mark.parametrize("seed", range(5))
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
        found = report.minima[kind]
        assert found.certified
        assert found.minimum <= at_samples + EXACT / 2
        there = distance_of(scene, by_name[found.pair], interpolated(scene, q, 79 * found.at_s))
        assert found.minimum <= there + 1e-9 <= found.minimum + EXACT  # rounding of the instant


@pytest.mark.parametrize("seed", range(3))
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
    measured = [found for found in report.minima.values() if found.minimum]

    assert measured
    for found in measured:
        p, q_ = np.array(found.points)
        assert found.minimum - 4e-5 <= np.linalg.norm(q_ - p)  # points of round bodies lie on fine prisms round them
        assert np.linalg.norm(q_ - p) <= found.minimum + EXACT


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


def test_a_contact_between_two_samples_is_found_with_its_instant() -> None:
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-1.0, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01))),
    )
    q = np.zeros((11, 2))
    q[:, 0] = np.linspace(0.0, 2.1, 11)  # 0.21 m a step: past b between 0.4 s and 0.5 s

    report, checks = checked(make_cell(*sliders), q)

    assert [contact.pair for contact in report.contacts] == [("a/block", "b/block")]
    contact = report.contacts[0]
    assert 1.0 - 0.02 <= 2.1 * contact.first_s <= 2.1 * contact.last_s <= 1.0 + 0.02  # they touch within 20 mm
    assert failed(checks, "collision")[0].startswith("collision: a/block touches b/block ")
    assert report.minima[ClearanceClass.ROBOT_ROBOT].minimum == 0.0


def test_bodies_too_near_for_a_proof_are_not_certified_and_fail() -> None:
    """Two balls that pass each other at a millionth of a millimetre: no contact, and no proof that there is none."""
    sliders = (
        placed("a", slide_model(Sphere(0.01)), base=pose((-0.1, 0.0, 0.0))),
        placed("b", slide_model(Sphere(0.01)), base=pose((0.0, 0.02 + 1e-9, 0.0))),
    )
    q = np.zeros((101, 2))
    q[:, 0] = np.linspace(0.0, 0.2, 101)

    report, checks = checked(make_cell(*sliders), q)

    assert report.not_certified == (("a/block", "b/block"),)
    assert report.minima[ClearanceClass.ROBOT_ROBOT].certified is False
    assert report.minima[ClearanceClass.ROBOT_ROBOT].minimum == 0.0
    (message,) = failed(checks, "collision")
    assert message.startswith("not certified: a/block and b/block come so near at 0.5")


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

    monkeypatch.setattr("cellplan.scene.survey_search.MOST_SAMPLES", 64)
    pieces, _ = check_clearance(scene, schedule(300), q)

    assert pieces.contacts == whole.contacts
    for kind in ClearanceClass:
        assert pieces.minima[kind].minimum == pytest.approx(whole.minima[kind].minimum, abs=EXACT)


def test_progress_rises_to_one() -> None:
    told: list[float] = []

    check_clearance(
        Scene.from_cell(two_arms()), schedule(50), swinging(0, 50), progress=lambda _, share: told.append(share)
    )

    assert told == sorted(told)
    assert told[-1] == 1.0
