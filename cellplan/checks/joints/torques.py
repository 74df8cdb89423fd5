"""Torques of the drives in the written motion, against their largest ones."""

import numpy as np

from cellplan.checks.joints.acceleration_limits import judged_rows
from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import joint_accelerations, point_accelerations
from cellplan.measures.forces.wrenches import NO_WRENCHES
from cellplan.measures.torques import robot_torques
from cellplan.measures.velocity_jumps import NO_TIMES, desired_jumps
from cellplan.model.cell.cell import Cell, Robot, RobotRows
from cellplan.model.motion.motion import Schedule
from cellplan.model.report.report import Check
from cellplan.model.robot.torque import JointTorque, RobotTorques


def motion_torques(
    cell: Cell, schedule: Schedule, q: RobotRows, acting: RobotRows = NO_WRENCHES
) -> tuple[RobotTorques, ...]:
    """Torques of all robots, with the accelerations that are judged.

    Args:
        q: Positions that were read back in [rad] or [m], shape (N, n), by robot.
        acting: What processes exert on robots, at the origin of the world and expressed in it, shape (N, 6).
    """
    times, judged = schedule.times, judged_rows(cell, schedule.times)
    jumps_at = desired_jumps(schedule) if schedule.is_continuous else NO_TIMES

    def accelerations(robot: Robot) -> Array:
        """At the rows, with their signs; zero where they are not judged."""
        rows = q[robot.name]
        sizes = joint_accelerations(times, rows, cycle=robot.controller_cycle, jumps_at=jumps_at).values
        return np.where(judged[:, None], np.copysign(sizes, point_accelerations(times, rows)), 0.0)

    return tuple(
        robot_torques(cell, robot, times, q[robot.name], accelerations(robot), acting.get(robot.name))
        for robot in cell.robots
    )


def check_torques_at_rest(cell: Cell, start: Array) -> list[Check]:
    """Whether the drives hold the robots at one stacked configuration of shape (nq,) in [rad] or [m]."""
    still = {robot.name: np.tile(start[cell.columns(robot.name)], (2, 1)) for robot in cell.robots}
    rows = ((robot, still[robot.name]) for robot in cell.robots)
    return check_torques(tuple(robot_torques(cell, it, np.arange(2.0), q, np.zeros_like(q)) for it, q in rows))


def check_torques(torques: tuple[RobotTorques, ...]) -> list[Check]:
    """Whether each drive has the torque that the motion takes, where both are known."""
    return [_check(use.robot, joint, joint.limit) for use in torques for joint in use.joints if joint.limit is not None]


def _check(robot: str, joint: JointTorque, limit: float) -> Check:
    name, passed, unit = f"{robot}/{joint.joint}", joint.peak <= limit, joint.unit
    verdict = "has a peak torque of" if passed else "exceeds its largest torque:"
    message = (
        f"joint {name} {verdict if joint.is_revolute else verdict.replace('torque', 'force')} {joint.peak:.4g} {unit} "
        f"at {joint.peak_at_s:.3f} s (limit {limit:.5g} {unit}, root mean square {joint.rms:.4g} {unit})"
    )
    return Check("joint_torque", name, passed, message, value=joint.peak, limit=limit, unit=unit, at_s=joint.peak_at_s)
