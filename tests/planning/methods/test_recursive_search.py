"""The recursive search within limits of position and speed, with brakes, weights and a sequence of its own."""

import numpy as np
import pytest
from builders.search_arms import (
    FOUR_LINKS,
    arm_cell,
    dh_arm,
    followed,
    points_schedule,
    position_errors,
    quintic,
    tool_poses,
    with_velocity,
    with_weights,
)

from cellplan.model.settings.solver import SearchJointEntry

TOLERANCE = 1e-5  # [m] of section 4.2
STEP = 4e-3  # [s]
START = np.array([np.pi / 4, np.pi / 6, np.pi / 2, np.pi / 4])


def circle(cell, start, *, period=1.0, radius=0.15):
    """[Nicolato2007]_ 4.2: once round, from where the tool is; the centre lies towards the base."""
    at = tool_poses(cell, start[None])[0, :3, 3]
    inwards = -at / np.linalg.norm(at)
    across = np.array([-inwards[1], inwards[0], 0.0])
    times = np.arange(round(period / STEP) + 1) * STEP
    phi = 2 * np.pi * times[:, None] / period
    points = at + radius * ((1 - np.cos(phi)) * inwards + np.sin(phi) * across)
    return points_schedule(cell, times, points)


def four_links(*, limits=None, velocity=None, **search):
    model = dh_arm(FOUR_LINKS, limits=limits)
    if velocity is not None:
        model = with_velocity(model, 3, velocity)
    return arm_cell(model, method="recursive_search", axes=(0, 1), **{"tolerance_mm": 1e3 * TOLERANCE, **search})


def joints(*names: str) -> tuple[SearchJointEntry, ...]:
    """Joints of the arm in a sequence."""
    return tuple(SearchJointEntry(robot="arm", joint=name) for name in names)


def test_position_limits_of_the_fourth_joint_hold_without_any_loss():
    cell = four_links(limits={3: (0.60, 0.85)})
    schedule = circle(cell, START)
    motion = followed(cell, schedule, START)
    assert motion.q[:, 3].min() >= 0.60
    assert motion.q[:, 3].max() <= 0.85
    assert min(motion.q[:, 3].min() - 0.60, 0.85 - motion.q[:, 3].max()) < 1e-9  # the limit matters
    assert position_errors(cell, schedule, motion).max() <= TOLERANCE


def test_speed_limits_of_the_fourth_joint_hold_without_any_loss():
    cell = four_links(velocity=0.5)
    schedule = circle(cell, START)
    motion = followed(cell, schedule, START)
    speeds = np.abs(np.diff(motion.q[:, 3])) / STEP
    assert 0.5 * (1 - 1e-6) < speeds.max() <= 0.5
    assert position_errors(cell, schedule, motion).max() <= TOLERANCE


def test_speed_limits_of_all_joints_hold_even_if_the_tool_falls_behind():
    model = dh_arm(FOUR_LINKS)
    for i in range(4):
        model = with_velocity(model, i, 0.4)
    cell = arm_cell(model, method="recursive_search", axes=(0, 1), tolerance_mm=1e3 * TOLERANCE)
    schedule = circle(cell, START, radius=0.05)
    motion = followed(cell, schedule, START)
    assert np.abs(np.diff(motion.q, axis=0)).max() / STEP <= 0.4
    assert position_errors(cell, schedule, motion).max() > 1e-3
    left = motion.slack * STEP
    np.testing.assert_allclose(left[left > 0], position_errors(cell, schedule, motion)[left > 0], rtol=1e-9)


def test_brakes_slow_a_joint_on_its_way_to_a_limit_only():
    """Without brakes the joint stops dead at its limit; with them it comes in slowly, and leaves as fast as ever."""
    free, braked = (four_links(limits={3: (0.60, 0.85)}, brakes=brakes) for brakes in (False, True))
    schedule = circle(free, START)
    plain, slowed = followed(free, schedule, START), followed(braked, schedule, START)

    def hardest_stop(motion):
        return -np.diff(np.abs(np.diff(motion.q[:, 3]))).min() / STEP

    assert hardest_stop(slowed) < 0.2 * hardest_stop(plain)
    assert position_errors(braked, schedule, slowed).max() <= TOLERANCE
    assert slowed.q[:, 3].min() >= 0.60
    assert slowed.q[:, 3].max() <= 0.85


