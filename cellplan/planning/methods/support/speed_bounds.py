"""Speed bounds: how fast each joint may move in the next step so that no limit is broken now or later."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cellplan.errors import StartOutsideLimitsError
from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell

READ_BACK: Final = 2e-14  # [rad] or [m] by which a position may change when it is written and read back
ROUNDING_MARGIN: Final = 1e-12  # [rad] or [m] kept from position limits: what many steps add up to in rounding
BRAKING_MARGIN: Final = (
    1e-6  # [-] of the acceleration that planned braking leaves unused: the clock's steps are rounded
)


@dataclass(frozen=True, slots=True, eq=False)
class VelocityBounds:
    """Lowest and highest joint velocities in [rad/s] or [m/s], shape (nq,) each; the lower never above the upper."""

    lower: Array
    upper: Array


class JointBounds:
    """The limits of all joints of a cell, as bounds on the speeds of one step.

    A joint keeps the speed of a step until the next sample, as the written tables mean it.
    """

    def __init__(self, cell: Cell) -> None:
        """Take the limits of all joints; an acceleration may follow from ``solver.quadratic_program.ramp_s``."""
        limits = cell.joint_limits
        ramp = cell.solver.quadratic_program.ramp_s
        self._names = [f"{robot.name}/{joint.name}" for robot in cell.robots for joint in robot.model.joints]
        self._is_revolute = limits.is_revolute
        self._lower, self._upper, self._velocity = limits.lower, limits.upper, limits.velocity
        by_ramp = np.inf if ramp is None else limits.velocity / ramp
        self._acceleration = np.where(np.isinf(limits.acceleration), by_ramp, limits.acceleration)

    def refuse_outside(self, q: Array) -> None:
        """Refuse a configuration, shape (nq,), outside of the position limits, from which no bounded speed is right."""
        for index, (name, position) in enumerate(zip(self._names, q, strict=True)):
            lower, upper = self._lower[index], self._upper[index]
            if not lower <= position <= upper:
                scale, unit = (np.degrees(1.0), "deg") if self._is_revolute[index] else (1e3, "mm")
                raise StartOutsideLimitsError(
                    f"joint '{name}' starts at {scale * position:g} {unit}, outside its limits "
                    f"{scale * lower:g} .. {scale * upper:g} {unit}: quadratic_program needs a start within them"
                )

    def at(self, q: Array, velocities: Array, dt: float) -> VelocityBounds:
        """Bounds for the step that follows.

        Position limits and the room to brake before them come first, then the speed limit, then the acceleration
        limit. The first two always contain 0; and whoever kept these bounds in the step before can still brake, so
        that the bounds never contradict each other.

        Args:
            q: Positions, shape (nq,).
            velocities: Speeds of the step before; 0 at the start, where all joints are at rest, shape (nq,).
            dt: Length of the step in [s].
        """
        top = _less(self._velocity, 2.0 * READ_BACK / dt)
        acceleration = _less(self._acceleration, 4.0 * READ_BACK / dt**2)
        planned = (1.0 - BRAKING_MARGIN) * acceleration
        above = np.maximum(self._upper - ROUNDING_MARGIN - q, 0.0)
        below = np.maximum(q - self._lower - ROUNDING_MARGIN, 0.0)
        highest = np.minimum(top, braking_speed(above, planned, dt))
        lowest = -np.minimum(top, braking_speed(below, planned, dt))
        return VelocityBounds(
            lower=np.clip(velocities - acceleration * dt, lowest, highest),
            upper=np.clip(velocities + acceleration * dt, lowest, highest),
        )


def braking_speed(distance: Array, acceleration: Array, dt: float) -> Array:
    r"""Largest speed of the next step after which a joint can still stop within the room it has.

    Braking takes ``a dt`` off the speed from step to step, so a joint that moves at ``v`` goes on for
    ``dt (v + (v - a dt) + (v - 2 a dt) + ...)``, the discrete form of ``v <= sqrt(2 a room)``. With ``n`` further steps

    .. math:: v = \frac{room}{(n + 1) dt} + \frac{n a dt}{2}, \quad
              n = \left\lfloor \tfrac12 \left(\sqrt{1 + 8 room / (a dt^2)} - 1\right) \right\rfloor

    Args:
        distance: Distances in [rad] or [m], 0 or more, shape (nq,); may be infinite.
        acceleration: Accelerations in [rad/s^2] or [m/s^2], shape (nq,); infinite where a joint may stop at once.
        dt: Length of a step in [s].
    """
    brakes = np.isfinite(distance) & np.isfinite(acceleration)
    a, d = np.where(brakes, acceleration, 1.0), np.where(brakes, distance, 0.0)
    n = np.floor(0.5 * (np.sqrt(1.0 + 8.0 * d / (a * dt**2)) - 1.0))
    return np.where(brakes, d / ((n + 1.0) * dt) + 0.5 * n * a * dt, distance / dt)


def _less(limits: Array, distance: float) -> Array:
    """Limits with room for rounding, half of them at least."""
    return np.maximum(limits - distance, 0.5 * limits)
