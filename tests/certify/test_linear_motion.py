"""Between the samples: paths bend and bodies travel no more than the bounds say, whatever joints move them."""

import numpy as np
import pytest
from builders.moving_cells import cell_with_bodies, program, relative
from builders.scene_builders import body, floor, joint, make_cell, no_tool, placed, slide_model

from cellplan.certify.lever_arms import LeverArms
from cellplan.certify.linear_motion import StraightMotion
from cellplan.certify.pair_search import GroundSearch
from cellplan.certify.pair_state import PairState
from cellplan.geometry.shapes import Box, Sphere
from cellplan.geometry.transforms import Array
from cellplan.model.robot.robot import RobotModel
from cellplan.scene.collision.bodies import CollisionBody
from cellplan.scene.collision.continuous.motion_bound import PairMotion
from cellplan.scene.collision.distance import measure
from cellplan.scene.scene import Scene

ROUNDING = 1e-9  # [m]
FINE = 65  # [-] instants looked at within a step


def moving(seed: int, *, stride: float, samples: int = 4) -> tuple[Scene, StraightMotion, Array]:
    scene = Scene.from_cell(cell_with_bodies(seed))
    q = program(scene.cell, seed + 1000, samples=samples, stride=stride)
    return scene, StraightMotion.of_cell(scene, LeverArms(scene, q), q), q


def some_pairs(scene: Scene, seed: int, count: int) -> list[tuple[int, int]]:
    rng = np.random.default_rng(seed)
    chosen = rng.permutation(len(scene.solid_pairs))[:count]
    return [(int(a), int(b)) for a, b in scene.solid_pairs[chosen]]


