"""Joint weights: how much each joint is spared, as written in the cell, more so near a limit and under load."""

from typing import Final

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.planning.tracking.weighted_inverse import WeightedInverse
from cellplan.scene.kinematics.pinocchio_model import CellState, CombinedModel

LARGEST_FACTOR: Final = 1e4  # beyond it a joint stands still for all purposes, and the inverse loses digits
NEAREST: Final = 1e-3  # [-] of the range: nearer to a limit than this, and beyond it, the gradient grows no more
TURNING: Final = 0.01  # [-] of the top speed up to which the weight of a joint on its way to a limit sets in
HEADING_DAMPING: Final = 1e-4  # squared damping factor of the motion that tells which way a joint is going


class JointWeights:
    """The diagonal of W along the motion; it depends on sample and configuration only, not on what went before."""

    def __init__(self, cell: Cell, model: CombinedModel) -> None:
        """Take the constant weights, the limits and the masses of all robots."""
        self.constant = np.concatenate([robot.weights for robot in cell.robots])  # stated by the cell, shape (nq,)
        self._near_limits, self._load = cell.solver.weighting.near_limits, cell.solver.weighting.load
        self._lower, self._upper = cell.joint_limits.lower, cell.joint_limits.upper
        self._turning = TURNING * cell.joint_limits.velocity
        self._carries = model.carries_flange.astype(float)
        self._tools = np.array([robot.tool.mass or 0.0 for robot in cell.robots])
        self._shares = np.array([_part_share(cell, robot.name) for robot in cell.robots])
        self._p_PS = cell.part.X_PS[:3, 3]
        self.varies = self._near_limits > 0.0 or self._load > 0.0  # whether any sample has other weights

    def at(self, state: CellState, q: Array, *, J: Array, xdot: Array, secondary: Array | None) -> Array:
        r"""Weights at one sample and configuration.

        .. math:: w_i = w_{0i} \left(1 + a \left|\partial H / \partial q_i\right|\right) \left(1 + b \, g_i\right)

        with the gradient of Chan and Dubey (1995) for joints that would be on their way to a limit with their constant
        weights, and the load of gravity. A joint that turns round changes its weight gradually.

        Args:
            q: Stacked joint vector, shape (nq,).
            J: Task rows, shape (m, nq).
            xdot: Reference twist components with error feedback, shape (m,).
            secondary: Joint speeds that the secondary goals ask for, shape (nq,); None when there are none.

        Returns:
            Weights, shape (nq,).
        """
        if not self.varies:
            return self.constant
        heading = np.zeros_like(q)
        if self._near_limits > 0.0:
            inverse = WeightedInverse(J, self.constant)
            heading = inverse.velocities(xdot, HEADING_DAMPING)
            if secondary is not None:
                heading += inverse.null_space_projection(secondary)
        return self.along(state, q, heading=heading)

    def along(self, state: CellState, q: Array, *, heading: Array) -> Array:
        """Weights at one configuration or at several, which are the first axis then; see ``at``.

        Args:
            q: Stacked joint vector, shape (nq,).
            heading: Joint velocities with the constant weights, shape (nq,).
        """
        factors = np.ones_like(q)
        if self._near_limits > 0.0:
            slope = limit_slope(q, self._lower, self._upper)
            towards = np.clip(np.sign(slope) * heading / self._turning, 0.0, 1.0)
            factors *= 1.0 + self._near_limits * np.abs(slope) * towards
        if self._load > 0.0:
            factors *= 1.0 + self._load * self.load(state)
        return self.constant * np.minimum(factors, LARGEST_FACTOR)

    def load(self, state: CellState) -> Array:
        r"""Torque or force with which each joint holds the masses it carries, as a share of a reference.

        Tools weigh at their tips, the part at the origin of its shape's frame, in equal shares on those who hold it. By
        virtual work the torque of a mass is its weight times the speed at which it rises per unit joint speed: that is
        ``|s . ((p - s0) x m g)|`` for a revolute joint and ``|s . m g|`` for a sliding one. The reference is the weight
        of the heaviest load of a robot, on an arm of 1 m for revolute joints.

        Returns:
            Shares, 0 or more, shape (nq,).
        """
        heaviest = float(np.max(self._tools + self._shares))
        if heaviest == 0.0:
            return np.zeros_like(self.constant)
        p_WS = state.X_WP[..., :3, :3] @ self._p_PS + state.X_WP[..., :3, 3]
        tips = state.X_WT[..., :3, 3]
        moments = self._tools[:, None] * _rising(state.screws_W, tips) + self._shares[:, None] * _rising(
            state.screws_W, np.broadcast_to(p_WS[..., None, :], tips.shape)
        )
        return np.abs((self._carries * moments).sum(axis=-2)) / heaviest


def limit_slope(q: Array, lower: Array, upper: Array) -> Array:
    r"""Gradient of the nearness of limits (Chan and Dubey, 1995), in [1/rad] or [1/m].

    .. math:: H = \sum_i \frac{(u_i - l_i)^2}{4 (u_i - q_i)(q_i - l_i)}, \qquad
              \frac{\partial H}{\partial q_i} = \frac{(u_i - l_i)^2 (2 q_i - u_i - l_i)}{4 (u_i - q_i)^2 (q_i - l_i)^2}

    It grows without end towards a limit; from ``NEAREST`` of the range on it stays as it is, also beyond the limit.

    Args:
        q: Positions, shape (nq,).
        lower: Lower limits, shape (nq,); a joint with an infinite limit has gradient 0.
        upper: Upper limits, shape (nq,).
    """
    bounded = np.isfinite(lower) & np.isfinite(upper)
    low, high = np.where(bounded, lower, -1.0), np.where(bounded, upper, 1.0)
    span = high - low
    inside = np.clip(np.where(bounded, q, 0.0), low + NEAREST * span, high - NEAREST * span)
    slope = span**2 * (2.0 * inside - high - low) / (4.0 * (high - inside) ** 2 * (inside - low) ** 2)
    return np.where(bounded, slope, 0.0)


def _part_share(cell: Cell, robot: str) -> float:
    """Mass in [kg] of the part that a robot carries."""
    return (cell.part.mass or 0.0) / len(cell.positioners) if robot in cell.positioners else 0.0


def _rising(screws_W: Array, points: Array) -> Array:
    """Speed at which points rise per unit speed of each joint, shape (n, nq), for points in W of shape (n, 3)."""
    x, y = points[..., 0, None], points[..., 1, None]
    return screws_W[..., None, 2, :] + y * screws_W[..., None, 3, :] - x * screws_W[..., None, 4, :]
