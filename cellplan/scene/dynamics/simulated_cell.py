"""The simulated arms of a cell, which execute commanded joint positions; all other robots reach them exactly."""

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.report.rehearsal import JointExecution
from cellplan.model.settings.simulation import SimulatedRobotEntry, SimulationEntry, of_joints
from cellplan.scene.dynamics.arm_dynamics import ArmDynamics
from cellplan.scene.dynamics.joint_controllers import Gains, JointControllers
from cellplan.scene.dynamics.loads import carried_masses
from cellplan.scene.dynamics.simulated_arm import SimulatedArm
from cellplan.scene.dynamics.soundness import impossible, unstated_loads


class SimulatedCell:
    """A cell of which some robots have masses and joint controllers."""

    def __init__(self, cell: Cell, simulation: SimulationEntry | None, *, file: str) -> None:
        """Build the arms of the cell as it really is; there are none without a simulation.

        Raises:
            InputError: The masses of a robot or of what it carries are not stated.
        """
        self._entries = {} if simulation is None else simulation.robots
        step = 0.0 if simulation is None else simulation.step_ms.si
        self._arms = {
            name: (cell.columns(name), _arm(cell, cell.robot(name), entry, step=step, file=file))
            for name, entry in self._entries.items()
        }

    @property
    def has_arms(self) -> bool:
        """Whether any robot is simulated."""
        return bool(self._arms)

    def carry(self, cell: Cell) -> None:
        """Go on with what the robots carry in a cell, where they may hold the part or not; controllers know it."""
        for name, (_, arm) in self._arms.items():
            arm.controllers.dynamics = _dynamics(cell, cell.robot(name), self._entries[name])

    def begin(self, q: Array) -> tuple[Array, Array]:
        """Let all arms stand still at a stacked configuration of shape (nq,); returns positions and torques."""
        for columns, arm in self._arms.values():
            arm.begin(q[columns])
        return self._row(q)

    def follow(self, q: Array, duration: float) -> tuple[Array, Array]:
        """Command the next row, to be reached after a time in [s]; returns positions and torques then."""
        for columns, arm in self._arms.values():
            arm.follow(q[columns], duration)
        return self._row(q)

    def execute(self, times: Array, q: Array, *, goes_on: bool = False) -> JointExecution:
        """Follow rows of shape (N, nq) at times in [s], shape (N,).

        The arms begin at rest in the first one, unless it goes on from the last row that was commanded.
        """
        if not self._arms:
            return JointExecution(commanded=q, executed=q, torque=np.zeros_like(q))
        steps = zip(q[1:], np.diff(times).tolist(), strict=True)
        first = self._row(q[0]) if goes_on else self.begin(q[0])
        executed, torque = np.array([first, *(self.follow(row, step) for row, step in steps)]).transpose(1, 0, 2)
        return JointExecution(commanded=q, executed=executed, torque=torque)

    def _row(self, q: Array) -> tuple[Array, Array]:
        """Positions of the links and torques while a row is commanded."""
        executed, torque = q.copy(), np.zeros_like(q)
        for columns, arm in self._arms.values():
            executed[columns], torque[columns] = arm.output, arm.torque
        return executed, torque


def _arm(cell: Cell, robot: Robot, entry: SimulatedRobotEntry, *, step: float, file: str) -> SimulatedArm:
    """One simulated robot with what it carries."""
    place, model = f"{file}: simulation.robots.{robot.name}", robot.model
    if not model.inertias:
        raise InputError(
            f"{place}: expected a robot whose masses are stated, got '{model.name}' without any: state "
            f"robots.{robot.name}.inertias in the cell"
        )
    if findings := impossible(model):
        raise InputError(f"{place}: expected masses that a rigid body can have, got '{findings[0]}'; mend inertias")
    if missing := unstated_loads(cell, robot):
        raise InputError(f"{place}: expected the masses of tool and part, got: {'; '.join(missing)}; state mass_kg")
    names, turns = model.joint_names, np.array([joint.is_revolute for joint in model.joints])
    rated = [np.inf if joint.torque is None else joint.torque for joint in model.joints]
    gains = Gains(
        joints=names,
        kp=of_joints(entry.kp, names),
        ki=of_joints(entry.ki, names),
        kd=of_joints(entry.kd, names),
        saturation=of_joints({} if entry.saturation is None else entry.saturation, names, others=rated),
        dead_zone=of_joints(entry.dead_zone, names),
        period=entry.control_ms.si,
        feedforward=entry.feedforward,
    )
    backlash = np.where(
        turns, np.radians(of_joints(entry.backlash_deg, names)), 1e-3 * of_joints(entry.backlash_mm, names)
    )
    controllers = JointControllers(
        gains=gains, dynamics=_dynamics(cell, robot, entry), friction=of_joints(entry.friction, names)
    )
    return SimulatedArm(controllers, backlash, step=step, at_links=entry.encoder == "link", place=place)


def _dynamics(cell: Cell, robot: Robot, entry: SimulatedRobotEntry) -> ArmDynamics:
    """The masses of a robot and of what it carries."""
    return ArmDynamics(robot, carried_masses(cell, robot), of_joints(entry.rotor_inertia, robot.model.joint_names))
