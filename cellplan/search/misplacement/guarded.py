r"""The layout problem with arms kept away from singular configurations.

The derivatives of the joints by a displaced base grow without bound towards a singular configuration, behind which the
tool is out of reach. There the least singular value :math:`\sigma` of the arm's Jacobian falls, along the null
direction, linearly with the joints, and what is left to the fold falls with :math:`\sigma^2`. With the change R of
sigma to first order, the motion exists as long as :math:`R \le \sigma / 2`, and :math:`R \sigma` stays the same.
"""

from dataclasses import dataclass, field
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Indices
from cellplan.geometry.frozen import derive
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.singular_values import SingularValues, arms
from cellplan.search.kernel.varied import KernelVariables
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Distances, Point, PointDerivatives

LENGTH: Final = 0.3  # [m] that a singular value of 1 counts as among the distances
FOLDS: Final = 4.0  # [-] times the first-order change that is kept: 2 is the fold itself


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Measured:
    """Distances of the bodies, the singular values at all nodes, and the node and arm of each that counts."""

    bodies: Distances
    arms: SingularValues
    nodes: Indices
    subjects: Indices


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GuardedProblem(LayoutProblem):
    """A layout problem whose last pairs are arms and their singular configurations; demanded of them is nothing."""

    guards: Indices = field(init=False)  # arms with no fewer joints than their task has components, shape (G,)

    def __post_init__(self) -> None:
        """Note which arms are guarded."""
        LayoutProblem.__post_init__(self)
        constrained, robots = self.job.constraints.constrained.sum(axis=1), self.job.cell.robots
        joints = [len(robots[int(robot)].model.joints) for robot in self.job.constraints.operators]
        redundant = [count for count, place in enumerate(arms(self.job)) if joints[place] >= constrained[place]]
        derive(self, guards=np.array(redundant, dtype=np.intp))

    @classmethod
    def like(
        cls,
        problem: LayoutProblem,
        *,
        variables: KernelVariables | None = None,
        bodies: CellDistances | None = None,
    ) -> Self:
        """The same problem, guarded, perhaps with other variables."""
        return cls(
            job=problem.job,
            variables=variables or problem.variables,
            bodies=bodies or problem.bodies,
            acceleration=problem.acceleration,
        )

    @property
    def pair_count(self) -> int:
        """Number of pairs, arms among them."""
        return len(self.bodies.pairs) + len(self.guards)

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        bodies = LayoutProblem.distances(self, point, nodes, within)
        if not len(self.guards):
            return bodies
        at, subjects = np.repeat(nodes, len(self.guards)), np.tile(self.guards, len(nodes))
        measured = _Measured(bodies=bodies, arms=self.arms(point), nodes=at, subjects=subjects)
        pairs = len(self.bodies.pairs) + np.tile(np.arange(len(self.guards)), len(nodes))
        return Distances(
            pairs=np.append(bodies.pairs, pairs).astype(np.intp),
            nodes=np.append(bodies.nodes, at).astype(np.intp),
            values=np.append(bodies.values, LENGTH * measured.arms.values[at, subjects]),
            demands=np.append(bodies.demands, np.zeros(len(at))),
            within_robot=np.append(bodies.within_robot, np.ones(len(at), dtype=bool)).astype(bool),
            detail=measured,
        )

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        if not isinstance(distances.detail, _Measured):
            return LayoutProblem.distance_derivatives(self, point, distances, by_joints)
        measured = distances.detail
        bodies = LayoutProblem.distance_derivatives(self, point, measured.bodies, by_joints)
        return np.concatenate(
            [bodies, LENGTH * measured.arms.derivatives(measured.nodes, measured.subjects, by_joints.q)]
        )

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        place = pair - len(self.bodies.pairs)
        if place < 0:
            return LayoutProblem.pair_names(self, pair)
        relation = self.job.relations[arms(self.job)[self.guards[place]]]
        return relation.robot, "a singular configuration"

    def away_from_fold(self, taken: Array, values: Array, pairs: Indices) -> Array:
        """What rows ask for: what displacements take, shape (M,), of arms enough to keep off the fold."""
        is_arm = pairs >= len(self.bodies.pairs)
        return np.where(is_arm, np.sqrt(FOLDS * taken * np.maximum(values, 0.0)), taken)
