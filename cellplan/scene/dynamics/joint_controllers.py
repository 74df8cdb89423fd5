"""Sampled joint controllers: PID with feedforward, saturation and dead zone."""

from dataclasses import dataclass, field

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.settings.simulation import Feedforward
from cellplan.scene.dynamics.arm_dynamics import ArmDynamics


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Gains:
    """What the controllers of n joints do, shape (n,) each; signals are in [N m], those of sliding joints in [N]."""

    joints: tuple[str, ...]  # names of the joints
    kp: Array  # signal per error
    ki: Array  # per integrated error
    kd: Array  # per rate of the error
    saturation: Array  # largest signal; inf for none
    dead_zone: Array  # signal that moves nothing
    period: float  # time in [s] from one sample to the next
    feedforward: Feedforward = "none"  # what the signal has beside that of the error


def dead_zone(signal: Array, half_width: Array) -> Array:
    """Zero within the zone, beyond it the distance from its nearer end, as Simulink's block Dead Zone."""
    return np.sign(signal) * np.maximum(np.abs(signal) - half_width, 0.0)


@dataclass(slots=True, kw_only=True, eq=False)
class JointControllers:
    r"""Controllers of one arm.

    With ``e = r - y`` of reference and measured positions, at sample ``k``

    .. math:: u_k = K_p e_k + K_i T \sum_{j \le k} e_j + K_d (e_k - e_{k-1}) / T + u_f + u_0, \quad
              \tau_k = dead(sat(u_k))

    where ``u_f`` is the feedforward of the reference, whose rates are those between samples, and ``u_0`` what holds the
    arm at rest where it begins.
    """

    gains: Gains
    dynamics: ArmDynamics  # the arm as the controllers know it
    friction: Array  # the same of its viscous friction, torque per speed, shape (n,)
    _held: Array = field(init=False)
    _integral: Array = field(init=False)
    _error: Array = field(init=False)
    _reference: Array = field(init=False)
    _rate: Array = field(init=False)

    def begin(self, q: Array) -> Array:
        """Hold an arm at rest at positions of shape (n,); returns the signals that do, saturated or not."""
        zeros = np.zeros_like(q)
        torque = self.dynamics.torque(q, zeros, zeros)
        held = torque + np.sign(torque) * self.gains.dead_zone
        self._held = held - self._feedforward(q, zeros, zeros)
        self._reference, self._rate, self._error, self._integral = q, zeros, zeros, zeros
        return held

    def sample(self, reference: Array, measured: Array) -> Array:
        """Torques until the next sample, from positions of shape (n,) each."""
        gains = self.gains
        error, rate = reference - measured, (reference - self._reference) / gains.period
        self._integral = self._integral + gains.period * error
        signal = gains.kp * error + gains.ki * self._integral + gains.kd * (error - self._error) / gains.period
        signal = signal + self._held + self._feedforward(reference, rate, (rate - self._rate) / gains.period)
        self._reference, self._rate, self._error = reference, rate, error
        return dead_zone(np.clip(signal, -gains.saturation, gains.saturation), gains.dead_zone)

    def _feedforward(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Torques that are known in advance, shape (n,)."""
        match self.gains.feedforward:
            case "none":
                return np.zeros_like(q)
            case "gravity":
                return self.dynamics.torque(q, np.zeros_like(q), np.zeros_like(q))
            case "dynamics":
                return self.dynamics.torque(q, qd, qdd) + self.friction * qd
