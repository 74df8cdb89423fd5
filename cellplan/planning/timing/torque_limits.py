r"""Limits of the torques of joints along a path, whatever the acceleration and the speed of the path.

With q over the length p of the path, :math:`u = \ddot p` and :math:`x = \dot p^2`, equations of motion without friction
give the torque :math:`a u + b x + c` (Bobrow, Dubowsky and Gibson 1985), where c holds against gravity at rest, a is
what the acceleration :math:`q'` adds to it and b what the speed :math:`q'` and the acceleration :math:`q''` add.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.measures.accelerations import row_motion
from cellplan.planning.timing.speed_profile import PathLoads

SCARCE: Final = 1e-3  # [-] share of a limit: where gravity leaves less of it, no motion is slow enough

Torques = Callable[[Array, Array, Array], Array]  # positions, speeds and accelerations -> torques, shape (N, n) each


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TorqueLimits:
    """Torques of the joints of one robot, and the largest that they may be."""

    columns: slice  # its joints in the configurations that are given
    torques: Torques  # with all that it carries, in [N m] or [N]
    largest: Array  # limits in [N m] or [N], infinite for none, shape (n,)
    share: float = 1.0  # of what gravity leaves of the limits that the motion may take up

    def among(self, columns: slice) -> Self:
        """The same for configurations that hold some joints only, all of the robot's among them."""
        first = self.columns.start - columns.start
        return replace(self, columns=slice(first, self.columns.stop - columns.start))

    def in_slow_motion(self, share: float) -> Self:
        """Limits within which every motion is one within these, only that time runs at a share of its speed."""
        return replace(self, share=share**2 * self.share)

    def along(self, q: Array, first: Array, second: Array) -> PathLoads:
        """Torques along a path as shares of their limits.

        Args:
            q: Joint positions along it in [rad] or [m], shape (N, joints).
            first: Their derivatives by its length, shape (N, joints).
            second: The derivatives of these by its length, shape (N, joints).
        """
        q, first, second = (it[:, self.columns] for it in (q, first, second))
        still, zero = self.torques(q, np.zeros_like(q), np.zeros_like(q)), np.zeros_like(q)
        limited = np.isfinite(self.largest)
        largest = self.largest[limited]
        along = (self.torques(q, zero, first) - still)[:, limited] / largest
        bent = (self.torques(q, first, second) - still)[:, limited] / largest
        top, bottom = (self._left(sign * still[:, limited] / largest) for sign in (1.0, -1.0))
        return PathLoads(along=along, bent=bent, top=top, bottom=bottom)

    def in_rows(self, times: Array, q: Array) -> tuple[Array, Array]:
        """What the rows of a motion from rest to rest reach, of each joint of the robot.

        Args:
            times: Times of the rows in [s], shape (N,).
            q: Joint positions in [rad] or [m], shape (N, joints).

        Returns:
            The largest torques as shares of their limits, and by which factors the motion has to be slower for these,
            as far as that helps, shape (n,) each.
        """
        q = q[:, self.columns]
        still, moving = self.torques(q, np.zeros_like(q), np.zeros_like(q)), self.torques(q, *row_motion(times, q))
        change = moving - still
        left = self._left(np.sign(change) * still / self.largest)
        slower = np.sqrt((np.abs(change) / (self.largest * left)).max(axis=0))
        return (np.abs(moving) / self.largest).max(axis=0), slower

    def _left(self, still: Array) -> Array:
        """What gravity leaves of limits for the motion, infinite where it leaves none; all in shares of the limits."""
        return np.where(still < 1.0 - SCARCE, self.share * (1.0 - still), np.inf)
