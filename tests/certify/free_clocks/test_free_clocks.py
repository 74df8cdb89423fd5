"""Robots on independent clocks: what is proved in a region of two programs is never above what is found there."""

from itertools import combinations

import numpy as np
import pytest
from builders.grid_bodies import grid_body
from builders.moving_cells import cell_with_bodies, program
from builders.scene_builders import body, held_part, joint, make_cell, no_tool, placed, slide_model

from cellplan.certify.free_clocks.free_clocks import (
    MINIMUM_TOL,
    ClockRegion,
    RegionBound,
    band,
    certify_regions,
    watched_pairs,
)
from cellplan.certify.free_clocks.free_motion import FreeMotion
from cellplan.geometry.shapes import Capsule, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.model.robot.robot import RobotModel
from cellplan.model.settings.checks import ChecksEntry
from cellplan.scene.collision.distance import measure
from cellplan.scene.scene import Scene

RADIUS = 0.1  # [m] of both balls
GAP = 0.05  # [m] between them where they pass each other
EXACT = 1e-4  # [m] a reading is never farther below the truth
STEP = 0.05  # [s] from row to row


def passing(demand: float = 0.01) -> tuple[Scene, Array]:
    """Two balls that slide along parallel lines, the first one in step 0.04 m, the second 0.02 m ahead all the time."""
    ball = slide_model(Sphere(RADIUS))
    cell = make_cell(
        placed("one", ball),
        placed("two", ball, base=pose((0.0, 2.0 * RADIUS + GAP, 0.0))),
        checks=ChecksEntry(clearance_mm=1e3 * demand, contact_zone_mm=0.0),
    )
    positions = 0.04 * np.arange(41)
    return Scene.from_cell(cell), np.column_stack([positions, positions + 0.8])


def bound_of(scene: Scene, q: Array, rectangles: Array, *, with_minimum: bool = True) -> RegionBound:
    region = ClockRegion(first="one", second="two", rectangles=rectangles)
    return certify_regions(scene, q, [region], with_minimum=with_minimum)[0]


def balls_apart(ahead: float) -> float:
    """Distance of two passing balls when the one is so far ahead."""
    return float(np.hypot(ahead, 2.0 * RADIUS + GAP)) - 2.0 * RADIUS


def test_two_balls_are_nearest_where_they_pass_if_any_places_may_meet() -> None:
    scene, q = passing()

    bound = bound_of(scene, q, np.array([[0.0, 40.0, 0.0, 40.0]]))

    assert GAP - MINIMUM_TOL <= bound.proved <= bound.distance + 1e-12
    assert GAP - EXACT <= bound.distance <= GAP + MINIMUM_TOL
    assert bound.bodies == ("one/block", "two/block")
    assert bound.at is not None
    assert bound.at[0] == pytest.approx(bound.at[1] + 20.0, abs=1.0)  # 0.8 m are 20 steps
    assert bound.is_met


@pytest.mark.parametrize("demand", [0.01, 0.03, 0.09])
def test_a_ball_before_the_mouth_of_an_angle_may_come_nearer_to_its_hull_than_to_its_legs(demand: float) -> None:
    """At the end of its way it is nearer to the hull than demanded by less than a box is cut to."""
    angle = grid_body([[0.0, 0.1, 0.4], [0.0, 0.1, 0.4], [-0.1, 0.1]], {(0, 0, 0), (1, 0, 0), (0, 1, 0)})
    radius, y = 0.05, 0.28
    cell = make_cell(
        placed("one", slide_model(angle)),
        placed("two", slide_model(Sphere(radius)), base=pose((0.0, y, 0.0))),
        checks=ChecksEntry(clearance_mm=1e3 * demand, contact_zone_mm=0.0),
    )
    end = 0.5 - y + np.sqrt(2.0) * (radius + demand - 2e-7)  # the hull ends in the plane x + y = 0.5
    steps = np.linspace(0.0, 1.0, 8)
    q = np.column_stack([-0.01 * steps[::-1], 0.8 + (end - 0.8) * steps])

    bound = bound_of(Scene.from_cell(cell), q, np.array([[0.0, 7.0, 0.0, 7.0]]), with_minimum=False)

    assert bound.is_met
    assert demand <= bound.proved <= 0.131


@pytest.mark.parametrize("late", [0.0, 0.2, 0.7])
def test_balls_of_constant_speed_come_as_near_as_the_skew_brings_them(late: float) -> None:
    scene, q = passing()
    times = STEP * np.arange(len(q))

    bound = bound_of(scene, q, band(times, -late, late))

    ahead = 0.8 - 0.8 * late  # [m] at 0.8 m/s
    widest = max(2.0 * late / 8.0, times[-1] / 2000.0)  # [s] by which a rectangle reaches beyond the band
    assert balls_apart(ahead - 0.8 * widest) - MINIMUM_TOL <= bound.proved <= balls_apart(ahead) + EXACT


