r"""The null-space problem: splines of joints whose velocities are projected onto the null space, and layout variables.

The joints follow :math:`\dot q = J^\# \dot x_d + (I - J^\# J) u` with velocities ``u`` linear in the coefficients. All
that tasks leave open is so free, spins of tools too, while what is rough in a desired motion is shared by all joints
as their weights say.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.model.cell.cell import Cell
from cellplan.model.cell.joint_spline import basis
from cellplan.model.motion.motion import Schedule
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.job import Job, enough_nodes
from cellplan.search.kernel.run import run, run_near
from cellplan.search.kernel.screws import Directions
from cellplan.search.programs.problem import Point, PointDerivatives
from cellplan.search.spline_path.spline_problem import SplineProblem


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NullSpaceNodes:
    """The job of a cell at its nodes, and what the coefficients of the splines do there."""

    job: Job  # the job without them
    columns: Indices  # columns of the joints that have splines, shape (n,)
    shape: tuple[int, int]  # number of coefficients and degree of the splines
    rates: Array = field(init=False)  # share in [1/s] of each coefficient in the speed of its joint, (N, count)

    def __post_init__(self) -> None:
        """Work out the velocities."""
        end = float(self.job.times[-1])
        derive(self, rates=basis(self.job.times / end, *self.shape, 1) / end)

    @classmethod
    def of(
        cls, cell: Cell, schedule: Schedule, robots: tuple[str, ...], *, shape: tuple[int, int], nodes: int
    ) -> "NullSpaceNodes":
        """The nodes of the kernel.

        Args:
            robots: Names of the robots whose joints have splines.
            shape: Number of coefficients and degree of the splines.
            nodes: Least number of nodes.
        """
        without = [replace(robot, null_space=None) if robot.name in robots else robot for robot in cell.robots]
        cell = replace(cell, robots=tuple(without))
        moving = [robot.name for robot in cell.robots]
        job = Job.of(cell, schedule, moving=moving, nodes=enough_nodes(schedule, nodes))
        places = np.arange(cell.joint_count)
        return cls(job=job, columns=np.concatenate([places[cell.columns(robot)] for robot in robots]), shape=shape)

    def led(self, coefficients: Array) -> Job:
        """The job with the velocities of splines of coefficients (count, n)."""
        drift = (
            np.zeros((len(self.job.times), self.job.cell.joint_count))
            if self.job.drift is None
            else self.job.drift.copy()
        )
        drift[:, self.columns] += self.rates @ coefficients
        return replace(self.job, drift=drift)

    def directions(self, others: Directions) -> Directions:
        """Directions of all coefficients, one configuration after the other, then those of the layout."""
        nodes, count = self.rates.shape
        before = count * len(self.columns)
        drift = np.zeros((nodes, self.job.cell.joint_count, before + others.count))
        for place, column in enumerate(self.columns):
            drift[:, column, place : before : len(self.columns)] = self.rates
        padded = {
            name: np.concatenate([np.zeros((*part.shape[:-1], before)), part], axis=-1)
            for name in ("base", "tool", "start", "weights")
            for part in (getattr(others, name),)
        }
        return Directions(**padded, drift=drift)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NullSpaceProblem(SplineProblem):
    """See ``Problem`` and the module."""

    nodes: NullSpaceNodes

    def finer(self, schedule: Schedule, *, nodes: int, denser: Sequence[float] = ()) -> Self:
        """The same problem on about so many nodes evenly, and more about some times in [s] on their clock."""
        job = self.nodes.job
        job = Job.of(job.cell, schedule, moving=job.moving, nodes=enough_nodes(schedule, nodes), denser=denser)
        return replace(self, nodes=replace(self.nodes, job=job))

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        spline, others = self.split(x)
        job = self.nodes.led(self.path.spline(spline).coefficients)
        layout = self.layout.layouts(others[None], start[None])
        motion = run(job, layout) if near is None else run_near(job, layout, near.q[None], near.rates)
        if not motion.is_followed[0]:
            return None
        q, qd = (np.ascontiguousarray(part[0]) for part in (motion.q, motion.qd))
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=job.rates @ qd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        spline, others = self.split(point.x)
        job = self.nodes.led(self.path.spline(spline).coefficients)
        directions = self.nodes.directions(self.layout.directions(others))
        motion = differentiate(job, self.layout_at(point), point.q, point.qd, directions)
        qdd = None
        if np.isfinite(self.acceleration).any():
            qdd = (job.rates @ motion.qd.reshape(len(motion.qd), -1)).reshape(motion.qd.shape)
        return PointDerivatives(q=motion.q, qd=motion.qd, qdd=qdd, rates=motion.rates)
