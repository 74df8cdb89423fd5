"""The path problem: the spline of a positioner and, besides, what a layout may vary; operators follow their tasks."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.model.cell import joint_at
from cellplan.model.joint_limits import JointLimits
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Layouts
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.kernel.varied import KernelVariables
from cellplan.search.programs.near_pairs import PairsAtNodes, distances_at
from cellplan.search.programs.problem import Distances, Point, PointDerivatives
from cellplan.search.spline_path.derivatives import path_derivatives
from cellplan.search.spline_path.followed import continued, followed
from cellplan.search.spline_path.nodes import PathNodes
from cellplan.search.spline_path.variables import PathVariables


class WrittenVariables(KernelVariables, Protocol):
    """Variables of the layout, of which there may be none, that know how the cell file writes them."""

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PathProblem:
    """See ``Problem``: the coefficients of the path are the first variables, those of the layout the others."""

    nodes: PathNodes  # the job at its nodes
    path: PathVariables  # the coefficients
    layout: WrittenVariables  # what else may vary
    bodies: CellDistances
    acceleration: Array  # see ``Problem``
    names: tuple[str, ...] = field(init=False)
    lower: Array = field(init=False)
    upper: Array = field(init=False)
    scale: Array = field(init=False)
    cost: Array = field(init=False)
    given: Array = field(init=False)
    is_dense: bool = field(init=False, default=True)  # its nodes are cheap; wrists near a singularity make peaks narrow
    times: Array = field(init=False)
    limits: JointLimits = field(init=False)

    def __post_init__(self) -> None:
        """Put the variables one after the other."""
        derive(self, times=self.nodes.job.times, limits=self.nodes.job.limits)
        path, layout = self.path, self.layout
        given = np.concatenate([path.given.coefficients.ravel(), layout.given])
        derive(self, names=(*path.names, *layout.names), given=given)
        for name in ("lower", "upper", "scale", "cost"):
            derive(self, **{name: np.concatenate([getattr(path, name), getattr(layout, name)])})

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        spline, others = self._split(x)
        coefficients = self.path.spline(spline).coefficients
        placement = self.layout.layouts(others[None], start[None]).placement(self.nodes.job)
        q = continued(self.nodes, placement, coefficients, start) if near is None else near.q
        motion = None if q is None else followed(self.nodes, placement, coefficients, q)
        if motion is None:
            return None
        q, qd = motion
        qdd = self.nodes.rates @ qd
        qdd[:, self.nodes.columns] = self.nodes.shares[2] @ coefficients
        return Point(x=x, start=q[0], q=q, qd=qd, qdd=qdd)

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        _, others = self._split(point.x)
        return path_derivatives(
            self.nodes,
            self._layout_at(point),
            point.q,
            point.qd,
            self.layout.directions(others),
            is_accelerating=bool(np.isfinite(self.acceleration).any()),
        )

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        return distances_at(self.bodies, self._split(point.x)[1], point.q, nodes, within)

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        pairs, count, (_, others) = PairsAtNodes.of(distances), len(self.path.names), self._split(point.x)
        near, dq = pairs.near, by_joints.q[pairs.nodes]
        by_path = (near.by_joints[:, None] @ dq[near.keys][..., :count])[:, 0]
        if not len(others):
            return by_path
        return np.concatenate([by_path, self.bodies.derivatives(near, others, dq[..., count:])], axis=1)

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``."""
        _, others = self._split(point.x)
        return SingularValues.of(
            self.nodes.job, self._layout_at(point), point.q, lambda: self.layout.directions(others)
        )

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.bodies.pairs[pair].names

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.nodes.job.cell, column)

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address: the path in place of the start posture of its robot."""
        spline, others = self._split(x)
        values, robot = self.layout.values(others, start), f"robots.{self.path.robot}"
        for key in ("start", "start_deg"):
            values[f"{robot}.{key}"] = None
        values[f"{robot}.path"] = self.path.written(self.nodes.job.cell, spline)
        return values

    def _split(self, x: Array) -> tuple[Array, Array]:
        """The coefficients, and the variables of the layout."""
        count = len(self.path.names)
        return x[:count], x[count:]

    def _layout_at(self, point: Point) -> Layouts:
        """The layout at a point."""
        return self.layout.layouts(self._split(point.x)[1][None], point.start[None])
