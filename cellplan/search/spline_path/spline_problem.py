"""Spline problem: what problems have in common whose first variables are coefficients of splines of joints."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.model.cell.cell import joint_at
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Job, Layouts
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.kernel.varied import KernelVariables
from cellplan.search.programs.layout_problem import PairsAtNodes, distances_at
from cellplan.search.programs.problem import DRAWS, Distances, Point, PointDerivatives, ProblemFields
from cellplan.search.programs.transfers import Transfers
from cellplan.search.spline_path.variables import PathVariables

WAVES: Final = 4  # cosines along the path, from the constant to one and a half periods
SHARE: Final = 0.5  # of a usual step, of the constant; of each further wave less
SMALLER: Final = 0.9  # factor of the next draw where a tool could not follow


class WrittenVariables(KernelVariables, Protocol):
    """Variables of the layout, of which there may be none, that know how the cell file writes them."""

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address."""


class JobNodes(Protocol):
    """A job at its nodes."""

    @property
    def job(self) -> Job:
        """The job."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SplineProblem(ProblemFields, ABC):
    """See ``Problem``: the coefficients are the first variables, those of the layout the others."""

    nodes: JobNodes  # the job at its nodes
    path: PathVariables  # the coefficients
    layout: WrittenVariables  # what else may vary
    bodies: CellDistances
    acceleration: Array  # see ``Problem``

    def __post_init__(self) -> None:
        """Put the variables one after the other."""
        job = self.nodes.job
        derive(self, times=job.times, limits=job.limits)
        derive(self, transfers=Transfers.none(job.cell.joint_count, nodes=len(job.times)))
        path, layout = self.path, self.layout
        given = np.concatenate([path.given.coefficients.ravel(), layout.given])
        derive(self, names=(*path.names, *layout.names), given=given)
        for name in ("lower", "upper", "scale", "cost"):
            derive(self, **{name: np.concatenate([getattr(path, name), getattr(layout, name)])})

    @abstractmethod
    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""

    @abstractmethod
    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        return distances_at(self.bodies, self.split(point.x)[1], point.q, nodes, within)

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        pairs, count, (_, others) = PairsAtNodes.of(distances), len(self.path.names), self.split(point.x)
        near, dq = pairs.near, by_joints.q[pairs.nodes]
        by_path = (near.by_joints[:, None] @ dq[near.samples][..., :count])[:, 0]
        if not len(others):
            return by_path
        return np.concatenate([by_path, self.bodies.derivatives(near, others, dq[..., count:])], axis=1)

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``."""
        _, others = self.split(point.x)
        return SingularValues.of(self.nodes.job, self.layout_at(point), point.q, lambda: self.layout.directions(others))

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.bodies.pairs[pair].names

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return joint_at(self.nodes.job.cell, column)

    def values(self, x: Array, start: Array) -> dict[str, object]:
        """What to write into the cell file, by address."""
        spline, others = self.split(x)
        return self.layout.values(others, start) | self.path.written(self.nodes.job.cell, spline)

    def split(self, x: Array) -> tuple[Array, Array]:
        """The coefficients, and the variables of the layout."""
        count = len(self.path.names)
        return x[:count], x[count:]

    def layout_at(self, point: Point) -> Layouts:
        """The layout at a point."""
        return self.layout.layouts(self.split(point.x)[1][None], point.start[None])


def perturbed_path(
    problem: SplineProblem, x: Array, start: Array, rng: np.random.Generator, *, size: float
) -> Point | None:
    """A random point near a given one, drawn again and smaller until all tools can follow their paths, or None.

    Args:
        x: The variables, shape (n,).
        start: Start posture near the right one in [rad] or [m], shape (nq,).
        size: Standard deviation in usual steps.
    """
    origin = problem.evaluate(x, start)
    if origin is None:
        return None
    rows, columns = problem.path.given.coefficients.shape
    order = np.arange(WAVES)
    waves = np.cos(np.pi * np.linspace(0.0, 1.0, rows)[:, None] * order) * SHARE / (1.0 + order)
    for _ in range(DRAWS):
        path = (waves @ rng.normal(size=(WAVES, columns))).ravel()
        step = np.concatenate([path, rng.normal(size=len(x) - len(path))])
        point = problem.evaluate(np.clip(x + size * problem.scale * step, problem.lower, problem.upper), start, origin)
        if point is not None:
            return point
        size *= SMALLER
    return None
