"""The layout problem: bases, tools, start postures and weights; the motion by the weighted pseudo-inverse."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.model.cell import joint_at
from cellplan.model.joint_limits import JointLimits
from cellplan.model.motion import Schedule
from cellplan.search.distances.cell_distances import CellDistances, LayoutDistances
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.run import run, run_near
from cellplan.search.programs.problem import Distances, Point, PointDerivatives
from cellplan.search.variables.variables import Variables


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """Near pairs and the nodes that their keys are."""

    near: LayoutDistances
    nodes: Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutProblem:
    """See ``Problem``.

    Attributes:
        job: The job at its nodes.
        variables: What may vary.
        bodies: The bodies of the cell.
        acceleration: See ``Problem``.
    """

    job: Job
    variables: Variables
    bodies: CellDistances
    acceleration: Array
    is_accelerating: bool = field(init=False)
    most_demanded: float = field(init=False)

    def __post_init__(self) -> None:
        """Note once whether accelerations count at all, and the largest distance that is demanded in [m]."""
        object.__setattr__(self, "is_accelerating", bool(np.isfinite(self.acceleration).any()))
        object.__setattr__(self, "most_demanded", max((pair.demand for pair in self.bodies.pairs), default=0.0))

    def finer(self, schedule: Schedule, *, nodes: int, instants: Sequence[float] = ()) -> Self:
        """The same problem on more nodes.

        Args:
            schedule: The tasks on the common clock.
            nodes: About how many nodes there are, evenly.
            instants: Times in [s] on the clock of the nodes about which there are more.
        """
        job = Job.of(self.job.cell, schedule, moving=self.job.moving, nodes=nodes, instants=instants)
        return replace(self, job=job)

    @property
    def names(self) -> tuple[str, ...]:
        """See ``Problem``."""
        return self.variables.names

    @property
    def lower(self) -> Array:
        """See ``Problem``."""
        return self.variables.lower

    @property
    def upper(self) -> Array:
        """See ``Problem``."""
        return self.variables.upper

    @property
    def scale(self) -> Array:
        """See ``Problem``."""
        return self.variables.scale

    @property
    def cost(self) -> Array:
        """See ``Problem``."""
        return self.variables.cost

    @property
    def given(self) -> Array:
        """See ``Problem``."""
        return self.variables.given

    @property
    def times(self) -> Array:
        """See ``Problem``."""
        return self.job.times

    @property
    def limits(self) -> JointLimits:
        """See ``Problem``."""
        return self.job.limits

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        layout = self.variables.layouts(x[None], start[None])
        motion = run(self.job, layout) if near is None else run_near(self.job, layout, near.q[None])
        if not motion.is_followed[0]:
            return None
        q, qd = (np.ascontiguousarray(part[0]) for part in (motion.q, motion.qd))
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=self.job.rates @ qd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        layout = self.variables.layouts(point.x[None], point.start[None])
        found = differentiate(self.job, layout, point.q, point.qd, self.variables.directions(point.x))
        nodes, nq, count = found.qd.shape
        qdd = None
        if self.is_accelerating:
            qdd = (self.job.rates @ found.qd.reshape(nodes, -1)).reshape(nodes, nq, count)
        return PointDerivatives(q=found.q, qd=found.qd, qdd=qdd)

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        layout = self.variables.layouts(point.x[None], point.start[None])
        near = self.bodies.near(point.x, layout, point.q[nodes], within + self.most_demanded)
        return Distances(
            pairs=near.pairs,
            nodes=nodes[near.keys],
            values=near.distances,
            demands=near.demands,
            is_own=near.is_own,
            found=_Found(near=near, nodes=nodes),
        )

    def distance_derivatives(self, point: Point, found: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        if not isinstance(found.found, _Found):
            raise TypeError("distance_derivatives: expected distances of this problem")
        return self.bodies.derivatives(found.found.near, point.x, by_joints.q[found.found.nodes])

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.bodies.pairs[pair].names

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.job.cell, column)
