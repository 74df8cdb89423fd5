"""Batched kinematics of all robots; the last axis of every array is the batch.

The arrays are arranged so that NumPy works through thousands of configurations in one call; robots lie side by side
and are filled up to the longest chain with axes that do nothing. Cells of a batch may differ in base poses and tools.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cellplan.geometry.transforms import Array, skew
from cellplan.model.cell.cell import Cell, Robot
from cellplan.model.robot.robot import BASE

CACHE_BLOCK: Final = 512  # entries of a batch whose arrays stay in the processor's cache: more at once are slower


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Base poses and tool tips of robots; the last axis is the batch, or of length 1 where all of it shares them."""

    R_WB: Array  # base orientations, shape (3, 3, robots, batch or 1)
    p_WB: Array  # base positions in [m], shape (3, robots, batch or 1)
    R_LT: Array  # tool orientations seen from the last link, shape (3, 3, robots, batch or 1)
    p_LT: Array  # tool tips seen from the last link in [m], shape (3, robots, batch or 1)

    def of(self, entries: NDArray[np.intp]) -> "Placement":
        """That of some entries of the batch only."""
        return self if self.R_WB.shape[-1] == 1 else Placement(*(part[..., entries] for part in self._parts))

    def repeated(self, count: int) -> "Placement":
        """Each entry of the batch so many times, one after the other."""
        if self.R_WB.shape[-1] == 1:
            return self
        return Placement(*(np.repeat(part, count, axis=-1) for part in self._parts))

    @property
    def _parts(self) -> tuple[Array, Array, Array, Array]:
        """All arrays."""
        return self.R_WB, self.p_WB, self.R_LT, self.p_LT


@dataclass(frozen=True, slots=True, eq=False)
class BatchState:
    """All robots over the batch."""

    axes: Array  # directions of the axes on the way to the flanges in W, shape (3, levels, robots, batch)
    points: Array  # A point on each, in [m], shape (3, levels, robots, batch)
    R_WT: Array  # tool orientations, shape (3, 3, robots, batch)
    p_WT: Array  # tool tips in [m], shape (3, robots, batch)


