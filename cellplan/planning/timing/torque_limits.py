r"""Limits of the torques of joints along a path, whatever the acceleration and the speed of the path.

With q over the length p of the path, :math:`u = \ddot p` and :math:`x = \dot p^2`, equations of motion without friction
give the torque :math:`a u + b x + c` (Bobrow, Dubowsky and Gibson 1985), where c holds against gravity and processes at
rest, a is what the acceleration :math:`q'` adds to it and b what the speed :math:`q'` and the acceleration
:math:`q''` add.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import joint_accelerations, point_accelerations
from cellplan.measures.torques import at_rest, halved_rows, halved_wrench, in_steps, step_peaks
from cellplan.planning.timing.speed_profile import PathLoads
from cellplan.scene.dynamics.newton_euler import JointRows

SCARCE: Final = 1e-3  # [-] share of a limit: where gravity leaves less of it, no motion is slow enough

Torques = Callable[[JointRows, Array | None], Array]  # a motion and a wrench on the robot, or none -> (N, n)
Wrench = Callable[[Array, Array], Array]  # nominal times in [s] and configurations of all joints -> (N, 6)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueLimits:
    """Torques of the joints of one robot, and the largest that they may be."""

    columns: slice  # its joints in the configurations that are given
    torques: Torques  # with all that it carries, in [N m] or [N]
    largest: Array  # limits in [N m] or [N], infinite for none, shape (n,)
    cycle: float  # of the controller in [s]: a jump of speed counts over it
    wrench: Wrench | None = None  # what processes exert on it, at the origin of the world; None for nothing
    share: float = 1.0  # of what gravity leaves of the limits that the motion may take up

    def among(self, columns: slice) -> Self:
        """The same for configurations that hold some joints only, all of the robot's among them."""
        first = self.columns.start - columns.start
        return replace(self, columns=slice(first, self.columns.stop - columns.start))

    def in_slow_motion(self, share: float) -> Self:
        """Limits within which every motion is one within these, only that time runs at a share of its speed."""
        return replace(self, share=share**2 * self.share)

    def along(self, q: Array, first: Array, second: Array, *, sigma: Array) -> PathLoads:
        """Torques along a path as shares of their limits.

        Args:
            q: Joint positions along it in [rad] or [m], shape (N, joints).
            first: Their derivatives by its length, shape (N, joints).
            second: The derivatives of these by its length, shape (N, joints).
            sigma: Nominal times in [s], shape (N,).
        """
        wrench_W = None if self.wrench is None else self.wrench(sigma, q)
        q, first, second = (it[:, self.columns] for it in (q, first, second))
        still = self.torques(at_rest(q), wrench_W)
        limited = np.isfinite(self.largest)
        largest = self.largest[limited]
        by_u, by_x = JointRows(q=q, qd=np.zeros_like(q), qdd=first), JointRows(q=q, qd=first, qdd=second)
        along, bent = ((self.torques(it, wrench_W) - still)[:, limited] / largest for it in (by_u, by_x))
        top, bottom = (self._left(sign * still[:, limited] / largest) for sign in (1.0, -1.0))
        return PathLoads(along=along, bent=bent, top=top, bottom=bottom)

    def in_rows(self, times: Array, q: Array, *, sigma: Array | None = None) -> tuple[Array, Array]:
        """What a motion from rest to rest reaches at its rows and between them, of each joint of the robot.

        Args:
            times: Times of the rows in [s], shape (N,).
            q: Joint positions in [rad] or [m], shape (N, joints).
            sigma: Nominal times in [s], shape (N,); None while no process is on.

        Returns:
            The largest torques as shares of their limits, and by which factors the motion has to be slower for these,
            as far as that helps, shape (n,) each.
        """
        wrench_W = None if self.wrench is None or sigma is None else halved_wrench(self.wrench(sigma, q))
        q = q[:, self.columns]
        sizes = joint_accelerations(times, q, cycle=self.cycle).values
        rows = halved_rows(times, q, np.copysign(sizes, point_accelerations(times, q)))
        moving, still = (self.torques(it, wrench_W) / self.largest for it in (rows, at_rest(rows.q)))
        change, (reached, _) = moving - still, step_peaks(moving)
        left = self._left(np.sign(change) * still)
        at_points, beyond = in_steps(np.abs(change) / left), reached.max(axis=0) - reached[:3].max(axis=0)
        squared = at_points.max(axis=0) + beyond / in_steps(left).min(axis=0)
        return reached.max(axis=(0, 1)), np.sqrt(squared.max(axis=0))

    def _left(self, still: Array) -> Array:
        """What gravity leaves of limits for the motion, infinite where it leaves none; all in shares of the limits."""
        return np.where(still < 1.0 - SCARCE, self.share * (1.0 - still), np.inf)
