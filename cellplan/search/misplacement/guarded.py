r"""The layout problem with arms kept away from singular configurations.

The derivatives of the joints by a displaced base grow without bound towards a singular configuration, behind which the
tool is out of reach. There the least singular value :math:`\sigma` of the arm's Jacobian falls, along the null
direction, linearly with the joints, and what is left to the fold falls with :math:`\sigma^2`. With the change R of
sigma to first order, the motion exists as long as :math:`R \le \sigma / 2`, and :math:`R \sigma` stays the same.
"""

from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Final, Self

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.frozen import derive
from cellplan.search.kernel.run import run
from cellplan.search.kernel.singular_values import SingularValues, arms
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Distances, Point, PointDerivatives
from cellplan.search.programs.program_problem import ProgramProblem
from cellplan.search.variables.phase_variables import ProgramVariables, in_place_of

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
    def like(cls, problem: LayoutProblem) -> Self:
        """The same problem, guarded."""
        return cls(
            job=problem.job, variables=problem.variables, bodies=problem.bodies, acceleration=problem.acceleration
        )

    def of_variables(self, variables: ProgramVariables) -> "GuardedProblem":
        """The same problem with other variables that change the same bodies."""
        others = in_place_of(self.variables, variables)
        return replace(GuardedProblem.like(self), variables=others, bodies=self.bodies.of_variables(others))

    @property
    def is_arm(self) -> Flags:
        """Which pairs are arms, shape (pairs,)."""
        return np.arange(len(self.bodies.pairs) + len(self.guards)) >= len(self.bodies.pairs)

    def points(self, x: Array, start: Array) -> list[Point | None]:
        """Motions at several values of the variables, shape (K, n), near one start posture; see ``evaluate``."""
        motions = run(self.job, self.variables.layouts(x, np.tile(start, (len(x), 1))))
        points = list[Point | None]()
        for values, q, qd, is_followed in zip(x, motions.q, motions.qd, motions.is_followed.tolist(), strict=True):
            points.append(Point(x=values, start=q[0], q=q, qd=qd, qdd=self.job.rates @ qd) if is_followed else None)
        return points

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
        return self.job.relations[arms(self.job)[self.guards[place]]].robot, "a singular configuration"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class GuardedProgram(ProgramProblem):
    """A program whose phases are guarded; they share no pairs."""

    phases: tuple[GuardedProblem, ...]

    def of_variables(self, variables: ProgramVariables) -> "GuardedProgram":
        """See ``GuardedProblem``."""
        phases = tuple(phase.of_variables(variables) for phase in self.phases)
        return replace(self, phases=phases, transfers=self.transfers.of_variables(variables))

    @property
    def is_arm(self) -> Flags:
        """See ``GuardedProblem``."""
        return np.concatenate([phase.is_arm for phase in self.phases])

    def points(self, x: Array, start: Array) -> list[Point | None]:
        """See ``GuardedProblem``."""
        starts = start.reshape(len(self.phases), -1)
        of_phases = [phase.points(x, begin) for phase, begin in zip(self.phases, starts, strict=True)]
        points = list[Point | None]()
        for values, *parts in zip(x, *of_phases, strict=True):
            followed = [part for part in parts if part is not None]
            points.append(self._joined(values, followed) if len(followed) == len(parts) else None)
        return points

    @property
    def _first_pairs(self) -> list[int]:
        """See ``ProgramProblem``."""
        return list(accumulate((len(phase.is_arm) for phase in self.phases[:-1]), initial=0))


Guarded = GuardedProblem | GuardedProgram


def guarded(problem: object) -> Guarded:
    """The same problem with its arms kept away from singular configurations.

    Raises:
        TypeError: The positioner has a joint path.
    """
    if isinstance(problem, ProgramProblem):
        phases = tuple(GuardedProblem.like(phase) for phase in problem.phases)
        return GuardedProgram(phases=phases, transfers=problem.transfers, homes=problem.homes)
    if isinstance(problem, LayoutProblem):
        return GuardedProblem.like(problem)
    raise TypeError("displaced bases: expected motions by the pseudo-inverse, got a joint path")


def away_from_fold(problem: Guarded, taken: Array, values: Array, pairs: Indices) -> Array:
    """What rows ask for: what displacements take, shape (M,), of arms enough to keep off the fold."""
    return np.where(problem.is_arm[pairs], np.sqrt(FOLDS * taken * np.maximum(values, 0.0)), taken)
