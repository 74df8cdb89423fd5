"""Accelerations and jerk of joints, tools and part, and the limits of the joints, stated or assumed."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cellplan.checks.tools.speeds import process_speeds
from cellplan.geometry.arrays import Array, Flags, first_peak
from cellplan.measures.accelerations import (
    jerks,
    joint_accelerations,
    part_acceleration,
    point_accelerations,
    point_peaks,
)
from cellplan.measures.velocity_jumps import NO_TIMES, desired_jumps
from cellplan.model.cell.acceleration import (
    JointAcceleration,
    LimitSource,
    MotionAccelerations,
    NotJudged,
    PointAcceleration,
    full_speed_in,
)
from cellplan.model.cell.cell import Cell, Robot, RobotRows
from cellplan.model.cell.joint_limits import acceleration_limit
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.scene.kinematics.screw_chain import Chains

FAILURE_ROWS: Final = (1.5, 2.5)  # [-] steps before and after the instant at which a joint fails: not judged
FAILURE_REASON: Final = "a failing joint stops instantly, and the others compensate instantly"


def motion_accelerations(
    cell: Cell, chains: Chains, schedule: Schedule, *, q: RobotRows, X_WP: Array
) -> MotionAccelerations:
    """Accelerations, jerk and process speeds of the written tables.

    Args:
        q: Positions that were read back in [rad] or [m], shape (N, n), by robot.
        X_WP: The part in the world, shape (N, 4, 4), or (1, 4, 4) for a part at a fixed place.
    """
    times = schedule.times
    X_WT = {robot.name: chains[robot.name].tool_poses(q[robot.name]) for robot in cell.robots}
    cycles = {robot.name: robot.controller_cycle for robot in cell.robots}
    judged = judged_rows(cell, times)
    jumps_at = desired_jumps(schedule) if schedule.is_continuous else NO_TIMES
    joints = (_joints(robot, times, q[robot.name], judged=judged, jumps_at=jumps_at) for robot in cell.robots)
    return MotionAccelerations(
        joints=tuple(use for uses in joints for use in uses),
        tools={name: point_peaks(times, poses[:, None, :3, 3], window=cycles[name])[0] for name, poses in X_WT.items()},
        part=part_acceleration(cell, times, X_WP, window=cycles[cell.positioners[0]]) if cell.positioners else None,
        process=process_speeds(schedule, X_WT, X_WP),
        not_judged=tuple(_not_judged(cell)),
    )


def joint_peaks(
    cell: Cell, robot: Robot, times: Array, q: Array, *, jumps_at: Array = NO_TIMES
) -> Iterator[JointAcceleration]:
    """Largest acceleration and jerk of every joint of one robot, on rows of its own.

    Args:
        times: Times in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n).
        jumps_at: Where the desired speed of a tool jumps, in [s], shape (J,).
    """
    return _joints(robot, times, q, judged=judged_rows(cell, times), jumps_at=jumps_at)


def check_accelerations(cell: Cell, accelerations: MotionAccelerations) -> list[Check]:
    """Acceleration of every joint that has a limit, jerk where a limit is stated, and that of the part."""
    checks: list[Check] = []
    for use in accelerations.joints:
        checks += [] if use.limit is None else [_check_acceleration(cell, use, use.limit)]
        checks += [] if use.jerk_limit is None else [_check_jerk(use, use.jerk_limit)]
    limit = cell.checks.part_acceleration_m_s2
    if limit is not None and accelerations.part is not None:
        checks.append(_check_part(accelerations.part.corner, limit))
    return checks


def _joints(robot: Robot, times: Array, q: Array, *, judged: Flags, jumps_at: Array) -> Iterator[JointAcceleration]:
    signed = np.where(judged[:, None], point_accelerations(times, q), 0.0)
    rows = joint_accelerations(times, q, cycle=robot.controller_cycle, jumps_at=jumps_at)
    sizes = np.where(judged[:, None], rows.values, 0.0)
    jerk = jerks(times, signed[..., None], window=robot.controller_cycle)
    for index, joint in enumerate(robot.model.joints):
        k, m = first_peak(sizes[:, index]), first_peak(jerk[:, index])
        limit, source = acceleration_limit(robot, index)
        yield JointAcceleration(
            robot=robot.name,
            joint=joint.name,
            is_revolute=joint.is_revolute,
            peak=float(sizes[:, index].max()),
            peak_at_s=float(times[k]),
            limit=limit,
            source=source,
            peak_jerk=float(jerk[:, index].max()),
            peak_jerk_at_s=float(times[m]),
            jerk_limit=None if robot.acceleration.is_unlimited else joint.jerk,
            window=robot.controller_cycle,
            is_jump=bool(rows.is_jump[k, index]),
        )


def judged_rows(cell: Cell, times: Array) -> Flags:
    """Rows that are judged, shape (N,): all but those at which a joint fails."""
    step = float(times[-1]) / (len(times) - 1)
    judged = np.ones(len(times), dtype=bool)
    for lock in cell.motion.locked:
        if lock.from_s > 0.0:
            late = (times - lock.from_s) / step
            judged &= (late < -FAILURE_ROWS[0]) | (late > FAILURE_ROWS[1])
    return judged


def _not_judged(cell: Cell) -> Iterator[NotJudged]:
    """What is left out, robot by robot, then failing joints."""
    for robot in cell.robots:
        rule = robot.acceleration
        missing = [joint.name for joint in robot.model.joints if joint.acceleration is None]
        if rule.is_unlimited:
            yield NotJudged(robot=robot.name, what="accelerations and jerk", reason=rule.reason or "no reason given")
        elif missing and not rule.full_speed_in:
            what = f"accelerations of {', '.join(missing)}"
            yield NotJudged(robot=robot.name, what=what, reason="no limit is stated")
    for lock in cell.motion.locked:
        if lock.from_s > 0.0:
            what = f"accelerations at {lock.from_s:.3f} s, when {lock.robot}/{lock.joint} fails"
            yield NotJudged(robot="", what=what, reason=FAILURE_REASON)


def _check_acceleration(cell: Cell, use: JointAcceleration, limit: float) -> Check:
    """One joint's largest acceleration; the name says when its limit is assumed."""
    joint, name, (unit, scale) = f"{use.robot}/{use.joint}", "joint_acceleration", use.display_unit
    passed, peak, most, unit = use.peak <= limit, scale * use.peak, scale * limit, f"{unit}/s2"
    verdict = "has a peak acceleration of" if passed else "exceeds its acceleration limit:"
    against = f"limit {most:.5g} {unit}"
    if use.source is LimitSource.ASSUMED:
        name, index = "joint_acceleration_assumed", cell.robot(use.robot).model.joint_names.index(use.joint)
        against = f"assumed {against}: full speed in {full_speed_in(cell.robot(use.robot).acceleration, index):g} s"
    jump = "; its velocity is discontinuous" if use.is_jump and not passed else ""
    message = f"joint {joint} {verdict} {peak:.4g} {unit} at {use.peak_at_s:.3f} s ({against}){jump}"
    return Check(name, joint, passed, message, value=peak, limit=most, unit=unit, at_s=use.peak_at_s)


def _check_jerk(use: JointAcceleration, limit: float) -> Check:
    """One joint's largest jerk."""
    joint, (unit, scale), at_s = f"{use.robot}/{use.joint}", use.display_unit, use.peak_jerk_at_s
    peak, most, unit = scale * use.peak_jerk, scale * limit, f"{unit}/s3"
    message = (
        f"joint {joint} has a peak jerk of {peak:.4g} {unit} over {1e3 * use.window:g} ms at {at_s:.3f} s, "
        f"limit {most:g} {unit}"
    )
    return Check("joint_jerk", joint, use.peak_jerk <= limit, message, value=peak, limit=most, unit=unit, at_s=at_s)


def _check_part(corner: PointAcceleration, limit: float) -> Check:
    """The part's largest acceleration."""
    peak, at_s = corner.peak, corner.peak_at_s
    message = (
        f"part has a peak acceleration of {peak:.4g} m/s2 (a corner of its bounding box) at {at_s:.3f} s, "
        f"allowed {limit:g} m/s2"
    )
    return Check("part_acceleration", "part", peak <= limit, message, value=peak, limit=limit, unit="m/s2", at_s=at_s)
