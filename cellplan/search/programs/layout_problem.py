"""The layout problem: bases, tools, start postures and weights; the motion by the weighted pseudo-inverse."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.model.cell.cell import joint_at
from cellplan.model.motion.motion import Schedule
from cellplan.scene.near import NearPairs
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.job import Job, enough_nodes
from cellplan.search.kernel.run import run, run_near
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.kernel.varied import VARIED, KernelVariables
from cellplan.search.programs.problem import Distances, Point, PointDerivatives, ProblemFields
from cellplan.search.programs.transfers import Transfers


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LayoutProblem(ProblemFields):
    """See ``Problem``."""

    job: Job  # the job at its nodes
    variables: KernelVariables  # what may vary
    bodies: CellDistances
    acceleration: Array  # see ``Problem``
    is_accelerating: bool = field(init=False)
    by_start: Array = field(init=False)  # changes of the variables by those of the joints at the start, shape (n, nq)

    def __post_init__(self) -> None:
        """Note what the variables and the job know, and whether accelerations count."""
        derive(self, **{name: getattr(self.variables, name) for name in VARIED})
        derive(self, by_start=np.linalg.pinv(self.variables.directions(self.given).start))
        is_accelerating = bool(np.isfinite(self.acceleration).any())
        derive(self, times=self.job.times, limits=self.job.limits, is_accelerating=is_accelerating)
        derive(self, transfers=Transfers.none(self.job.cell.joint_count, nodes=len(self.times)))

    def finer(self, schedule: Schedule, *, nodes: int, denser: Sequence[float] = ()) -> Self:
        """The same problem on about so many nodes evenly, and more about some times in [s] on their clock."""
        enough = enough_nodes(schedule, nodes)
        job = Job.of(self.job.cell, schedule, moving=self.job.moving, nodes=enough, denser=denser)
        return replace(self, job=job)

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        layout = self.variables.layouts(x[None], start[None])
        motion = run(self.job, layout) if near is None else run_near(self.job, layout, near.q[None], near.rates)
        if not motion.is_followed[0]:
            return None
        q, qd = (np.ascontiguousarray(part[0]) for part in (motion.q, motion.qd))
        x = x + self.by_start @ (q[0] - layout.start[0])  # a start posture that varies, with the tool on its path
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=self.job.rates @ qd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        layout = self.variables.layouts(point.x[None], point.start[None])
        motion = differentiate(self.job, layout, point.q, point.qd, self.variables.directions(point.x))
        nodes, nq, count = motion.qd.shape
        qdd = None
        if self.is_accelerating:
            qdd = (self.job.rates @ motion.qd.reshape(nodes, -1)).reshape(nodes, nq, count)
        return PointDerivatives(q=motion.q, qd=motion.qd, qdd=qdd, rates=motion.rates)

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        return distances_at(self.bodies, point.x, point.q, nodes, within)

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        pairs = PairsAtNodes.of(distances)
        return self.bodies.derivatives(pairs.near, point.x, by_joints.q[pairs.nodes])

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``."""
        layout = self.variables.layouts(point.x[None], point.start[None])
        return SingularValues.of(self.job, layout, point.q, lambda: self.variables.directions(point.x))

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.bodies.pairs[pair].names

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.job.cell, column)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PairsAtNodes:
    """Near pairs and the nodes that their keys are."""

    near: NearPairs  # the pairs
    nodes: Indices  # the nodes, shape (K,)

    @classmethod
    def of(cls, distances: Distances) -> "PairsAtNodes":
        """Those that distances came from."""
        if not isinstance(distances.detail, PairsAtNodes):
            raise TypeError("distance_derivatives: expected distances of this problem")
        return distances.detail


def distances_at(bodies: CellDistances, x: Array, q: Array, nodes: Indices, within: float) -> Distances:
    """Pairs of bodies that are less than a distance beyond what is demanded of any.

    Args:
        x: Variables of the layout, shape (n,).
        q: Joint positions at all nodes in [rad] or [m], shape (N, nq).
        nodes: The nodes that are asked for, shape (K,).
        within: The distance in [m].
    """
    near = bodies.near(x, q[nodes], within + bodies.most_demanded)
    return Distances(
        pairs=near.rows,
        nodes=nodes[near.samples],
        values=near.distances,
        demands=bodies.demands[near.rows],
        within_robot=bodies.within_robot[near.rows],
        detail=PairsAtNodes(near=near, nodes=nodes),
    )
