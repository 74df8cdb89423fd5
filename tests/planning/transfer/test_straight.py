"""Straight transfer moves: straight in joint space, at the limits, at rest at both ends, certified."""

from dataclasses import replace

import numpy as np
import pytest
from builders.scene_builders import thing
from builders.transfer_cells import arm, capped, scene_of

from cellplan.certify.certify import certify
from cellplan.errors import TransferNotFoundError
from cellplan.geometry.shapes import Cylinder, Sphere
from cellplan.geometry.transforms import Array, pose
from cellplan.planning.path.formatting import in_mm
from cellplan.planning.timing.retime import JointLimitsInTime
from cellplan.planning.transfer.plan import PlannedTransfer, Rung, plan_transfer
from cellplan.planning.transfer.query import TransferQuery
from cellplan.planning.transfer.straight_time import box_widths, shares, straight_rows, straight_steps
from cellplan.runs.plan.retiming import transfer_retimer
from cellplan.scene.scene import Scene

HOME, AWAY = np.radians([[-60.0, -20.0, 30.0, 0.0, 60.0, 0.0], [60.0, 0.0, 30.0, 40.0, 60.0, 100.0]])
STAND = np.radians([0.0, -20.0, 40.0, 0.0, 30.0, 0.0])


@pytest.fixture(scope="module")
def pair() -> tuple[Scene, PlannedTransfer]:
    """Two arms, of which the second one stands; a post is far away."""
    post = thing("post", Cylinder(0.1, 2.0), pose((0.0, -3.0, 1.0)))
    scene = scene_of(
        arm("kuka", "kuka_kr6"), arm("abb", "abb_irb1600_8_145", pose((4.0, 0.0, 0.0))), things=(post,), step=0.001
    )
    start, goal = np.append(HOME, STAND), np.append(AWAY, STAND)
    return scene, plan_transfer(TransferQuery.of(scene, start, goal, seed=0), retimer=transfer_retimer(scene))


