"""Given path: joint motion that the cell states, of its positioner or in the null space, on the clock of a schedule."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cellplan.geometry.transforms import Array
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import JointSpline
from cellplan.model.motion.motion import Schedule


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenPath:
    """The joints of one robot over time, which the other robots only follow."""

    columns: slice  # place of its joints in the stacked joint vector
    spline: JointSpline  # the joints over the share of the clock
    end: float  # nominal time in [s] at which the clock ends

    @classmethod
    def of(cls, cell: Cell, schedule: Schedule, moving: Sequence[str]) -> "GivenPath | None":
        """The one that a cell states for a robot that moves; None where there is none."""
        end = float(schedule.times[-1] if schedule.clock is None else schedule.clock.sigma[-1])
        return cls.over(cell, end, moving)

    @classmethod
    def over(cls, cell: Cell, end: float, moving: Sequence[str]) -> "GivenPath | None":
        """The same on a clock that ends at a nominal time in [s]."""
        for robot in cell.robots:
            if robot.path is not None and robot.name in moving:
                columns = cell.columns(robot.name)
                return cls(columns=columns, spline=robot.path, end=end)
        return None

    def at(self, sigma: Array, derivative: int = 0) -> Array:
        """Its joints, or their derivatives by the nominal time, at nominal times in [s] of shape (N,), (N, n)."""
        shares = np.clip(np.asarray(sigma) / self.end, 0.0, 1.0)
        return self.spline.at(shares, derivative) / self.end**derivative


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenVelocities:
    r"""Joint velocities ``u`` that a cell states, of a given path and in the null space of the tasks.

    .. math:: \dot q = J^\# \dot x_d + (I - J^\# J) \, u

    The joints of a given path take no part in ``J``, so that they have them as they are.
    """

    splines: tuple[GivenPath, ...]  # those of the robots that move, at least one
    joint_count: int  # length of the stacked joint vector

    @classmethod
    def of(cls, cell: Cell, end: float, moving: Sequence[str]) -> "GivenVelocities | None":
        """Those on a clock that ends at a nominal time in [s]; None where nothing is stated of robots that move."""
        splines = [
            GivenPath(columns=cell.columns(robot.name), spline=spline, end=end)
            for robot in cell.robots
            for spline in (robot.path, robot.null_space)
            if spline is not None and robot.name in moving
        ]
        return cls(splines=tuple(splines), joint_count=cell.joint_count) if splines else None

    @property
    def knots(self) -> Array:
        """Nominal times in [s] at which two polynomials meet, shape (K,)."""
        return np.concatenate([given.spline.knots * given.end for given in self.splines])

    def at(self, sigma: Array) -> Array:
        """Velocities of all joints of the cell at nominal times in [s] of shape (N,), shape (nq, N)."""
        velocities = np.zeros((self.joint_count, len(sigma)))
        for given in self.splines:
            velocities[given.columns] += given.at(sigma, 1).T
        return velocities


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GivenRows:
    """A given path at the samples of a clock; no joints where there is none."""

    columns: slice  # place of its joints in the stacked joint vector
    q: Array  # their positions, shape (N, n)

    @classmethod
    def of(cls, cell: Cell, schedule: Schedule, moving: Sequence[str]) -> "GivenRows":
        """The path that a cell states for a robot that moves, at the samples of a schedule."""
        sigma = schedule.times if schedule.clock is None else schedule.clock.sigma
        path = GivenPath.of(cell, schedule, moving)
        if path is None:
            return cls(columns=slice(0, 0), q=np.zeros((len(sigma), 0)))
        return cls(columns=path.columns, q=path.at(sigma))

    def placed(self, k: int, q: Array) -> Array:
        """A configuration, shape (nq,), with these joints where they are at sample k."""
        placed = q.copy()
        placed[self.columns] = self.q[k]
        return placed
