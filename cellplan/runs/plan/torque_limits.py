"""Limits of the torques of the robots of a cell, with what each of them carries."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.inertia import CarriedMass
from cellplan.planning.timing.torque_limits import TorqueLimits
from cellplan.scene.dynamics.loads import carried_masses
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.dynamics.soundness import missing_masses
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene


def torque_limits(scene: Scene) -> tuple[TorqueLimits, ...]:
    """Those of the robots whose masses and largest torques are known."""
    return tuple(_torque_limits(scene))


def _torque_limits(scene: Scene) -> Iterator[TorqueLimits]:
    for robot in scene.cell.robots:
        largest = np.array([np.inf if joint.torque is None else joint.torque for joint in robot.model.joints])
        if np.isfinite(largest).any() and not missing_masses(scene.cell, robot):
            torques = partial(_torques, scene.chains[robot.name], robot, carried_masses(scene.cell, robot))
            yield TorqueLimits(columns=scene.cell.columns(robot.name), torques=torques, largest=largest)


def _torques(chain: ScrewChain, robot: Robot, carried: list[CarriedMass], q: Array, qd: Array, qdd: Array) -> Array:
    """Torques of the joints of a robot, shape (N, n)."""
    return joint_torques(chain, robot.model, JointRows(q=q, qd=qd, qdd=qdd), carried=carried).joints
