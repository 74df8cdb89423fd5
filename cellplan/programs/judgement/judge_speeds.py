"""Speeds and accelerations of played rows: of joints on the rows of each robot, of tools and part at even times."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

import numpy as np

from cellplan.checks.joints.acceleration_limits import check_accelerations, joint_peaks
from cellplan.checks.joints.demanded_feeds import check_feeds
from cellplan.checks.joints.forces import check_forces
from cellplan.checks.joints.limits import check_joints, check_shown, check_sums
from cellplan.checks.joints.payload import check_payload, load_uses
from cellplan.checks.tools.speeds import check_tool_speeds, robot_speed
from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import part_acceleration
from cellplan.measures.forces.static_forces import force_report, static_forces
from cellplan.measures.joint_use import joint_uses
from cellplan.measures.tool_errors import part_poses
from cellplan.measures.velocity_jumps import NO_TIMES, desired_jumps
from cellplan.model.cell.acceleration import MotionAccelerations
from cellplan.model.cell.cell import Robot
from cellplan.model.report.exported import Interpolation
from cellplan.model.report.report import Check
from cellplan.programs.elements.timed_rows import cycle_of
from cellplan.programs.judgement.judge_path import schedule_at
from cellplan.programs.rows.played import ExecutedProgram, ExecutedStretch
from cellplan.programs.rows.rows import times_of
from cellplan.scene.scene import Scene

POSITION: Final = "joint_position"
JERK: Final = "joint_jerk"
EVEN: Final = 1e-6  # [-] of a step by which times of even rows may differ


def position_findings(played: ExecutedProgram) -> Iterator[str]:
    """Rows beyond the limits of a joint, or cubics that pass one between rows."""
    for name in played.exported:
        robot, rows = played.run.cell.robot(name), played.rows[name]
        times, q = times_of(rows), rows.q
        if played.interpolation is Interpolation.CUBIC:
            low, high = played.curve(name).extremes()
            times, q = np.repeat(times[:-1], 2) + 0.0, np.stack([low, high], axis=1).reshape(-1, q.shape[1])
            times = times + np.tile([0.0, 1e-6], len(low))
        uses = joint_uses(robot, times, q)
        checks = [check for check in check_joints(uses, times, q) if check.name == POSITION]
        for check_rows in (check_shown, check_sums):
            checks += check_rows(robot, times_of(rows), rows.q)
        yield from _failed(checks, played.phase_at)


def joint_findings(played: ExecutedProgram, *, accelerations: bool) -> Iterator[str]:
    """Speeds beyond the limits of a joint; accelerations and jerk too where a controller plays its rows as they are."""
    jumps = _jumps(played)
    for name in played.exported:
        robot = played.run.cell.robot(name)
        times, q = _as_played(played, robot)
        uses = joint_uses(robot, times, q)
        yield from _failed((check for check in check_joints(uses, times, q) if check.name != POSITION), played.phase_at)
        if accelerations:
            motion = MotionAccelerations(joints=tuple(joint_peaks(played.run.cell, robot, times, q, jumps_at=jumps)))
            checks = check_accelerations(played.run.cell, motion)
            judged = (check for check in checks if check.name != JERK or _is_even(times))
            yield from _failed(judged, played.phase_at)


def motion_findings(played: ExecutedProgram, stretch: ExecutedStretch, scene: Scene) -> Iterator[str]:
    """Feeds of tools, their speeds in the world, loads and the acceleration of the part in one phase.

    They are taken at even times, as far apart as the rows of the run, or as the rows of the slowest cycle where these
    are farther apart.
    """
    cell = scene.cell
    steps = [np.diff(played.run_times).max(), *(np.diff(times_of(played.rows[name])).max() for name in played.exported)]
    count = max(2, round((stretch.end - stretch.begin) / max(steps)))
    times = np.linspace(0.0, stretch.end - stretch.begin, count + 1)
    q: Mapping[str, Array] = played.at(stretch.begin + times)
    X_WP, schedule = part_poses(cell, scene.chains, q), schedule_at(stretch.motion.schedule, times)
    speeds = {robot.name: robot_speed(robot, scene.chains[robot.name], times, q[robot.name]) for robot in cell.robots}
    checks = [*check_feeds(scene, schedule, q, X_WP), *check_tool_speeds(cell, speeds)]
    checks += check_payload(load_uses(cell, scene.chains, times, q))
    forces = static_forces(cell, scene.chains, schedule, q, X_WP)
    checks += check_forces(cell, force_report(forces, scene.chains, q))
    if cell.checks.part_acceleration_m_s2 is not None and cell.positioners:
        window = cell.robot(cell.positioners[0]).controller_cycle
        part = part_acceleration(cell, times, X_WP, window=window)
        checks += check_accelerations(cell, MotionAccelerations(part=part))
    yield from _failed(checks, lambda _: stretch.motion.name or "")


def _as_played(played: ExecutedProgram, robot: Robot) -> tuple[Array, Array]:
    """Times and positions at which the speeds of a robot count: its rows, or a cubic on its controller's cycle."""
    rows = played.rows[robot.name]
    times = times_of(rows)
    cycle = cycle_of(robot)
    if played.interpolation is not Interpolation.CUBIC or cycle >= float(np.diff(times).min()):
        return times, rows.q
    fine = np.linspace(times[0], times[-1], int(np.ceil((times[-1] - times[0]) / cycle)) + 1)
    return fine, played.curve(robot.name).at(fine)


def _jumps(played: ExecutedProgram) -> Array:
    """Times in [s] of the played program at which the desired speed of a tool jumps."""
    schedules = ((stretch.begin, stretch.motion.schedule) for stretch in played.stretches())
    jumps = [begin + desired_jumps(schedule) for begin, schedule in schedules if schedule.is_continuous]
    return np.concatenate([NO_TIMES, *jumps])


def _is_even(times: Array) -> bool:
    """Whether all steps are the same, as a window over which jerk is taken expects."""
    steps = np.diff(times)
    return bool(np.ptp(steps) <= EVEN * steps[0])


def _failed(checks: Iterable[Check], phase_at: Callable[[float | None], str]) -> Iterator[str]:
    """The messages of what fails, each with the phase of its time."""
    for check in checks:
        if not check.passed:
            phase = phase_at(check.at_s)
            yield f"{check.message}, in {phase}" if phase else check.message
