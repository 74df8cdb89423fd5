"""Torques that a motion takes, by the recursive equations of Newton and Euler, for all rows at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.robot.inertia import CarriedMass, LinkInertia
from cellplan.model.robot.robot import BASE, RobotModel
from cellplan.scene.dynamics.loads import GRAVITY
from cellplan.scene.kinematics.screw_chain import ScrewChain, moved_screw

DOWN = np.array([0.0, 0.0, -GRAVITY])  # [m/s^2] in W


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointRows:
    """A motion of one robot: positions, speeds and accelerations of its driven joints, shape (N, n) each."""

    q: Array  # in [rad] or [m]
    qd: Array  # in [rad/s] or [m/s]
    qdd: Array  # in [rad/s^2] or [m/s^2]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class JointTorques:
    """What moves and holds a robot."""

    joints: Array  # torque in [N m] or force in [N] of each driven joint, shape (N, n)
    # force in [N] and moment in [N m] about the origin of B with which the floor holds the foot, in W, shape (N, 6)
    base_W: Array


def joint_torques(
    chain: ScrewChain,
    model: RobotModel,
    rows: JointRows,
    *,
    carried: Sequence[CarriedMass] = (),
    wrench_W: Array | None = None,
) -> JointTorques:
    r"""Torques of all joints, and the reaction of the floor ([Featherstone2008]_ table 5.1, in world coordinates).

    Link by link from the foot, with the moved screw ``s`` of its axis and spatial velocities at the world origin:

    .. math:: v_i = v_p + s_i \dot q_i, \quad a_i = a_p + s_i \ddot q_i + v_i \times s_i \dot q_i

    Forces ``f = m (a_c - g)`` and moments ``I \alpha + \omega \times I \omega`` about each centre are added from the
    ends; a joint has the share along its screw. A follower gives its share to its leader by its ratio.

    Args:
        chain: The placed robot.
        model: Its model, with masses of links; without them only those of ``carried`` count.
        rows: Its motion.
        carried: Masses on the flange.
        wrench_W: Force in [N] and moment in [N m] about the world origin that act on the flange from outside, in W,
            shape (N, 6); None for none.
    """
    D, n = chain.link_displacements(rows.q), len(model.joints)
    screws = [moved_screw(axis, D[:, axis.parent + 1]) for axis in model.axes]
    drives = [model.drive(link) for link in range(len(model.axes))]
    velocity, acceleration = (np.zeros((len(model.axes) + 1, len(rows.q), 6)) for _ in range(2))
    for link in model.carried_order:
        before, drive = model.axes[link].parent + 1, drives[link]
        moved = screws[link] * (drive.ratio * rows.qd[:, drive.joint])[:, None]
        velocity[link + 1] = velocity[before] + moved
        speed_up = screws[link] * (drive.ratio * rows.qdd[:, drive.joint])[:, None]
        acceleration[link + 1] = acceleration[before] + speed_up + _cross(velocity[link + 1], moved)
    wrench = np.zeros_like(velocity)
    masses = [*(model.inertias or ()), *(it.on_link(model.flange_link, model.X_BF) for it in carried)]
    for mass in masses:
        at = mass.link + 1
        wrench[at] += _wrench(mass, D[:, at], velocity[at], acceleration[at])
    if wrench_W is not None:
        wrench[model.flange_link + 1] -= wrench_W
    torques = np.zeros((len(rows.q), n))
    for link in reversed(model.carried_order):
        drive = drives[link]
        torques[:, drive.joint] += drive.ratio * np.sum(screws[link] * wrench[link + 1], axis=1)
        wrench[model.axes[link].parent + 1] += wrench[link + 1]
    foot = wrench[BASE + 1].copy()
    foot[:, 3:] -= np.cross(D[:, 0, :3, 3], foot[:, :3])
    return JointTorques(joints=torques, base_W=foot)


def _cross(V: Array, U: Array) -> Array:
    """Rate of a twist U that is carried along by V, both at the world origin, shape (N, 6)."""
    linear = np.cross(V[:, 3:], U[:, :3]) + np.cross(V[:, :3], U[:, 3:])
    return np.concatenate([linear, np.cross(V[:, 3:], U[:, 3:])], axis=1)


def _wrench(mass: LinkInertia, D: Array, V: Array, A: Array) -> Array:
    """What moves and holds a mass: force and moment about the world origin, in W, shape (N, 6)."""
    R, turn, spin_up = D[:, :3, :3], V[:, 3:], A[:, 3:]
    c = R @ mass.centre_B + D[:, :3, 3]
    speed = V[:, :3] + np.cross(turn, c)
    force = mass.mass * (A[:, :3] + np.cross(spin_up, c) + np.cross(turn, speed) - DOWN)
    inertia = R @ mass.inertia_B @ R.transpose(0, 2, 1)
    moment = (inertia @ spin_up[..., None])[..., 0] + np.cross(turn, (inertia @ turn[..., None])[..., 0])
    return np.concatenate([force, moment + np.cross(c, force)], axis=1)