def differences(values: Array, step: float) -> Array:
    """Rates of change from row to row, with rest before and after, shape (N + 1, n)."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    return np.diff(padded, axis=0) / step


def test_a_free_move_is_straight_in_joint_space_and_ends_where_it_is_to(pair: tuple[Scene, PlannedTransfer]) -> None:
    _, move = pair
    start, goal = np.append(HOME, STAND), np.append(AWAY, STAND)

    assert move.rungs == {"kuka": Rung.STRAIGHT}
    assert np.array_equal(move.q[0], start)
    assert np.array_equal(move.q[-1], goal)
    share = (move.q[:, 0] - start[0]) / (goal[0] - start[0])
    np.testing.assert_allclose(move.q, start + share[:, None] * (goal - start), atol=1e-12)
    assert np.all(np.diff(share) >= 0.0)
    assert np.all(move.q[:, 6:] == STAND)


def test_a_straight_move_keeps_all_limits_in_its_rows_and_reaches_one(pair: tuple[Scene, PlannedTransfer]) -> None:
    scene, move = pair
    bounds, step = transfer_retimer(scene).bounds, scene.cell.motion.step
    velocity = differences(move.q, step)
    acceleration = differences(velocity, step)[1:-1]
    jerk = differences(acceleration, step)[1:-1]

    used = [
        float((np.abs(rates) / limit).max())
        for rates, limit in (
            (velocity, bounds.velocity),
            (acceleration, bounds.acceleration),
            (jerk, bounds.jerk),
        )
    ]
    assert max(used) <= 1.0 + 1e-9
    assert max(used) >= 0.99
    np.testing.assert_allclose(move.times, step * np.arange(len(move.q)), atol=1e-12)


@pytest.mark.parametrize(
    ("velocity", "acceleration", "jerk", "seconds"),
    [
        (1.0, 2.0, np.inf, 2.5),  # trapezoid: d/v + v/a
        (10.0, 2.0, np.inf, 2.0),  # triangle: 2 sqrt(d/a)
        (1.0, 2.0, 4.0, 3.0),  # d/v + v/a + a/j
        (1e3, 1e3, 8.0, 4.0 * (2.0 / 16.0) ** (1.0 / 3.0)),  # jerk alone: 4 (d/2j)^(1/3)
    ],
)
def test_the_time_is_that_of_the_closed_form(velocity: float, acceleration: float, jerk: float, seconds: float) -> None:
    bounds = JointLimitsInTime(
        velocity=np.array([velocity]), acceleration=np.array([acceleration]), jerk=np.array([jerk])
    )

    widths = box_widths(np.array([2.0]), bounds, least=1e-4)

    assert sum(widths) == pytest.approx(seconds, abs=2e-4)
    rates = 2.0 * shares(np.linspace(0.0, 1.0, 2001), widths)
    step = sum(widths) / 2000
    for order, limit in ((1, velocity), (2, acceleration), (3, jerk)):
        assert np.abs(np.diff(rates, order)).max() / step**order <= limit * 1.001


def test_without_a_difference_nobody_moves(pair: tuple[Scene, PlannedTransfer]) -> None:
    scene, _ = pair
    q = np.append(HOME, STAND)

    move = plan_transfer(TransferQuery.of(scene, q, q, seed=0), retimer=transfer_retimer(scene))

    assert move.rungs == {}
    assert np.array_equal(move.q, [q, q])


def test_the_limit_of_tool_speed_slows_a_straight_move(pair: tuple[Scene, PlannedTransfer]) -> None:
    scene, fast = pair
    checks = scene.cell.checks.changed(tool_speed_mm_s=1000.0)
    motion = replace(scene.cell.motion, step=0.01)
    slow = replace(scene, cell=replace(scene.cell, checks=checks, motion=motion))

    move = plan_transfer(TransferQuery.of(slow, fast.q[0], fast.q[-1], seed=0), retimer=transfer_retimer(slow))

    tips = scene.chains["kuka"].tool_poses(move.q[:, :6])[:, :3, 3]
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / motion.step
    assert 0.95 <= speeds.max() <= 1.0 + 1e-9
    assert certify(slow, move.q, with_minimum=False).is_met


@pytest.mark.parametrize(
    "limits", [{}, {"speed_percent": 50.0}, {"tcp_mm_s": 250.0}, {"speed_percent": 5.0, "tcp_mm_s": 90.0}]
)
def test_steps_of_straight_moves_are_those_that_the_planner_gives_them(limits: dict[str, float]) -> None:
    scene = capped(scene_of(arm("kuka", "kuka_kr6"), arm("abb", "abb_irb1600_8_145", pose((4.0, 0.0, 0.0)))), **limits)
    retimer, rng = transfer_retimer(scene), np.random.default_rng(2)
    for size in (0.01, 0.1, 0.6):
        start = rng.uniform(-1.0, 1.0, 12)
        goal = start + size * rng.normal(size=12) * (np.arange(12) < rng.choice([6, 12]))

        rows = straight_rows(start, goal, retimer)

        assert len(rows) - 1 == straight_steps(start, goal, retimer.bounds, retimer.step)
        assert retimer.slower(np.zeros(len(rows)), rows) <= 1.0
        for points in retimer.bounds.points:
            assert points.travel(rows).max() <= limits["tcp_mm_s"] * 1e-3 * retimer.step


def test_a_share_of_the_speed_is_the_same_move_in_slow_motion(pair: tuple[Scene, PlannedTransfer]) -> None:
    scene, fast = pair

    slow = plan_transfer(
        TransferQuery.of(scene, fast.q[0], fast.q[-1], seed=0),
        retimer=transfer_retimer(capped(scene, speed_percent=25.0)),
    )

    assert slow.times[-1] == pytest.approx(4.0 * fast.times[-1], abs=4.0 * scene.cell.motion.step)
    at = np.interp(slow.times / slow.times[-1], fast.times / fast.times[-1], fast.q[:, 0])
    np.testing.assert_allclose(slow.q[:, 0], at, atol=2e-3)  # [rad] some rows, and a row that both round up to


def test_an_end_that_is_too_close_is_refused_with_the_pair_and_the_distance() -> None:
    ball = thing("ball", Sphere(0.1), np.eye(4))
    scene = scene_of(arm("kuka", "kuka_kr6"), things=(ball,))
    tip = scene.chains["kuka"].tool_poses(AWAY[None])[0]
    at = pose(tuple(tip[:3, 3] + 0.103 * tip[:3, 2]))  # 3 mm before the face of the tool
    near = scene_of(arm("kuka", "kuka_kr6"), things=(replace(ball, X_WS=at),))

    between = tip[:3, 3] + 0.0015 * tip[:3, 2]
    with pytest.raises(TransferNotFoundError) as refused:
        plan_transfer(TransferQuery.of(near, HOME, AWAY, seed=0), retimer=transfer_retimer(near))

    assert str(refused.value).endswith(
        "robots.kuka: the goal of the transfer move of 'kuka' comes too close: 'kuka/tool' is 3 mm from 'ball' near "
        f"{in_mm(np.round(between, 3))}, 5 mm are demanded: let approach and retract leave more "
        "room, or move one of the two"
    )
