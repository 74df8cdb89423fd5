"""A simulated arm: its masses and friction under the torques of its joint controllers."""

import math
from typing import Final

import numpy as np

from cellplan.errors import InputError
from cellplan.geometry.transforms import Array
from cellplan.scene.dynamics.joint_controllers import JointControllers, dead_zone

RUNAWAY: Final = 1e3  # [rad/s] or [m/s] no joint is so fast: the loop of its controller is unstable
SAME_TIME: Final = 1e-9  # [s]


def play(output: Array, drive: Array, width: Array) -> Array:
    """What follows a drive through play: it rests while the drive moves within it, as Simulink's block Backlash."""
    return np.clip(output, drive - 0.5 * width, drive + 0.5 * width)


class SimulatedArm:
    r"""One robot whose joints are moved by torques.

    .. math:: M(q) \ddot q + h(q, \dot q) + B \dot q = \tau

    by the Runge-Kutta method of fourth order, with the torques held between samples of the controllers. Links follow
    their drives through the play, which transmits no force back.

    Attributes:
        controllers: Its controllers, which know its dynamics.
        q: Positions of the drives in [rad] or [m], shape (n,).
        qd: Their speeds in [rad/s] or [m/s], shape (n,).
        output: Positions of the links behind the play, shape (n,).
        torque: Torques in [N m] or [N] since the last sample, shape (n,).
    """

    def __init__(
        self, controllers: JointControllers, backlash: Array, *, step: float, at_links: bool = False, place: str = "arm"
    ) -> None:
        """Take the arm, which stands nowhere yet.

        Args:
            controllers: Its controllers.
            backlash: Width of the play in [rad] or [m], shape (n,).
            step: Longest step of the integration in [s].
            at_links: Whether positions are measured at the links rather than at the drives.
            place: Where it is stated, for messages.
        """
        self.controllers, self._backlash, self._step, self._at_links = controllers, backlash, step, at_links
        self._place = place
        self.q = self.qd = self.output = self.torque = np.zeros_like(backlash)

    def begin(self, q: Array) -> None:
        """Stand still at positions of shape (n,), in the middle of the play, held by the controllers.

        Raises:
            InputError: A control signal saturates below what holds the arm.
        """
        held, gains = self.controllers.begin(q), self.controllers.gains
        for joint in np.flatnonzero(np.abs(held) > gains.saturation):
            raise InputError(
                f"{self._place}.saturation: expected at least {abs(held[joint]):.4g} for joint "
                f"'{gains.joints[joint]}', which has to hold its start, got {gains.saturation[joint]:g}"
            )
        self.torque = dead_zone(held, gains.dead_zone)
        self.q, self.output, self.qd, self._commanded = q, q, np.zeros_like(q), q
        self._time, self._samples = 0.0, 0

    def follow(self, commanded: Array, duration: float) -> None:
        """Follow the straight line from the last commanded positions to the next ones, shape (n,), in a time in [s].

        Raises:
            InputError: A joint runs away.
        """
        begin, first, period = self._time, self._commanded, self.controllers.gains.period
        end = begin + duration
        while (at := self._samples * period) < end - SAME_TIME:
            self._integrate(at - self._time)
            reference = first + (at - begin) / duration * (commanded - first)
            self.torque = self.controllers.sample(reference, self.output if self._at_links else self.q)
            self._samples += 1
        self._integrate(end - self._time)
        self._commanded = commanded
        for joint in np.flatnonzero(~(np.abs(self.qd) < RUNAWAY)):
            raise InputError(
                f"{self._place}: joint '{self.controllers.gains.joints[joint]}' runs away at {end:.3f} s: its control "
                "loop is not stable; reduce kp, ki or kd, or control_ms and step_ms"
            )

    @property
    def energy(self) -> float:
        """Kinetic and potential energy in [J], the latter counted from the base frame on."""
        return self.controllers.dynamics.energy(self.q, self.qd)

    def _integrate(self, duration: float) -> None:
        """Move under the present torques for a time in [s]."""
        if duration > SAME_TIME:
            count = math.ceil(duration / self._step - SAME_TIME)
            for _ in range(count):
                self._advance(duration / count)
                self.output = play(self.output, self.q, self._backlash)
        self._time += duration

    def _acceleration(self, q: Array, qd: Array) -> Array:
        """Accelerations under the present torques and friction, shape (n,)."""
        return self.controllers.dynamics.acceleration(q, qd, self.torque - self.controllers.friction * qd)

    def _advance(self, h: float) -> None:
        """One step of Runge and Kutta, of a length in [s]."""
        q, v1 = self.q, self.qd
        a1 = self._acceleration(q, v1)
        v2 = v1 + 0.5 * h * a1
        a2 = self._acceleration(q + 0.5 * h * v1, v2)
        v3 = v1 + 0.5 * h * a2
        a3 = self._acceleration(q + 0.5 * h * v2, v3)
        v4 = v1 + h * a3
        a4 = self._acceleration(q + h * v3, v4)
        self.q = q + h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        self.qd = v1 + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
