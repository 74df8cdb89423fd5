"""Scenarios: motions of one layout in place and with displaced bases, which keep their limits in one cycle."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from cellplan.geometry.arrays import Array
from cellplan.geometry.frozen import derive
from cellplan.search.kernel.derivatives import differentiate
from cellplan.search.kernel.run import run, run_near
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.misplacement.displacements import BaseDisplacements
from cellplan.search.misplacement.guarded import GuardedProblem
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Point, PointDerivatives


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ScenarioProblem(GuardedProblem):
    """A layout problem whose nodes are those of several motions, one after the other: one for each displacement.

    The variables are those of the layout. Every motion is planned anew. Distances are those of the layout in place.
    Directions of a displaced base are those of the base in place: the same for one that is moved and turned about the
    vertical.
    """

    displacements: BaseDisplacements  # whose bases are displaced
    d: Array  # by how much, shape (S, m); no displacement first

    def __post_init__(self) -> None:
        """Repeat the nodes."""
        GuardedProblem.__post_init__(self)
        derive(self, times=np.tile(self.job.times, len(self.d)))

    @classmethod
    def of(cls, problem: LayoutProblem, displacements: BaseDisplacements, d: Array) -> Self:
        """Scenarios of a layout problem, with displacements of shape (S, m)."""
        return cls(
            job=problem.job,
            variables=displacements.variables,
            bodies=problem.bodies,
            acceleration=problem.acceleration,
            displacements=displacements,
            d=d,
        )

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``; the start posture is that of the layout in place."""
        count = len(self.d)
        if near is None:
            motion = run(self.job, self.displacements.at(x).layouts(self.d, np.tile(start, (count, 1))))
        else:
            q = near.q.reshape(count, -1, near.q.shape[1])
            motion = run_near(self.job, self.displacements.at(x).layouts(self.d, q[:, 0]), q, near.rates)
        if not motion.is_followed.all():
            return None
        all_q, all_qd = (np.ascontiguousarray(part).reshape(-1, len(start)) for part in (motion.q, motion.qd))
        qdd = (self.job.rates @ motion.qd).reshape(all_qd.shape)
        return Point(x=x, start=all_q[0], q=all_q, qd=all_qd, qdd=qdd)

    def arms(self, point: Point) -> SingularValues:
        """See ``Problem``: the arms of the layout in place."""
        return GuardedProblem.arms(self, replace(point, q=point.q[: len(self.job.times)]))

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``; rates are those of the layout in place."""
        count, nq = len(self.d), point.q.shape[1]
        q, qd = (part.reshape(count, -1, nq) for part in (point.q, point.qd))
        layouts = self.displacements.at(point.x).layouts(self.d, q[:, 0])
        directions = self.variables.directions(point.x)
        derivatives = [
            differentiate(self.job, layouts.of_places(slice(place, place + 1)), q[place], qd[place], directions)
            for place in range(count)
        ]
        by_q, by_qd = (
            np.concatenate([derivative.q for derivative in derivatives]),
            np.concatenate([derivative.qd for derivative in derivatives]),
        )
        qdd = None
        if self.is_accelerating:
            qdd = (self.job.rates @ by_qd.reshape(count, q.shape[1], -1)).reshape(by_qd.shape)
        return PointDerivatives(q=by_q, qd=by_qd, qdd=qdd, rates=derivatives[0].rates)