def test_joint_that_starts_on_its_limit_leaves_it_in_spite_of_brakes():
    """Eq. 3.29 as printed would hold it there for ever."""
    start = START.copy()
    cell = four_links(limits={3: (start[3], 2.0)}, brakes=True, sequence=joints("j3", "j4"))
    at = tool_poses(cell, (start + np.array([0, 0, 0.1, 0.2]))[None])[0, :3, 3]
    schedule = points_schedule(cell, np.array([0.0, 1.0]), np.stack([at, at]))
    motion = followed(cell, schedule, start)
    assert motion.q[1, 3] > start[3] + 0.1
    assert position_errors(cell, schedule, motion).max() <= TOLERANCE


def test_heavier_joint_moves_less_and_the_others_more():
    """5.4.2: half the share for the first joint; the goal is reached all the same."""
    cell = four_links()
    schedule = circle(cell, START, radius=0.05)
    plain = followed(cell, schedule, START)
    heavy_cell = with_weights(cell, [2.0, 1.0, 1.0, 1.0])
    heavy = followed(heavy_cell, schedule, START)
    assert np.ptp(heavy.q[:, 0]) < 0.8 * np.ptp(plain.q[:, 0])
    assert np.ptp(heavy.q[:, 1:], axis=0).max() > np.ptp(plain.q[:, 1:], axis=0).max()
    assert position_errors(heavy_cell, schedule, heavy).max() <= TOLERANCE


def test_only_the_ratio_of_weights_matters():
    cell = four_links()
    schedule = circle(cell, START, radius=0.02)
    one = followed(with_weights(cell, [2.0, 1.0, 1.0, 4.0]), schedule, START)
    other = followed(with_weights(cell, [20.0, 10.0, 10.0, 40.0]), schedule, START)
    np.testing.assert_allclose(one.q, other.q, atol=1e-12)


def test_joints_left_out_of_the_sequence_stand_still_and_the_first_one_does_most():
    cell = four_links(sequence=joints("j4", "j3", "j2"))
    turned = four_links(sequence=joints("j2", "j3", "j4"))
    schedule = circle(cell, START, radius=0.03)
    one, other = followed(cell, schedule, START), followed(turned, schedule, START)
    assert np.ptp(one.q[:, 0]) == np.ptp(other.q[:, 0]) == 0.0
    assert np.abs(np.diff(one.q[:, 3])).sum() > np.abs(np.diff(other.q[:, 3])).sum()
    for case, motion in ((cell, one), (turned, other)):
        assert position_errors(case, schedule, motion).max() <= TOLERANCE


def test_joints_left_out_stand_still_even_when_the_posture_is_disturbed():
    cell = four_links(sequence=joints("j1", "j2", "j3"))
    schedule = points_schedule(cell, np.array([0.0, 1.0]), np.tile([0.79, 0.0, 0.0], (2, 1)))
    motion = followed(cell, schedule, np.zeros(4))
    assert position_errors(cell, schedule, motion).max() <= TOLERANCE
    assert motion.q[1, 3] == 0.0


def test_first_round_is_the_small_angle_step_of_the_paper():
    """One joint, one round, a goal very near: ``theta = e . (s x r) / |s x r|^2`` (Eq. 3.27 with its factor 2)."""
    cell = four_links(sequence=joints("j2"), rounds=1, tolerance_mm=1e-6)
    at = tool_poses(cell, START[None])[0, :3, 3]
    elbow = 0.2 * np.array([np.cos(START[0]), np.sin(START[0]), 0.0])
    r = at - elbow
    a = np.array([-r[1], r[0], 0.0])
    e = np.array([1e-7, 2e-7, 0.0])
    schedule = points_schedule(cell, np.array([0.0, 1.0]), np.stack([at, at + e]))
    motion = followed(cell, schedule, START)
    assert motion.q[1, 1] - START[1] == pytest.approx(e @ a / (a @ a), rel=1e-8)


def test_cost_falls_far_from_the_goal_where_angles_are_not_small():
    """A goal on the other side of the base: the small-angle step alone would overshoot."""
    cell = four_links()
    goal = np.array([-0.3, 0.2, 0.0])
    schedule = points_schedule(cell, np.array([0.0, 1.0]), np.stack([tool_poses(cell, START[None])[0, :3, 3], goal]))
    motion = followed(cell, schedule, START)
    assert position_errors(cell, schedule, motion).max() <= TOLERANCE


def test_smooth_path_gives_smooth_joints():
    cell = four_links(tolerance_mm=1e-6)
    at = tool_poses(cell, START[None])[0, :3, 3]
    times = np.linspace(0.0, 2.0, 401)
    points = at + quintic(times)[:, None] * [-0.1, 0.05, 0.0]
    motion = followed(cell, points_schedule(cell, times, points), START)
    assert (
        np.abs(np.diff(motion.q, n=3, axis=0)).max() / 0.005**3 < 60.0
    )  # [rad/s^3]: the path's own jerk times 1/reach
