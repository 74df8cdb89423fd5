"""Searches between the samples: thin things that fly through each other, bodies that dive into closed ones."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import fixed_part, make_cell, placed, slide_model, thing

from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_search import SolidSearch
from cellplan.certify.pair_state import MAX_CUTS, PairState
from cellplan.geometry.mesh.tessellation import tessellate
from cellplan.geometry.shapes import Box, Capsule, Sphere
from cellplan.geometry.transforms import Array, frame_from_axes, pose, pose_from
from cellplan.model.cell.cell import Cell
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.collision.distance import APART_TOL, measure
from cellplan.scene.scene import Scene

PLACEMENTS = 80
NEEDLE, WIRE = 0.5e-3, 0.25e-3  # [m] radii
STEP = 2e-3  # [m] that the needle flies from sample to sample
SAMPLES = 40


def unit(rng: np.random.Generator) -> Array:
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def axis_frame(origin: Array, z: Array) -> Array:
    hint = np.eye(3)[int(np.argmin(np.abs(z)))]
    return pose_from(frame_from_axes(z, hint), origin)


def needle_and_wire(rng: np.random.Generator) -> Cell:
    """A needle that flies sideways and meets a wire at a random instant, axes at most 80 % of the radii apart."""
    flight, along_needle, along_wire = unit(rng), unit(rng), unit(rng)
    while abs(np.linalg.det([flight, along_needle, along_wire])) < 0.7:
        flight, along_needle, along_wire = unit(rng), unit(rng), unit(rng)
    met = flight * STEP * rng.uniform(5.0, SAMPLES - 6.0) + along_needle * rng.uniform(-0.02, 0.02)
    normal = np.cross(along_needle, along_wire)
    met = met + 0.8 * (NEEDLE + WIRE) * rng.uniform(-1.0, 1.0) * normal / np.linalg.norm(normal)
    needle = turned(slide_model(Capsule(NEEDLE, 0.08), axis=tuple(flight)), axis_frame(np.zeros(3), along_needle))
    wire = thing("wire", Capsule(WIRE, 0.1), axis_frame(met + along_wire * rng.uniform(-0.03, 0.03), along_wire))
    return make_cell(
        placed("needle", needle), things=(wire,), checks=ChecksEntry(clearance_mm=0.0, contact_zone_mm=0.0)
    )


def turned(model: RobotModel, X: Array) -> RobotModel:
    """The model with its bodies at another place in its frame."""
    return replace(model, bodies=tuple(replace(body, X_BS=X @ body.X_BS) for body in model.bodies))


def search(
    scene: Scene, q: Array, pair: tuple[int, int], cutoff: float = APART_TOL, max_cuts: int = MAX_CUTS
) -> SolidSearch:
    motion = StraightMotion.of_cell(scene, LeverArms(scene, q), q)
    result = SolidSearch(scene.engine, pair, motion, state=PairState(max_cuts=max_cuts))
    result.run(cutoff)
    return result


def test_a_needle_that_flies_through_a_wire_between_samples_is_always_found() -> None:
    rng = np.random.default_rng(0)
    q = STEP * np.arange(SAMPLES)[:, None]
    missed_by_sampling = 0
    for _ in range(PLACEMENTS):
        scene = Scene.from_cell(needle_and_wire(rng))
        index = {body.name: place for place, body in enumerate(scene.bodies)}
        pair = (index["needle/block"], index["wire"])
        poses = scene.body_poses(q)
        touched = [measure(scene.engine, pair, poses, sample=k).touches for k in range(SAMPLES)]
        missed_by_sampling += not any(touched)

        state = search(scene, q, pair).state

        assert state.touches
        there = scene.body_poses(np.array([[STEP * state.touches[0]]]))
        assert measure(scene.engine, pair, there, sample=0).touches
    assert missed_by_sampling > PLACEMENTS // 10


def test_a_needle_that_passes_a_wire_is_certified_with_the_distance_it_keeps() -> None:
    gap = 1e-4
    wire = thing("wire", Capsule(WIRE, 0.1), pose((0.0333, 0.0, NEEDLE + WIRE + gap), (np.pi / 2, 0.0, 0.0)))
    needle = turned(slide_model(Capsule(NEEDLE, 0.08)), pose((0.0, 0.0, 0.0), (0.0, np.pi / 2, 0.0)))
    scene = Scene.from_cell(make_cell(placed("needle", needle), things=(wire,)))
    index = {body.name: place for place, body in enumerate(scene.bodies)}

    match = search(scene, STEP * np.arange(SAMPLES)[:, None], (index["needle/block"], index["wire"]), np.inf)

    assert not match.state.touches
    assert not match.state.unproved
    assert gap - 1e-4 < match.low.min() <= gap + 1e-9
    assert match.low.min() > 0.0


def test_a_body_that_dives_into_a_closed_mesh_touches_until_it_comes_out() -> None:
    tank = thing("tank", tessellate(Box((1.0, 1.0, 1.0))))
    ball = placed("ball", slide_model(Sphere(0.05)))
    scene = Scene.from_cell(make_cell(ball, part=fixed_part(Sphere(0.01), pose((0.0, 0.0, 9.0))), things=(tank,)))
    index = {body.name: place for place, body in enumerate(scene.bodies)}
    x = np.linspace(-1.0, 1.0, 401)

    touches = set(search(scene, x[:, None], (index["ball/block"], index["tank"])).state.touches)

    clear = np.abs(np.abs(x) - 0.55) > 1e-6  # at the very border both answers are right
    assert {k for k in touches if k == int(k) and clear[int(k)]} == set(np.flatnonzero((np.abs(x) < 0.55) & clear))


@pytest.mark.parametrize("leap", [0.8, 1.1])
def test_a_leap_into_or_over_a_closed_mesh_is_a_contact(leap: float) -> None:
    """Outside at one sample, inside or beyond at the next: the surface is crossed between them."""
    shell = thing("shell", tessellate(Box((0.2, 0.5, 0.5))))
    ball = placed("ball", slide_model(Sphere(0.02)))
    scene = Scene.from_cell(make_cell(ball, things=(shell,)))
    index = {body.name: place for place, body in enumerate(scene.bodies)}
    q = np.array([[-leap], [0.0 if leap < 1.0 else leap], [0.0 if leap < 1.0 else leap]])

    state = search(scene, q, (index["ball/block"], index["shell"])).state

    assert state.touches
    assert min(state.touches) == pytest.approx((leap - 0.12) / (leap if leap < 1.0 else 2 * leap), abs=0.15)


def test_a_pair_without_end_of_open_steps_is_given_up_and_not_called_free() -> None:
    """Two plates that slide over each other a nanometre apart cannot be told from plates that touch."""
    low = placed("low", slide_model(Box((0.5, 0.5, 0.1))))
    high = thing("high", Box((0.5, 0.5, 0.1)), pose((0.0, 0.0, 0.1 + 5e-10)))
    scene = Scene.from_cell(make_cell(low, things=(high,)))
    index = {body.name: place for place, body in enumerate(scene.bodies)}

    q = np.linspace(0.0, 0.1, 60)[:, None]
    state = search(scene, q, (index["low/block"], index["high"]), max_cuts=100).state

    assert state.unproved or state.touches
