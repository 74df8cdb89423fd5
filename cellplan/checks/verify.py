"""Verification: all results of a run are computed here, from the joint tables that were read back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from cellplan.checks.clearance.check import UNKNOWN, check_clearance
from cellplan.checks.clearance.mounting import check_mounting
from cellplan.checks.clearance.skew import allowed_skew
from cellplan.checks.clearance.stops import check_stops, stop_report
from cellplan.checks.clearance.tool_depth import check_depths, check_standoffs
from cellplan.checks.joints.acceleration_limits import check_accelerations, motion_accelerations
from cellplan.checks.joints.demanded_feeds import check_feeds
from cellplan.checks.joints.drift import check_joint_drift, repeatability
from cellplan.checks.joints.forces import check_forces
from cellplan.checks.joints.greatest_feeds import greatest_feeds
from cellplan.checks.joints.limits import check_joints, check_shown, check_sums
from cellplan.checks.joints.locked import check_locked, with_locked_joints
from cellplan.checks.joints.payload import check_payload, load_uses
from cellplan.checks.joints.torques import check_torques, motion_torques
from cellplan.checks.joints.transfer_speeds import check_idle, check_transfer_speeds
from cellplan.checks.tools.between_checks import (
    check_between_rows,
    check_closures_between,
    check_task_between,
    with_between,
)
from cellplan.checks.tools.conditioning import conditioning
from cellplan.checks.tools.listed_path import check_listed, listed_errors
from cellplan.checks.tools.seam_distances import check_seam_distances
from cellplan.checks.tools.speeds import check_tool_speeds, robot_speed
from cellplan.checks.tools.tracking import check_accuracy, check_closure
from cellplan.checks.tools.weld_position import check_arcs, check_weld_positions
from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.measures.forces.static_forces import force_report, static_forces
from cellplan.measures.forces.wrenches import NO_WRENCHES
from cellplan.measures.joint_use import joint_uses
from cellplan.measures.standoff import standoffs
from cellplan.measures.tool_depth import tool_depths
from cellplan.measures.tool_errors import closure_accuracy, part_poses, task_accuracy
from cellplan.model.cell.cell import Cell, RobotRows, stacked_positions
from cellplan.model.cell.idle import idle_robots
from cellplan.model.motion.motion import JointTable, Schedule
from cellplan.model.progress import Progress, silent
from cellplan.model.report.report import (
    Check,
    ClearanceReport,
    ClosureAccuracy,
    JointUse,
    Report,
    RobotSpeed,
    TaskAccuracy,
)
from cellplan.model.report.skew import has_clocks
from cellplan.scene.scene import Scene

Clearance = tuple[ClearanceReport, tuple[Check, ...]]


def verify(
    scene: Scene,
    schedule: Schedule,
    tables: Sequence[JointTable],
    *,
    moving: Sequence[str],
    idle: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Report:
    """Check tool errors, closed grasps, joint limits and clearance of a run: both steps below, one after the other.

    The kinematics is that of successive screw displacements; nothing of the planner is used.

    Args:
        schedule: Desired tool poses at every sample.
        tables: One joint table per robot, parsed from its text.
        moving: Names of the robots that may move; the others must stand still.
        idle: Names of the robots that must be at their homes; None for those without a task, unless they may move.

    Raises:
        InputError: A table is missing, or does not fit the cell or the clock.
    """
    report = verify_motion(scene, schedule, tables, moving=moving, idle=idle, progress=progress)
    return with_clearance(report, scene, schedule, progress=progress)


def verify_motion(
    scene: Scene,
    schedule: Schedule,
    tables: Sequence[JointTable],
    *,
    moving: Sequence[str],
    idle: Sequence[str] | None = None,
    progress: Progress = silent,
) -> Report:
    """Check everything but the clearance of a run; arguments and errors are those of ``verify``.

    The report does not say yet whether the run passed: ``with_clearance`` completes it.
    """
    cell, q, at_work = scene.cell, _positions(scene.cell, schedule, tables), schedule.names
    idle = [name for name in idle_robots(cell, at_work) if name not in moving] if idle is None else idle
    progress("checking tool errors and joints", 0.0)
    X_WP = part_poses(cell, scene.chains, q)
    accuracy, closures = _errors(scene, schedule, q, X_WP)
    tips, depths = standoffs(cell, schedule, scene.chains, q), tool_depths(cell, schedule, scene.chains, q)
    checks = [*_accuracy_checks(cell, schedule, accuracy), *check_depths(cell, depths), *check_standoffs(cell, tips)]
    checks += with_between(check_closure(cell, schedule.times, closures), check_closures_between(cell, closures))
    (uses, joint_checks), speeds = _joints(cell, schedule.times, q), _speeds(scene, schedule.times, q)
    accelerations = motion_accelerations(cell, scene.chains, schedule, q=q, X_WP=X_WP)
    checks += [*joint_checks, *check_accelerations(cell, accelerations), *check_tool_speeds(cell, speeds)]
    drift = repeatability(cell, schedule, q)
    checks += [*check_joint_drift(drift, is_demanded=cell.motion.cyclic), *check_locked(cell, schedule.times, q)]
    checks += [*check_feeds(scene, schedule, q, X_WP), *check_idle(cell, idle, schedule.times, q)]
    checks += _seam_checks(scene, schedule, q, X_WP)
    checks += check_transfer_speeds(scene, schedule, uses, q) if moving else []
    report = Report(
        cell=cell.name,
        mode=str(cell.motion.mode),
        tasks=at_work,
        idle=tuple(idle),
        checks=tuple(checks),
        accuracy=accuracy,
        joints=tuple(uses),
        clearance=UNKNOWN,
        conditioning=conditioning(cell, schedule, scene.chains, q=q, X_WP=X_WP, moving=moving) if at_work else None,
        motion_share=_motion_share(uses),
        speeds=speeds,
        times=schedule.times,
        q=q,
        repeatability=drift,
        qd={name: np.diff(values, axis=0) / np.diff(schedule.times)[:, None] for name, values in q.items()},
        closures=closures,
        depths=depths,
        standoffs=tips,
        accelerations=accelerations,
        greatest_feeds=greatest_feeds(scene, schedule, q, accuracy),
    )
    return _with_loads(report, scene, schedule, X_WP)


def with_clearance(
    report: Report, scene: Scene, schedule: Schedule, *, is_reported: bool = True, progress: Progress = silent
) -> Report:
    """The report of ``verify_motion``, completed by the clearance of all bodies and the depth of mounted ones."""
    q = stacked_positions(scene.cell, report.q)
    completed_report = completed(report, run_clearance(scene, schedule, q, progress=progress))
    return with_clocks(completed_report, scene, schedule, is_reported=is_reported, progress=progress)


def with_clocks(
    report: Report, scene: Scene, schedule: Schedule, *, is_reported: bool = True, progress: Progress = silent
) -> Report:
    """The report with what only a cell with controllers has: the allowed skew of their clocks, and stops of a robot.

    Args:
        is_reported: Whether figures that no check judges are worked out too: not in a search, of which no report is
            written. Stops count there only if the cell demands something of them.
    """
    if is_reported and has_clocks(scene.cell):
        report = replace(report, skew=allowed_skew(scene, schedule, report.q, report.depths, progress=progress))
    if not is_reported and scene.cell.checks.stop is None:
        return report
    stops = stop_report(scene, schedule, report.q, progress=progress)
    return replace(report, stops=stops, checks=(*report.checks, *check_stops(scene.cell, stops)))


def run_clearance(
    scene: Scene, schedule: Schedule, q: Array, *, with_curves: bool = True, progress: Progress = silent
) -> Clearance:
    """Clearance of all bodies of a run, with the checks of it and of the depth of mounted ones.

    Args:
        q: Stacked joint positions in [rad] or [m], shape (N, nq).
        with_curves: Whether the distances over time are worked out sharply enough to be drawn.
    """
    clearance, checks = check_clearance(scene, schedule, q, with_curves=with_curves, progress=progress)
    return clearance, (*check_mounting(scene, q, schedule.times), *checks)


def completed(report: Report, certified: Clearance) -> Report:
    """The report of ``verify_motion`` with the clearance of the same run."""
    clearance, checks = certified
    return replace(report, checks=(*report.checks, *checks), clearance=clearance)


def _errors(
    scene: Scene, schedule: Schedule, q: RobotRows, X_WP: Array
) -> tuple[tuple[TaskAccuracy, ...], tuple[ClosureAccuracy, ...]]:
    """Errors of all tasks and of all closures, at the rows and between them."""
    listed = listed_errors(schedule, scene.chains, q, X_WP)
    errors = (
        task_accuracy(task, scene.chains[task.task.robot], q=q[task.task.robot], X_WP=X_WP) for task in schedule.tasks
    )
    accuracy = tuple(replace(error, listed=listed.get(error.task)) for error in errors)
    closures = closure_accuracy(scene.cell, scene.chains, q, X_WP)
    return check_between_rows(scene, schedule, q, accuracy=accuracy, closures=closures)


def _with_loads(report: Report, scene: Scene, schedule: Schedule, X_WP: Array) -> Report:
    """The report with what robots carry and bear, and what their bases must hold."""
    cell, chains, q = scene.cell, scene.chains, report.q
    loads = load_uses(cell, chains, report.times, q)
    static = static_forces(cell, chains, schedule, q, X_WP, report.closures)
    forces, acting = force_report(static, chains, q), NO_WRENCHES if static is None else static.by_processes
    torques = motion_torques(cell, schedule, q, acting)
    return replace(
        report,
        checks=(*report.checks, *check_payload(loads), *check_forces(cell, forces), *check_torques(torques)),
        loads=loads,
        torques=torques,
        forces=forces,
    )


def _seam_checks(scene: Scene, schedule: Schedule, q: RobotRows, X_WP: Array) -> list[Check]:
    """Positions of welds, arcs of tools, and distances from seams and walls."""
    cell, chains = scene.cell, scene.chains
    welds, arcs = check_weld_positions(schedule, chains, q, X_WP), check_arcs(cell, schedule, chains, q)
    return [*welds, *arcs, *check_seam_distances(cell, schedule, chains, q, X_WP)]


def _accuracy_checks(cell: Cell, schedule: Schedule, accuracy: Sequence[TaskAccuracy]) -> list[Check]:
    """Whether the tools are where they must be; where a joint failed, what it cost."""
    checks: list[Check] = []
    for scheduled, errors in zip(schedule.tasks, accuracy, strict=True):
        tolerance = scheduled.task.tolerance
        at_rows = check_accuracy(schedule, errors, scheduled.task)
        merged = with_between(at_rows, check_task_between(errors, tolerance))
        checks += with_locked_joints(merged, errors, tolerance, times=schedule.times, locked=cell.motion.locked)
        checks += check_listed(scheduled.task, errors.listed)
    return checks


def _joints(cell: Cell, times: Array, q: RobotRows) -> tuple[list[JointUse], list[Check]]:
    """How all joints are used, and whether they stay within their limits."""
    uses: list[JointUse] = []
    checks: list[Check] = []
    for robot in cell.robots:
        robot_uses = joint_uses(robot, times, q[robot.name])
        uses += robot_uses
        checks += [*check_joints(robot_uses, times, q[robot.name]), *check_shown(robot, times, q[robot.name])]
        checks += check_sums(robot, times, q[robot.name])
    return uses, checks


def _speeds(scene: Scene, times: Array, q: RobotRows) -> dict[str, RobotSpeed]:
    """How fast each robot moves in the world."""
    return {
        robot.name: robot_speed(robot, scene.chains[robot.name], times, q[robot.name]) for robot in scene.cell.robots
    }


def _positions(cell: Cell, schedule: Schedule, tables: Sequence[JointTable]) -> Mapping[str, Array]:
    """Positions by robot name, after making sure that the tables are complete and fit the cell and the clock."""
    by_name = {table.robot: table for table in tables}
    if len(by_name) != len(tables) or set(by_name) != {robot.name for robot in cell.robots}:
        raise InputError(f"tables: expected one for each of {[robot.name for robot in cell.robots]}, got {[*by_name]}")
    for robot in cell.robots:
        table = by_name[robot.name]
        if table.joints != robot.model.joint_names:
            raise InputError(f"table of '{robot.name}': expected joints {robot.model.joint_names}, got {table.joints}")
        if not np.array_equal(table.times, schedule.times):
            raise InputError(f"table of '{robot.name}': its times differ from those of the schedule")
        if not np.all(np.isfinite(table.q)):
            raise InputError(f"table of '{robot.name}': a position is not a finite number")
    return {name: table.q for name, table in by_name.items()}


def _motion_share(uses: Sequence[JointUse]) -> dict[str, tuple[float, str]]:
    """Share of all motion that each robot does, and its busiest joint.

    Motion is the time each joint would need for its travel at its top speed, so that turning and sliding joints, large
    and small ones, can be added.
    """
    effort: dict[str, dict[str, float]] = {}
    for use in uses:
        effort.setdefault(use.robot, {})[use.joint] = use.travel / use.velocity_limit
    total = sum(sum(joints.values()) for joints in effort.values())
    return {
        robot: (sum(joints.values()) / total if total else 0.0, max(joints, key=lambda name: joints[name]))
        for robot, joints in effort.items()
    }
