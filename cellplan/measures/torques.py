"""Torques in rows: largest and mean ones of each drive, work and power; no verdicts."""

from collections.abc import Iterator, Mapping

import numpy as np

from cellplan.geometry.arrays import Array, first_peak
from cellplan.measures.base_reactions import base_reaction
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.base_reaction import BaseReaction
from cellplan.model.robot.torque import JointTorque, RobotTorques
from cellplan.scene.dynamics.loads import carried_masses
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.dynamics.soundness import missing_masses
from cellplan.scene.kinematics.screw_chain import ScrewChain


def robot_torques(
    cell: Cell, robot: Robot, times: Array, q: Array, accelerations: Array, acting: Array | None = None
) -> RobotTorques:
    """Torques of one robot over a run.

    From row to row the accelerations change linearly. The torques are worked out at the rows and halfway between them;
    the largest one is that of the parabolas through two rows and the point between them, which differ from the torques
    by terms of the third order in the step. That is an estimate, not a proof.

    Args:
        times: Times in [s], shape (N,).
        q: Positions in [rad] or [m], shape (N, n).
        accelerations: At the rows in [rad/s^2] or [m/s^2], with their signs, shape (N, n).
        acting: What processes exert on the robot, at the origin of the world and expressed in it, shape (N, 6), linear
            from row to row; None for nothing.
    """
    missing = missing_masses(cell, robot)
    if missing:
        return RobotTorques(robot=robot.name, missing=missing)
    rows = halved_rows(times, q, accelerations)
    chain = ScrewChain(robot)  # of its own: that of the checks has the displacements of the rows at hand
    moving, still = (
        joint_torques(chain, robot.model, it, carried=carried_masses(cell, robot), wrench_W=wrench_W)
        for it, wrench_W in ((rows, halved_wrench(acting)), (at_rest(rows.q), None))
    )
    torques = moving.joints
    halved = np.empty(2 * len(times) - 1)
    halved[::2], halved[1::2] = times, 0.5 * (times[1:] + times[:-1])
    power = np.sum(np.maximum(torques * rows.qd, 0.0), axis=1)
    hardest = first_peak(power)
    return RobotTorques(
        robot=robot.name,
        duration=float(times[-1] - times[0]),
        joints=tuple(_joint(robot, index, times, torques[:, index]) for index in range(q.shape[1])),
        energy=_integral(times, power),
        peak_power=float(power[hardest]),
        peak_power_at_s=float(halved[hardest]),
        reaction=base_reaction(robot.name, halved, moving.base_W, still.base_W),
    )


def standing_reactions(cell: Cell, q: Mapping[str, Array]) -> Iterator[BaseReaction]:
    """What the bases of robots with known masses must hold while all stand still, q of shape (n,) by robot."""
    for robot in cell.robots:
        if not missing_masses(cell, robot):
            rows, carried = at_rest(q[robot.name][None]), carried_masses(cell, robot)
            held = joint_torques(ScrewChain(robot), robot.model, rows, carried=carried).base_W
            yield base_reaction(robot.name, np.zeros(1), held, held)


def halved_rows(times: Array, q: Array, accelerations: Array) -> JointRows:
    """A motion at N rows and halfway between them, 2 N - 1 in all, with accelerations that change linearly.

    The speed at a row is the mean of those of the steps beside it, with rest before the first row and after the last.
    """
    steps = np.diff(times)[:, None]
    speeds = np.diff(q, axis=0) / steps
    still = np.zeros_like(q[:1])
    at_rows = 0.5 * (np.concatenate([still, speeds]) + np.concatenate([speeds, still]))
    middle = 0.5 * (accelerations[1:] + accelerations[:-1])
    between = 0.5 * (q[1:] + q[:-1]) - 0.125 * steps * steps * middle
    return JointRows(
        q=_alternating(q, between), qd=_alternating(at_rows, speeds), qdd=_alternating(accelerations, middle)
    )


def halved_wrench(wrench_W: Array | None) -> Array | None:
    """A wrench at N rows and halfway between them, where it is the mean; None stays."""
    return None if wrench_W is None else _alternating(wrench_W, 0.5 * (wrench_W[1:] + wrench_W[:-1]))


def at_rest(q: Array) -> JointRows:
    """Configurations of shape (N, n) in which a robot stands still."""
    return JointRows(q=q, qd=np.zeros_like(q), qdd=np.zeros_like(q))


def _alternating(at_rows: Array, between: Array) -> Array:
    """Values at rows and between them in their order."""
    both = np.empty((len(at_rows) + len(between), at_rows.shape[1]))
    both[::2], both[1::2] = at_rows, between
    return both


def _joint(robot: Robot, index: int, times: Array, torque: Array) -> JointTorque:
    """The largest torque of a joint, at rows and in the parabolas between them, and the mean one."""
    joint = robot.model.joints[index]
    sizes, share = step_peaks(torque)
    step = first_peak(sizes.max(axis=0))
    at = (0.0, 0.5, 1.0, float(share[step]))[first_peak(sizes[:, step])]
    return JointTorque(
        joint=joint.name,
        is_revolute=joint.is_revolute,
        peak=float(sizes.max()),
        peak_at_s=float(times[step] + at * (times[step + 1] - times[step])),
        rms=float(np.sqrt(_integral(times, torque * torque) / (times[-1] - times[0]))),
        limit=joint.torque,
    )


def in_steps(halved: Array) -> Array:
    """Values at the begin, in the middle and at the end of each step, shape (3, N - 1, ...), from 2 N - 1 ones."""
    return np.stack([halved[:-1:2], halved[1::2], halved[2::2]])


def step_peaks(halved: Array) -> tuple[Array, Array]:
    """Sizes in each step of values at rows and halfway between them, which are parabolas in between.

    Returns:
        Those at its begin, in its middle, at its end and at the peak of the parabola, shape (4, N - 1, ...), and the
        share of the step at which that is, shape (N - 1, ...).
    """
    first, middle, last = in_steps(halved)
    slope, bend = -3.0 * first + 4.0 * middle - last, 2.0 * (first - 2.0 * middle + last)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = -0.5 * slope / bend
    share = np.where((share > 0.0) & (share < 1.0), share, 0.0)
    return np.abs(np.stack([first, middle, last, first + share * (slope + share * bend)])), share


def _integral(times: Array, halved: Array) -> float:
    """Integral over the time of a quantity at rows and halfway between them, by Simpson's rule."""
    return float(np.diff(times) @ (halved[:-1:2] + 4.0 * halved[1::2] + halved[2::2]) / 6.0)
