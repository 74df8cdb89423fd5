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
from cellplan.search.distances.cell_distances import CellDistances
from cellplan.search.kernel.job import Job
from cellplan.search.kernel.varied import KernelVariables
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Distances, Point, PointDerivatives

LENGTH: Final = 0.3  # [m] that a singular value of 1 counts as among the distances
FOLDS: Final = 4.0  # [-] times the first-order change that is kept: 2 is the fold itself
STEP: Final = 1e-5  # [rad] or [m] of central differences
WHOLE: Final = 6  # joints and constrained components of an arm that is guarded


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Found:
    """Distances of the bodies, how many they are, and the singular values' derivatives by the joints, (K, A, nq)."""

    bodies: Distances
    nodes: Indices
    by_joints: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GuardedProblem(LayoutProblem):
    """A layout problem whose last pairs are arms and their singular configurations; demanded of them is nothing.

    Attributes:
        arms: Robots of six joints whose tasks constrain all six components, A of them.
    """

    arms: tuple[int, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Note which arms are guarded."""
        LayoutProblem.__post_init__(self)
        found, robots = self.job.constraints, self.job.cell.robots
        whole = {
            int(robot)
            for robot, kept in zip(found.operators, found.kept, strict=True)
            if kept.all() and len(robots[int(robot)].model.joints) == WHOLE
        }
        object.__setattr__(self, "arms", tuple(sorted(whole)))

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
        return len(self.bodies.pairs) + len(self.arms)

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``."""
        bodies = LayoutProblem.distances(self, point, nodes, within)
        if not self.arms:
            return bodies
        values, by_joints = self._singular_values(point.q[nodes])
        arms = len(self.bodies.pairs) + np.arange(len(self.arms))
        return Distances(
            pairs=np.append(bodies.pairs, np.tile(arms, len(nodes))).astype(np.intp),
            nodes=np.append(bodies.nodes, np.repeat(nodes, len(arms))).astype(np.intp),
            values=np.append(bodies.values, LENGTH * values.ravel()),
            demands=np.append(bodies.demands, np.zeros(values.size)),
            is_own=np.append(bodies.is_own, np.ones(values.size, dtype=bool)).astype(bool),
            found=_Found(bodies=bodies, nodes=nodes, by_joints=by_joints),
        )

    def distance_derivatives(self, point: Point, found: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        if not isinstance(found.found, _Found):
            return LayoutProblem.distance_derivatives(self, point, found, by_joints)
        own = found.found
        bodies = LayoutProblem.distance_derivatives(self, point, own.bodies, by_joints)
        arms = LENGTH * own.by_joints @ by_joints.q[own.nodes]
        return np.concatenate([bodies, arms.reshape(-1, bodies.shape[1])])

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        place = pair - len(self.bodies.pairs)
        if place < 0:
            return LayoutProblem.pair_names(self, pair)
        return self.job.cell.robots[self.arms[place]].name, "a singular configuration"

    def kept_from_fold(self, taken: Array, values: Array, pairs: Indices) -> Array:
        """What rows ask for: what displacements take, shape (M,), of arms enough to keep off the fold."""
        is_arm = pairs >= len(self.bodies.pairs)
        return np.where(is_arm, np.sqrt(FOLDS * taken * np.maximum(values, 0.0)), taken)

    def _singular_values(self, q: Array) -> tuple[Array, Array]:
        """Least singular values of the arms at configurations (K, nq), shape (K, A); their derivatives, (K, A, nq)."""
        robots, count = self.job.cell.robots, len(q)
        columns = [self.job.cell.columns(robots[arm].name) for arm in self.arms]
        moved = np.tile(q, (1 + 2 * WHOLE, 1, 1))
        for joint in range(WHOLE):
            for columns_of in columns:
                moved[1 + 2 * joint, :, columns_of.start + joint] += STEP
                moved[2 + 2 * joint, :, columns_of.start + joint] -= STEP
        values = _least(self.job, moved.reshape(-1, q.shape[1]), self.arms).reshape(1 + 2 * WHOLE, count, -1)
        by = np.zeros((count, len(self.arms), q.shape[1]))
        for place, columns_of in enumerate(columns):
            slopes = (values[1::2, :, place] - values[2::2, :, place]) / (2.0 * STEP)
            by[:, place, columns_of] = slopes.T
        return values[0], by


def _least(job: Job, q: Array, arms: tuple[int, ...]) -> Array:
    """Least singular values of the Jacobians of arms about their last axes, in [m] and [rad], shape (K, A)."""
    chains, cell = job.tasks.chains, job.cell
    X = np.tile(np.array([[robot.X_WB for robot in cell.robots]]), (len(q), 1, 1, 1))
    tips = np.tile(np.array([[robot.tool.X_FT for robot in cell.robots]]), (len(q), 1, 1, 1))
    state = chains.state(np.ascontiguousarray(q.T), chains.placements(X, tips))
    axes, points = (np.ascontiguousarray(part.T)[:, list(arms)] for part in (state.axes, state.points))
    turning = chains.is_turning.T[list(arms), :, None]
    linear = np.where(turning, np.cross(axes, points[:, :, -1:] - points), axes)
    J = np.concatenate([linear, np.where(turning, axes, 0.0)], axis=-1)
    least = np.linalg.eigvalsh(np.swapaxes(J, -1, -2) @ J)[..., 0]
    return np.sqrt(np.maximum(least, 0.0))