def within(q: Array, step: int, count: int = FINE) -> Array:
    """Joint positions at instants of one step."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    return (1.0 - s) * q[step] + s * q[step + 1]


def farthest_points(body: CollisionBody, directions: Array) -> Array:
    """The points of a body that are farthest in some directions, and the middle of its sphere."""
    corners = body.core.vertices[np.argmax(directions @ body.core.vertices.T, axis=1)]
    return np.concatenate([corners + body.inflation * directions, body.centre[None]])


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(4, 12))])
def test_points_bend_and_travel_no_more_than_the_joints_between_allow(seed: int) -> None:
    scene, motion, q = moving(seed, stride=0.2)
    rng = np.random.default_rng(seed)
    for pair in some_pairs(scene, seed, 25):
        first, second = pair
        bends, seen = motion.bends(pair), PairMotion(scene.engine, pair, motion)
        directions = rng.normal(size=(30, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points = farthest_points(scene.engine.bodies[second], directions)
        for step in range(len(q) - 1):
            R, p = relative(scene, within(q, step), pair)
            paths = points @ np.swapaxes(R, 1, 2) + p[:, None, :]
            second_differences = np.diff(paths, 2, axis=0) * (FINE - 1) ** 2
            # a second difference is a mean of the second derivative: never above its largest value
            assert np.linalg.norm(second_differences, axis=2).max() <= bends.second[step] + 1e-6  # rounding / h^2
            travelled = np.linalg.norm(np.diff(paths, axis=0), axis=2).sum(axis=0)
            assert travelled.max() <= bends.reach[step] + ROUNDING or _seen_from_the_other(
                scene, q, pair, step=step, limit=float(bends.reach[step])
            )
            assert travelled.max() <= seen.step_travel(step) + ROUNDING or _seen_from_the_other(
                scene, q, pair, step=step, limit=seen.step_travel(step)
            )
        assert first != second


def _seen_from_the_other(scene: Scene, q: Array, pair: tuple[int, int], *, step: int, limit: float) -> bool:
    """Whether the distance of the two bodies changes by no more than a limit: all that a travel bound is used for."""
    poses = scene.pair_poses(pair, within(q, step, 17))
    bounds = [measure(scene.engine, pair, poses, sample=k) for k in range(17)]
    free = [reading.bound for reading in bounds if not reading.touches]
    return not free or max(free) - min(free) <= limit + 1e-4  # a measured distance is exact to 0.1 mm


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 8))])
@pytest.mark.parametrize("stride", [0.01, 0.3])
def test_what_one_reading_proves_holds_at_every_instant_of_every_step(seed: int, stride: float) -> None:
    scene, motion, q = moving(seed, stride=stride, samples=6)
    rng = np.random.default_rng(seed)
    proved_something = False
    for pair in some_pairs(scene, seed, 12):
        low = motion.sphere_bounds(pair)
        spheres = low.copy()
        for sample in (1, 4):
            reading = measure(scene.engine, pair, motion.poses, sample=sample)
            if not reading.touches:
                PairMotion(scene.engine, pair, motion).carry(reading, sample, first=0, last=5, low=low)
        proved_something |= bool(np.any(low > np.maximum(spheres, 0.0) + 1e-3))
        for step in range(5):
            poses = scene.pair_poses(pair, within(q, step, 12))
            for k in rng.permutation(12)[:6]:
                there = measure(scene.engine, pair, poses, sample=int(k))
                # a reading may lie 0.05 mm below the truth
                assert low[step] <= (0.0 if there.touches else there.bound + 5e-5) + ROUNDING
    assert proved_something


@pytest.mark.parametrize("seed", range(6))
def test_two_readings_bound_the_whole_step_between_them(seed: int) -> None:
    scene, motion, q = moving(seed, stride=0.05)
    for pair in some_pairs(scene, seed, 12):
        seen = PairMotion(scene.engine, pair, motion)
        for step in range(3):
            ends = [measure(scene.engine, pair, motion.poses, sample=step + k) for k in (0, 1)]
            proved = 0.5 * (ends[0].bound + ends[1].bound - seen.step_travel(step))
            poses = scene.pair_poses(pair, within(q, step, 12))
            there = [measure(scene.engine, pair, poses, sample=k) for k in range(12)]
            if not any(reading.touches for reading in there):
                assert proved <= min(reading.bound for reading in there) + 5e-5


def test_nothing_bends_or_travels_between_bodies_that_one_link_carries_or_that_stand_still() -> None:
    scene = Scene.from_cell(cell_with_bodies(3))
    q = program(scene.cell, 1, samples=5, stride=0.3)
    motion = StraightMotion.of_cell(scene, LeverArms(scene, q), q)
    index = {body.name: place for place, body in enumerate(scene.bodies)}
    holder = scene.cell.robot("holder")
    still = (index["op0/b0"], index["post"])
    together = (index[f"holder/b{holder.model.flange_link + 1}"], index["part"])

    for pair in (still, together):
        seen = PairMotion(scene.engine, pair, motion)
        assert max(seen.step_travel(step) for step in range(4)) <= 2 * ROUNDING
        assert motion.bends(pair).second.max() == 0.0


def test_a_robot_is_seen_from_its_own_link_without_the_joints_before_it() -> None:
    scene = Scene.from_cell(cell_with_bodies(5))
    q = np.zeros((3, scene.cell.joint_count))
    q[:, scene.cell.columns("op0").start] = [0.0, 0.5, 1.0]  # only the first joint of one robot moves
    motion = StraightMotion.of_cell(scene, LeverArms(scene, q), q)
    index = {body.name: place for place, body in enumerate(scene.bodies)}

    bends = motion.bends((index["op0/b1"], index["op0/b4"]))
    other = motion.bends((index["op0/b1"], index["op1/b4"]))

    assert bends.reach.max() == bends.second.max() == 0.0
    assert other.reach.min() > 0.0


def test_heights_above_the_floor_hold_between_the_samples() -> None:
    scene, _, _ = moving(0, stride=0.1)
    cell = make_cell(*scene.cell.robots, things=(floor(),))
    scene = Scene.from_cell(cell)
    q = program(cell, 7, samples=8, stride=0.3)
    motion = StraightMotion.of_cell(scene, LeverArms(scene, q), q)
    for row in scene.ground_rows[:30]:
        pair = scene.pairs[row]
        search = GroundSearch(pair, motion, state=PairState())
        for step in range(7):
            heights = scene.ground_heights(pair, scene.pair_poses((pair.first, pair.first), within(q, step)))
            touches = min(heights[0], heights[-1]) <= 0.0  # then nothing but zero is said
            assert search.low[step] == 0.0 if touches else heights.min() >= search.low[step] - ROUNDING


def test_a_step_cut_finer_is_the_same_motion() -> None:
    scene, motion, q = moving(2, stride=0.2)
    pair = some_pairs(scene, 2, 1)[0]

    fine = motion.finer(pair, 1, parts=8)

    np.testing.assert_allclose(fine.q[[0, 8]], q[1:3])
    for index in pair:
        np.testing.assert_allclose(fine.poses.p[index][[0, 8]], motion.poses.p[index][1:3], atol=1e-12)  # rounding
    assert np.isnan(fine.poses.p[[k for k in range(len(scene.engine.bodies)) if k not in pair]]).all()
    np.testing.assert_allclose(fine.bends(pair).second, motion.bends(pair).second[1] / 64.0)  # time counts twice


def test_lever_arms_of_a_slide_are_one() -> None:
    slider = placed("a", slide_model(Box((0.1, 0.1, 0.1))))
    scene = Scene.from_cell(make_cell(slider))
    q = np.linspace(0.0, 1.0, 5)[:, None]

    chain = LeverArms(scene, q).chain(None, 0)

    assert chain.levers.tolist() == [1.0]
    assert chain.bend(np.full((4, 1), 0.25)).tolist() == [0.0] * 4
    assert chain.reach(np.full((4, 1), 0.25)).tolist() == [0.25] * 4


def test_the_lever_arm_of_a_turn_that_carries_a_slide_grows_by_the_travel_of_the_slide() -> None:
    joints = (joint("turn", -1), joint("slide", 0, axis=(1.0, 0.0, 0.0), slides=True))
    ball = body("ball", 1, shape=Sphere(0.1))
    model = RobotModel(name="boom", source="test", joints=joints, flange_link=1, X_BF=np.eye(4), bodies=(ball,))
    scene = Scene.from_cell(make_cell(placed("a", model, tool=no_tool())))
    q = np.array([[0.0, 0.0], [0.3, 0.25]])

    chain = LeverArms(scene, q).chain(None, 0)

    assert dict(zip(chain.axes.tolist(), chain.levers.tolist(), strict=True)) == {0: pytest.approx(0.35), 1: 1.0}