@pytest.mark.parametrize(("demand", "is_met"), [(GAP - 2 * EXACT, True), (GAP + 1e-5, False)])
@pytest.mark.parametrize("with_minimum", [True, False])
def test_a_demand_is_kept_up_to_the_gap(demand: float, is_met: bool, with_minimum: bool) -> None:
    scene, q = passing(demand)

    bound = bound_of(scene, q, np.array([[0.0, 40.0, 0.0, 40.0]]), with_minimum=with_minimum)

    assert bound.is_met is is_met
    assert (bound.bodies is not None) or is_met


def test_only_the_rectangles_of_a_region_count() -> None:
    scene, q = passing(0.2)

    near = np.array([[22.0, 24.0, 2.0, 4.0]])
    far = np.array([[0.0, 8.0, 0.5, 8.5], [30.25, 40.0, 30.0, 40.0]])

    assert not bound_of(scene, q, near).is_met
    assert bound_of(scene, q, far).is_met
    assert not bound_of(scene, q, np.concatenate([far, near])).is_met


def test_rows_of_robots_may_differ_in_number() -> None:
    scene, q = passing()
    rows = {"one": q[:, :1], "two": q[::8, 1:]}

    bound = certify_regions(
        scene, rows, [ClockRegion(first="two", second="one", rectangles=np.array([[0, 5, 0, 40]]))], with_minimum=True
    )[0]

    assert GAP - MINIMUM_TOL <= bound.proved <= GAP
    assert bound.bodies == ("one/block", "two/block")
    assert bound.at is not None
    assert 8.0 * bound.at[0] == pytest.approx(bound.at[1] - 20.0, abs=1.0)


def test_the_part_moves_with_its_first_holder() -> None:
    holder, other = slide_model(Sphere(0.01)), slide_model(Sphere(0.01))
    cell = make_cell(
        placed("one", holder),
        placed("two", other, base=pose((0.0, 1.0, 0.0))),
        part=held_part(Sphere(0.3), "one", pose((0.0, -0.5, 0.0))),
        checks=ChecksEntry(clearance_mm=10.0, contact_zone_mm=0.0),
    )
    q = np.array([[0.0, 0.0], [0.2, 0.0]])

    bound = bound_of(Scene.from_cell(cell), q, np.array([[0.0, 1.0, 0.0, 1.0]]))

    assert bound.bodies == ("two/block", "part")
    assert bound.proved == pytest.approx(0.5 - 0.31, abs=MINIMUM_TOL)


def swings() -> tuple[Scene, Array]:
    """Two arms of 1 m that turn about parallel axes 2.2 m apart: nearest when both point at each other."""
    arm = RobotModel(
        name="swing",
        source="test",
        joints=(joint("s", -1),),
        flange_link=0,
        X_BF=np.eye(4),
        bodies=(body("arm", 0, shape=Capsule(0.05, 0.9), at=(0.5, 0.0, 0.0), rpy=(0.0, 0.5 * np.pi, 0.0)),),
    )
    cell = make_cell(
        placed("one", arm, tool=no_tool()),
        placed("two", arm, base=pose((2.2, 0.0, 0.0), (0.0, 0.0, np.pi))),
        checks=ChecksEntry(clearance_mm=100.0, contact_zone_mm=0.0),
    )
    angle = np.linspace(-1.2, 1.2, 26)
    return Scene.from_cell(cell), np.column_stack([angle, -angle])


def test_two_planar_arms_meet_where_both_reach_out_to_each_other() -> None:
    scene, q = swings()

    bound = bound_of(scene, q, np.array([[0.0, 25.0, 0.0, 25.0]]))

    assert 0.2 - MINIMUM_TOL <= bound.proved <= 0.2
    assert bound.at == pytest.approx((12.5, 12.5), abs=1.5)


