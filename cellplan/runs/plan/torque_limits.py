"""Limits of the torques of the robots of a cell, with what each of them carries."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.forces.static_forces import static_forces
from cellplan.measures.tool_errors import part_poses
from cellplan.model.cell.cell import Robot
from cellplan.model.motion.motion import Schedule, TaskSchedule
from cellplan.model.robot.inertia import CarriedMass
from cellplan.planning.timing.torque_limits import TorqueLimits
from cellplan.scene.dynamics.loads import carried_masses
from cellplan.scene.dynamics.newton_euler import JointRows, joint_torques
from cellplan.scene.dynamics.soundness import missing_masses
from cellplan.scene.kinematics.screw_chain import ScrewChain
from cellplan.scene.scene import Scene


def torque_limits(scene: Scene, tasks: tuple[TaskSchedule, ...] = ()) -> tuple[TorqueLimits, ...]:
    """Those of the robots whose masses and largest torques are known, while the processes of some tasks push them."""
    return tuple(_torque_limits(scene, tasks))


def _torque_limits(scene: Scene, tasks: tuple[TaskSchedule, ...]) -> Iterator[TorqueLimits]:
    forces = [it.task.process.force for it in tasks if it.task.process is not None]
    is_pushed = any(force is not None for force in forces)
    for robot in scene.cell.robots:
        largest = np.array([np.inf if joint.torque is None else joint.torque for joint in robot.model.joints])
        if np.isfinite(largest).any() and not missing_masses(scene.cell, robot):
            torques = partial(_torques, scene.chains[robot.name], robot, carried_masses(scene.cell, robot))
            yield TorqueLimits(
                columns=scene.cell.columns(robot.name),
                torques=torques,
                largest=largest,
                cycle=robot.controller_cycle,
                wrench=partial(_wrench, scene, tasks, robot.name) if is_pushed else None,
            )


def _torques(
    chain: ScrewChain, robot: Robot, carried: list[CarriedMass], rows: JointRows, wrench_W: Array | None
) -> Array:
    """Torques of the joints of a robot, shape (N, n)."""
    return joint_torques(chain, robot.model, rows, carried=carried, wrench_W=wrench_W).joints


def _wrench(scene: Scene, tasks: tuple[TaskSchedule, ...], robot: str, sigma: Array, q: Array) -> Array:
    """What processes exert on a robot at times on their clock in [s], shape (N, 6)."""
    by_robot = {it.name: q[:, scene.cell.columns(it.name)] for it in scene.cell.robots}
    X_WP, schedule = part_poses(scene.cell, scene.chains, by_robot), Schedule(times=sigma, tasks=tasks)
    forces = static_forces(scene.cell, scene.chains, schedule, by_robot, X_WP)
    return np.zeros((len(q), 6)) if forces is None else forces.by_process(robot)
