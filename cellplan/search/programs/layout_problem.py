"""The layout problem: bases, tools, start postures and weights; the motion by the weighted pseudo-inverse."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.model.cell import joint_at
from cellplan.model.joint_limits import JointLimits
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.run import run, run_near
from cellplan.search.kernel.screws import Directions
from cellplan.search.programs.problem import Distances, Point, PointDerivatives


class LayoutVariables(Protocol):
    """What a layout problem needs of its variables; see ``Problem`` for their bounds."""

    names: tuple[str, ...]
    lower: Array
    upper: Array
    scale: Array
    cost: Array
    given: Array

    def layouts(self, x: Array, start: Array) -> Layouts:
        """The layouts at some values, shape (K, n), with start postures near the right ones, shape (K, nq)."""

    def directions(self, x: Array) -> Directions:
        """What each variable displaces at some values, shape (n,)."""


class NearRows(Protocol):
    """Near pairs at some configurations, M of them."""

    pairs: Indices
    keys: Indices
    distances: Array
    demands: Array
    is_own: Flags


class LayoutDistances(Protocol):
    """What a layout problem needs of the bodies of its cell."""

    def near(self, x: Array, q: Array, within: float) -> NearRows:
        """Pairs less than ``within`` in [m] beyond their demand at some configurations, shape (k, nq)."""

    def derivatives(self, near: NearRows, x: Array, dq: Array) -> Array:
        """Derivatives of their distances, shape (M, n), from those of the joints at the keys, shape (k, nq, n)."""

    def names(self, pair: int) -> tuple[str, str]:
        """Names of the bodies of a pair."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """Near pairs and the nodes that their keys are."""

    near: NearRows
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
    variables: LayoutVariables
    bodies: LayoutDistances
    acceleration: Array
    is_accelerating: bool = field(init=False)

    def __post_init__(self) -> None:
        """Note once whether accelerations count at all."""
        object.__setattr__(self, "is_accelerating", bool(np.isfinite(self.acceleration).any()))

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
        near = self.bodies.near(point.x, point.q[nodes], within)
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
        return self.bodies.names(pair)

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.job.cell, column)