@pytest.mark.parametrize("seed", range(3))
def test_no_place_of_a_random_program_is_nearer_than_what_is_proved(seed: int) -> None:
    scene = Scene.from_cell(cell_with_bodies(seed))
    q = 0.4 * program(scene.cell, seed, samples=6, stride=0.1)
    rng = np.random.default_rng(seed)
    for first, second in list(combinations([robot.name for robot in scene.cell.robots], 2))[seed : seed + 1]:
        corners = np.sort(rng.uniform(0.0, 5.0, size=(2, 2, 2)), axis=2).reshape(2, 4)
        region = ClockRegion(first=first, second=second, rectangles=corners)
        bound = certify_regions(scene, q, [region], with_minimum=True)[0]
        brute = smallest(scene, q, region, count=5)
        assert bound.proved <= brute
        assert bound.is_met is (bound.distance > 0.0)
        assert bound.is_met or bound.bodies is not None
        assert brute > 0.0 or not bound.is_met
        assert bound.distance - bound.proved <= MINIMUM_TOL + EXACT
        assert bound.distance <= brute + MINIMUM_TOL + EXACT


def smallest(scene: Scene, q: Array, region: ClockRegion, *, count: int) -> float:
    """Smallest distance at some places of a region, each measured for itself."""
    nearest, motion = np.inf, FreeMotion(scene, q)
    ends = watched_pairs(scene, region.first, region.second).ends
    for a0, a1, b0, b1 in region.rectangles:
        for a in np.linspace(a0, a1, count):
            stacked = np.repeat(stacked_at(motion, a), count, axis=0)
            columns = scene.cell.columns(region.second)
            stacked[:, columns] = motion.positions(region.second, np.linspace(b0, b1, count))
            poses = scene.body_poses(stacked)
            for u, v in ends.tolist():
                for sample in range(count):
                    reading = measure(scene.engine, (u, v), poses, sample=sample)
                    nearest = min(nearest, 0.0 if reading.touches else reading.bound)
    return nearest


def stacked_at(motion: FreeMotion, row: float) -> Array:
    names = [robot.name for robot in motion.scene.cell.robots]
    return np.concatenate([motion.positions(name, np.array([row])) for name in names], axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_no_point_of_a_body_is_displaced_by_more_than_its_way(seed: int) -> None:
    scene = Scene.from_cell(cell_with_bodies(seed))
    q = program(scene.cell, seed, samples=5, stride=0.3)
    motion, rng = FreeMotion(scene, q), np.random.default_rng(seed)
    carried = [k for k in range(len(scene.engine.bodies)) if scene.carrier(k).robot is not None]
    for index in carried:
        vertices = scene.engine.bodies[index].core.vertices
        a, b = np.sort(rng.uniform(0.0, 4.0, size=(40, 2)), axis=1).T
        bodies = np.full(40, index)
        (R_a, p_a), (R_b, p_b) = motion.poses(bodies, a), motion.poses(bodies, b)
        moved = (vertices @ np.swapaxes(R_b - R_a, 1, 2)) + (p_b - p_a)[:, None]
        farthest = np.linalg.norm(moved, axis=2).max(axis=1)
        assert np.all(farthest <= motion.travel(bodies, b) - motion.travel(bodies, a) + 1e-9)


@pytest.mark.parametrize(("low", "high"), [(-0.1, 0.1), (0.0, 0.3), (-0.5, -0.5), (1.0, 5.0)])
def test_a_band_is_covered_tightly(low: float, high: float) -> None:
    times = STEP * np.arange(41)
    rng = np.random.default_rng(0)
    t = rng.uniform(0.0, times[-1], size=(20_000, 2))
    apart = t[:, 1] - t[:, 0]
    rows = t / STEP

    rectangles = band(times, low, high)
    inside = np.zeros(len(t), dtype=bool)
    for a0, a1, b0, b1 in rectangles:
        inside |= (rows[:, 0] >= a0) & (rows[:, 0] <= a1) & (rows[:, 1] >= b0) & (rows[:, 1] <= b1)

    beyond = max((high - low) / 8.0, times[-1] / 2000.0)
    assert np.all(inside[(apart >= low) & (apart <= high)])
    assert not np.any(inside[(apart < low - beyond) | (apart > high + beyond)])
    assert np.all((rectangles >= 0.0) & (rectangles <= 40.0))


def test_a_band_beyond_the_program_is_empty() -> None:
    scene, q = passing()
    empty = band(STEP * np.arange(41), 3.0, 4.0)

    assert empty.shape == (0, 4)
    assert bound_of(scene, q, empty).is_met


@pytest.mark.parametrize(
    ("second", "rectangle"),
    [("one", (0.0, 1.0, 0.0, 1.0)), ("two", (0.0, 41.0, 0.0, 1.0)), ("two", (2.0, 1.0, 0.0, 1.0))],
)
def test_what_is_no_region_is_refused(second: str, rectangle: tuple[float, ...]) -> None:
    scene, q = passing()

    with pytest.raises(ValueError, match="certify: "):
        certify_regions(scene, q, [ClockRegion(first="one", second=second, rectangles=np.array([rectangle]))])