class BatchChains:
    """The chains from base to flange of all robots of a cell, level by level.

    Attributes:
        levels: Axes of the longest chain.
        joints: Joints of the robot with the most.
        is_turning: 1 where an axis turns, 0 where it slides or only fills up, shape (levels, robots).
        is_sliding: 1 where an axis slides, shape (levels, robots).
        to_joints: Share of each axis in its joint, shape (levels, joints, robots); followers add to their leaders.
        is_plain: Whether every axis on the way to a flange is a joint, in order, and every joint is on the way.
        is_all_turning: Whether no axis slides.
        columns: Place of each joint in the stacked joint vector, shape (joints, robots); -1 where a robot has fewer.
    """

    def __init__(self, cell: Cell) -> None:
        """Take the axes at the reference configuration; all link frames are parallel to the base there."""
        chains = [robot.model.links_to_flange for robot in cell.robots]
        robots = len(chains)
        self.levels = max(1, *(len(chain) for chain in chains))
        self.joints = max(1, *(len(robot.model.joints) for robot in cell.robots))
        self.is_turning = np.zeros((self.levels, robots))
        self.is_sliding = np.zeros((self.levels, robots))
        self.to_joints = np.zeros((self.levels, self.joints, robots))
        self.columns = np.full((self.joints, robots), -1)
        self._axis = np.zeros((self.levels, 3, robots))
        self._step = np.zeros((self.levels, 3, robots))
        self._leader = np.zeros((self.levels, robots), dtype=np.intp)
        self._offset = np.zeros((self.levels, robots))
        self._ratio = np.zeros((self.levels, robots))
        for index, (robot, chain) in enumerate(zip(cell.robots, chains, strict=True)):
            self._take(index, robot, chain, first=cell.columns(robot.name).start)
        S = skew(np.moveaxis(self._axis, 1, -1))  # (levels, robots, 3, 3)
        turning = self.is_turning[:, None, None]
        self._S = (np.moveaxis(S, 1, -1) * turning)[..., None]
        self._S2 = (np.moveaxis(S @ S, 1, -1) * turning)[..., None]
        self._places = np.stack([self._step, self._axis], axis=2)[..., None]
        self._slide = (self._axis * self.is_sliding[:, None])[..., None]
        self._X_BF = np.stack([robot.model.X_BF for robot in cell.robots])
        self._last_point = np.array([_last_point(robot) for robot in cell.robots])
        self.is_all_turning = not self.is_sliding.any()
        has_joint = np.arange(self.joints)[:, None] < [len(robot.model.joints) for robot in cell.robots]
        plain = np.eye(self.levels, self.joints)[:, :, None] * has_joint
        self.is_plain = bool(self.levels == self.joints and np.array_equal(self.to_joints, plain))

    def placement(self, cell: Cell) -> Placement:
        """Where the robots of a cell like this one stand, and their tools: one for the whole batch."""
        X_WB, X_FT = ([robot.X_WB for robot in cell.robots], [robot.tool.X_FT for robot in cell.robots])
        return self.placements(np.array([X_WB]), np.array([X_FT]))

    def placements(self, X_WB: Array, X_FT: Array) -> Placement:
        """Bases and tool tips of many cells like this one, as a batch.

        Bases are in the world, tool tips in the flange frames, shape (cells, robots, 4, 4).
        """
        bases, tools = np.moveaxis(X_WB, 0, -1), np.moveaxis(self._X_BF @ X_FT, 0, -1)
        R_WB, R_LT = np.moveaxis(bases[:, :3, :3], 0, 2), np.moveaxis(tools[:, :3, :3], 0, 2)
        p_WB, p_LT = np.moveaxis(bases[:, :3, 3], 0, 1), np.moveaxis(tools[:, :3, 3], 0, 1)
        parts = (R_WB, p_WB, R_LT, p_LT - self._last_point.T[..., None])
        return Placement(*(np.ascontiguousarray(part) for part in parts))  # the batch is the axis that is worked along

    def state(self, q: Array, placement: Placement) -> BatchState:
        """Kinematics at stacked joint vectors, shape (nq, batch)."""
        frames = self._steps(q)
        R: Array = np.broadcast_to(placement.R_WB, (3, 3, *frames.shape[3:]))
        p: Array = placement.p_WB
        for level in range(self.levels):
            frames[level] = np.einsum("ijrb,jcrb->icrb", R, frames[level])
            frames[level, :, 3] += p
            R, p = frames[level, :, :3], frames[level, :, 3]
        R_WT = np.einsum("ijrb,jkrb->ikrb", R, np.broadcast_to(placement.R_LT, R.shape))
        p_WT = p + np.einsum("ijrb,jrb->irb", R, np.broadcast_to(placement.p_LT, R.shape[1:]))
        return BatchState(np.swapaxes(frames[:, :, 4], 0, 1), np.swapaxes(frames[:, :, 3], 0, 1), R_WT, p_WT)

    def _steps(self, q: Array) -> Array:
        """How each axis turns what follows (three columns), where it is and where it points to.

        All are seen from the link before it, shape (levels, 3, 5, robots, batch).
        """
        position = self._ratio[..., None] * q[self._leader] + self._offset[..., None]
        steps = np.empty((self.levels, 3, 5, *position.shape[1:]))
        sine, versine = np.sin(position)[:, None, None], (1.0 - np.cos(position))[:, None, None]
        np.multiply(self._S, sine, out=steps[:, :, :3])
        steps[:, :, :3] += self._S2 * versine
        for k in range(3):
            steps[:, k, k] += 1.0
        steps[:, :, 3:] = self._places
        if not self.is_all_turning:
            steps[:, :, 3] += self._slide * position[:, None]
        return steps

    def _take(self, index: int, robot: Robot, chain: tuple[int, ...], *, first: int) -> None:
        """Fill in one robot."""
        model = robot.model
        before = np.zeros(3)
        for level, link in enumerate(chain):
            axis, drive = model.axes[link], model.drive(link)
            self._axis[level, :, index] = axis.axis_B
            self._step[level, :, index] = axis.point_B - before
            before = axis.point_B
            self._ratio[level, index], self._offset[level, index] = drive.ratio, drive.offset
            self._leader[level, index] = first + drive.joint
            self.is_turning[level, index] = float(axis.is_revolute)
            self.is_sliding[level, index] = float(not axis.is_revolute)
            self.to_joints[level, drive.joint, index] = self._ratio[level, index]
        self.columns[: len(model.joints), index] = first + np.arange(len(model.joints))


def _last_point(robot: Robot) -> Array:
    """The point of the axis that carries the flange, at zero joints, in B; the base origin without one."""
    return np.zeros(3) if robot.model.flange_link == BASE else robot.model.axes[robot.model.flange_link].point_B
