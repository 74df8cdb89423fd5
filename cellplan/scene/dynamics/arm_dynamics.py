"""The interface to pinocchio's forward dynamics: how one robot accelerates under the torques of its joints."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Robot
from cellplan.model.robot.inertia import CarriedMass
from cellplan.model.robot.robot import BASE
from cellplan.scene.dynamics.loads import GRAVITY


class ArmDynamics:
    """One robot with masses, on a base that stands still; joints are in [rad] or [m], torques in [N m] or [N].

    Every joint frame is parallel to B at the reference configuration. Masses of the foot do not matter.
    """

    def __init__(self, robot: Robot, carried: Sequence[CarriedMass], rotors: Array) -> None:
        """Build the model; ``rotors`` are the inertias of the drives seen from the driven joints, shape (n,)."""
        model, self._engine = robot.model, pin.Model()
        ids: dict[int, int] = {BASE: 0}
        for link in model.carried_order:
            axis = model.axes[link]
            before = np.zeros(3) if axis.parent == BASE else model.axes[axis.parent].point_B
            kind = pin.JointModelRevoluteUnaligned if axis.is_revolute else pin.JointModelPrismaticUnaligned
            place = pin.SE3(np.eye(3), axis.point_B - before)
            ids[link] = self._engine.addJoint(ids[axis.parent], kind(axis.axis_B), place, axis.name)
        for mass in [*(model.inertias or ()), *(it.on_link(model.flange_link, model.X_BF) for it in carried)]:
            if mass.link != BASE:
                lever = mass.centre_B - model.axes[mass.link].point_B
                inertia = pin.Inertia(mass.mass, lever, mass.inertia_B)
                self._engine.appendBodyToJoint(ids[mass.link], inertia, pin.SE3.Identity())
        down = robot.X_WB[:3, :3].T @ np.array([0.0, 0.0, -GRAVITY])
        self._engine.gravity = pin.Motion(down, np.zeros(3))
        drives = [model.drive(link) for link in model.carried_order]
        self._spread = np.zeros((len(drives), len(model.joints)))
        self._spread[np.arange(len(drives)), [it.joint for it in drives]] = [it.ratio for it in drives]
        self._offset = np.array([it.offset for it in drives])
        self._rotors = rotors
        self._is_plain = not model.followers
        if self._is_plain:
            self._engine.armature = rotors
        self._data = self._engine.createData()

    def acceleration(self, q: Array, qd: Array, torque: Array) -> Array:
        r"""Accelerations of the driven joints under torques, shape (n,) each.

        Without followers by the articulated-body algorithm; with them by ``(S^T M S + R) \ddot q = \tau - S^T h``,
        where ``S`` spreads driven joints over all axes and ``R`` are the rotors.
        """
        if self._is_plain:
            return np.array(pin.aba(self._engine, self._data, q, qd, torque))
        S = self._spread
        full = S @ q + self._offset
        M = S.T @ pin.crba(self._engine, self._data, full) @ S + np.diag(self._rotors)
        return np.linalg.solve(M, torque - S.T @ pin.nonLinearEffects(self._engine, self._data, full, S @ qd))

    def torque(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Torques of the driven joints that accelerate them so, shape (n,) each."""
        S = self._spread
        torque = S.T @ pin.rnea(self._engine, self._data, S @ q + self._offset, S @ qd, S @ qdd)
        return torque if self._is_plain else torque + self._rotors * qdd

    def energy(self, q: Array, qd: Array) -> float:
        """Kinetic and potential energy in [J], the latter counted from the origin of B."""
        S = self._spread
        of_links = pin.computeMechanicalEnergy(self._engine, self._data, S @ q + self._offset, S @ qd)
        return float(of_links) + 0.5 * float(self._rotors @ qd**2)
