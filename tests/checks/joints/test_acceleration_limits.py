"""Joints, tools and part of a written motion against stated and assumed limits, on motions known by hand."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from builders.planar_arm import LINK, RADIUS, START, circle_schedule, planar_arm_cell

from cellplan.checks.joints.acceleration_limits import check_accelerations, motion_accelerations
from cellplan.geometry.shapes import Box
from cellplan.geometry.transforms import Array, pose
from cellplan.model.cell.acceleration import AccelerationRule, LimitSource, MotionAccelerations
from cellplan.model.cell.cell import Cell, Grasp
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.model.settings.motion import LockedJointEntry
from cellplan.scene.kinematics.screw_chain import ScrewChain

STEPS = 1000  # of 1 ms


def smooth(times: Array) -> Array:
    tau = times / times[-1]
    return tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2)


def turning(share: Array, joint: int = 0, *, by: float = 1.0) -> Array:
    q = np.tile(START, (len(share), 1))
    q[:, joint] += by * share
    return q


def accelerations_of(
    cell: Cell, q: Array, schedule: Schedule | None = None
) -> tuple[MotionAccelerations, dict[str, list[Check]]]:
    clock = schedule or circle_schedule(cell, steps=len(q) - 1)
    chains = {"arm": ScrewChain(cell.robots[0])}
    X_WP = chains["arm"].tool_poses(q) if cell.part.held_by else np.eye(4)[None]
    accelerations = motion_accelerations(cell, chains, clock, q={"arm": q}, X_WP=X_WP)
    checks: dict[str, list[Check]] = {}
    for check in check_accelerations(cell, accelerations):
        checks.setdefault(check.name, []).append(check)
    return accelerations, checks


def ruled(rule: AccelerationRule, limits: dict[str, dict[str, float]] | None = None) -> Cell:
    cell = planar_arm_cell(limits=limits)
    return replace(cell, robots=(replace(cell.robots[0], acceleration=rule),))


def times_of(steps: int) -> Array:
    return np.linspace(0.0, 1.0, steps + 1)


def test_every_joint_is_judged_and_an_assumed_limit_is_named_as_such() -> None:
    _, checks = accelerations_of(planar_arm_cell(), turning(smooth(times_of(STEPS))))

    assert {name: len(checks_of_joint) for name, checks_of_joint in checks.items()} == {"joint_acceleration_assumed": 4}
    first, *_, last = checks["joint_acceleration_assumed"]
    assert first.passed
    assert first.value == pytest.approx(np.degrees(10.0 / np.sqrt(3.0)), rel=1e-4)
    assert first.limit == pytest.approx(np.degrees(20.0 / 0.25))  # 20 rad/s within 0.25 s
    assert last.limit == pytest.approx(np.degrees(20.0 / 0.15))
    assert "assumed limit 4583.7 deg/s2: full speed in 0.25 s" in first.message


@pytest.mark.parametrize(("limit", "passed"), [(5.8, True), (5.7, False)])
def test_a_stated_limit_is_held_on_both_sides(limit: float, passed: bool) -> None:
    _, checks = accelerations_of(
        planar_arm_cell(limits={"q1": {"acceleration": limit}}), turning(smooth(times_of(STEPS)))
    )

    (check,) = checks["joint_acceleration"]
    assert check.passed == passed
    assert check.limit == pytest.approx(np.degrees(limit))
    assert len(checks["joint_acceleration_assumed"]) == 3


@pytest.mark.parametrize("steps", [1000, 100, 20])
def test_a_motion_that_starts_at_speed_fails_at_any_step_and_says_why(steps: int) -> None:
    _, checks = accelerations_of(planar_arm_cell(), turning(times_of(steps)))

    first = checks["joint_acceleration_assumed"][0]
    assert not first.passed
    assert first.at_s in {0.0, 1.0}
    assert first.message.endswith("; its velocity is discontinuous")


def test_unlimited_accelerations_are_reported_with_the_reason_and_not_judged() -> None:
    rule = AccelerationRule(full_speed_in=(), is_unlimited=True, reason="a study")
    accelerations, checks = accelerations_of(
        ruled(rule, {"q1": {"acceleration": 0.1, "jerk": 0.1}}), turning(times_of(STEPS))
    )

    assert not checks
    assert accelerations.joints[0].source is LimitSource.UNLIMITED
    assert accelerations.joints[0].peak == pytest.approx(1000.0)
    assert [(left.robot, left.reason) for left in accelerations.not_judged] == [("arm", "a study")]


@pytest.mark.parametrize(("limit", "passed"), [(60.0, True), (55.0, False)])
def test_jerk_is_held_where_a_limit_is_stated(limit: float, passed: bool) -> None:
    _, checks = accelerations_of(planar_arm_cell(limits={"q2": {"jerk": limit}}), turning(smooth(times_of(STEPS)), 1))

    (check,) = checks["joint_jerk"]
    assert check.passed == passed
    assert check.subject == "arm/q2"
    assert check.value == pytest.approx(np.degrees(60.0), rel=0.02)


def test_the_instant_at_which_a_joint_fails_is_left_out_and_reported() -> None:
    cell = planar_arm_cell()
    times = times_of(STEPS)
    share = np.minimum(smooth(times), smooth(np.array([0.0, 0.5, 1.0]))[1])  # stops at once in the middle
    assert not accelerations_of(cell, turning(share))[1]["joint_acceleration_assumed"][0].passed

    locked = replace(cell.motion, locked=(LockedJointEntry(robot="arm", joint="q1", from_s=0.5),))
    accelerations, checks = accelerations_of(replace(cell, motion=locked), turning(share))

    assert all(check.passed for check in checks["joint_acceleration_assumed"])
    assert [left.what for left in accelerations.not_judged] == ["accelerations at 0.500 s, when arm/q1 fails"]


def test_tool_and_part_are_reported_in_the_world_and_the_part_may_be_limited() -> None:
    cell = planar_arm_cell()
    cell = replace(cell, robots=(replace(cell.robots[0], start=np.zeros(4)),))
    q = np.zeros((STEPS + 1, 4))
    q[:, 0] = smooth(times_of(STEPS))  # the stretched arm turns about its base
    part = replace(
        cell.part, shape=Box((0.4, 0.02, 0.02)), X_PS=np.eye(4), X_WP=None, held_by=(Grasp(robot="arm", X_PT=pose()),)
    )
    accelerations, _ = accelerations_of(replace(cell, part=part), q)
    tau = times_of(STEPS)
    rate, speeding = 30.0 * (tau * (1.0 - tau)) ** 2, 60.0 * tau * (1.0 - tau) * (1.0 - 2.0 * tau)
    per_metre = float(np.hypot(rate**2, speeding).max())

    assert accelerations.tools["arm"].peak == pytest.approx(4 * LINK * per_metre, rel=1e-4)
    assert accelerations.part is not None
    assert accelerations.part.centre.peak == pytest.approx(4 * LINK * per_metre, rel=1e-4)
    assert accelerations.part.corner.peak == pytest.approx(float(np.hypot(4 * LINK + 0.2, 0.01)) * per_metre, rel=1e-4)
    for limit, passed in ((5.9, True), (5.8, False)):
        strict = replace(cell, part=part, checks=cell.checks.changed(part_acceleration_m_s2=limit))
        (check,) = accelerations_of(strict, q)[1]["part_acceleration"]
        assert check.passed == passed


@pytest.mark.parametrize(("is_smooth", "ratio", "share", "stretches"), [(False, 1.0, 1.0, 0), (True, 1.875, 0.16, 2)])
def test_process_speed_has_mean_peak_and_the_stretches_that_are_slower(
    is_smooth: bool, ratio: float, share: float, stretches: int
) -> None:
    cell = planar_arm_cell()
    schedule = circle_schedule(cell, smooth=is_smooth)
    accelerations, _ = accelerations_of(cell, inverse_of(schedule), schedule)

    speed = accelerations.process[cell.tasks[0].name]
    assert speed.mean == pytest.approx(2.0 * np.pi * RADIUS, rel=1e-3)
    assert speed.peak == pytest.approx(ratio * speed.mean, rel=1e-3)
    assert speed.steady_share == pytest.approx(share, abs=0.01)
    assert len(speed.slower) == stretches
    ends = [bound for stretch in speed.slower for bound in stretch]
    assert ends == sorted(ends)
    assert not ends or (ends[0], ends[-1]) == (schedule.times[0], pytest.approx(schedule.times[-1], abs=1e-12))


def inverse_of(schedule: Schedule) -> Array:
    """Joint positions of the arm whose two middle joints stay where they are in pairs: closed form of two links."""
    target = schedule.tasks[0].X_PT[:, :2, 3]
    upper, fore = 2.0 * LINK, 2.0 * LINK  # joints 2 and 4 at zero: two links of double length
    reach = np.linalg.norm(target, axis=1)
    elbow = np.pi - np.arccos((upper**2 + fore**2 - reach**2) / (2.0 * upper * fore))
    shoulder = np.arctan2(target[:, 1], target[:, 0]) - 0.5 * elbow
    columns: Sequence[Array] = (shoulder, np.zeros_like(elbow), elbow, np.zeros_like(elbow))
    return np.stack(columns, axis=1)
