"""The problem of a program: motions one after the other that share all variables, and the transfers between them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate, pairwise
from typing import Any, Final, cast

import numpy as np

from cellplan.geometry.arrays import Array, Flags, Indices
from cellplan.geometry.frozen import derive
from cellplan.search.kernel.singular_values import SingularValues
from cellplan.search.kernel.varied import VARIED
from cellplan.search.programs.layout_problem import LayoutProblem
from cellplan.search.programs.problem import Distances, Point, PointDerivatives, ProblemFields
from cellplan.search.programs.transfers import HOME, Transfers

FAR_FROM_SINGULAR: Final = 1e6  # [m] and [rad] in place of singular values of arms that are not at work


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramProblem(ProblemFields):
    """See ``Problem``; the nodes of all phases follow one another, and so do their P start postures, shape (P nq,)."""

    phases: tuple[LayoutProblem, ...]  # the problems of its phases, P of them
    transfers: Transfers  # what leads from each to the next
    homes: Indices  # phases at whose start the joints stand that are idle, or ``HOME`` where they do not, (P, nq)
    acceleration: Array = field(init=False)

    def __post_init__(self) -> None:
        """Put the nodes of the phases one after the other."""
        derive(self, **{name: getattr(self.phases[0], name) for name in (*VARIED, "acceleration", "limits")})
        begins = accumulate((float(phase.times[-1]) for phase in self.phases), initial=0.0)
        times = [begin + phase.times for begin, phase in zip(begins, self.phases, strict=False)]
        derive(self, times=np.concatenate(times))

    def evaluate(self, x: Array, start: Array, near: Point | None = None) -> Point | None:
        """See ``Problem``."""
        points = list[Point]()
        for place, (phase, begin) in enumerate(zip(self.phases, start.reshape(len(self.phases), -1), strict=True)):
            point = phase.evaluate(x, begin, None if near is None else self._of_phase(near, place))
            if point is None:
                return None
            points.append(point)
        return self._joined(x, points)

    def _joined(self, x: Array, points: Sequence[Point]) -> Point:
        """The point whose phases have some motions."""
        motion = _stacked(points, "q", "qd", "qdd")
        q = self._at_homes(motion["q"])
        return Point(x=x, start=q[[part.start for part in self.transfers.parts]].ravel(), **{**motion, "q": q})

    def derivatives(self, point: Point) -> PointDerivatives:
        """See ``Problem``."""
        parts = [phase.derivatives(self._of_phase(point, place)) for place, phase in enumerate(self.phases)]
        derivatives = _stacked(parts, "q", "qd", "qdd", "rates")
        return PointDerivatives(**{**derivatives, "q": self._at_homes(derivatives["q"])})

    def _at_homes(self, q: Array) -> Array:
        """Joints at the nodes, or their derivatives, (N, nq, ...), with idle robots where their work begins."""
        moved = q.copy()
        for rows, phases in zip(self.transfers.parts, self.homes, strict=True):
            columns = np.flatnonzero(phases != HOME)
            firsts = [self.transfers.parts[phase].start for phase in phases[columns].tolist()]
            moved[rows, columns] = q[firsts, columns]
        return moved

    def distances(self, point: Point, nodes: Indices, within: float) -> Distances:
        """See ``Problem``; a tool and the part that it works on may touch: of them the task sets the distance."""
        all_near, parts = list[Distances](), self.transfers.parts
        for place, (phase, rows) in enumerate(zip(self.phases, parts, strict=True)):
            chosen = nodes[(nodes >= rows.start) & (nodes < rows.stop)] - rows.start
            near = phase.distances(self._of_phase(point, place), chosen, within)
            may_touch = (near.demands <= 0.0) & (phase.bodies.most_demanded > 0.0)
            all_near.append(replace(near, nodes=near.nodes + rows.start, within_robot=near.within_robot | may_touch))
        firsts = [first + near.pairs for first, near in zip(self._first_pairs, all_near, strict=True)]
        return Distances(
            **_stacked(all_near, "nodes", "values", "demands", "within_robot"),
            pairs=np.concatenate(firsts),
            detail=[replace(near, nodes=near.nodes - rows.start) for near, rows in zip(all_near, parts, strict=True)],
        )

    def distance_derivatives(self, point: Point, distances: Distances, by_joints: PointDerivatives) -> Array:
        """See ``Problem``."""
        near, derivatives = cast("list[Distances]", distances.detail), list[Array]()
        for place, (phase, rows) in enumerate(zip(self.phases, self.transfers.parts, strict=True)):
            by_phase = PointDerivatives(q=by_joints.q[rows], qd=by_joints.qd[rows], qdd=None)
            derivatives.append(phase.distance_derivatives(self._of_phase(point, place), near[place], by_phase))
        return np.concatenate(derivatives)

    def arms(self, point: Point) -> "ProgramArms":
        """See ``Problem``."""
        arms = [phase.arms(self._of_phase(point, place)) for place, phase in enumerate(self.phases)]
        return ProgramArms(arms=arms, parts=self.transfers.parts)

    def pair_names(self, pair: int) -> tuple[str, str]:
        """See ``Problem``."""
        first = max(first for first in self._first_pairs if first <= pair)
        return self.phases[self._first_pairs.index(first)].pair_names(pair - first)

    def joint_names(self, column: int) -> tuple[str, str]:
        """See ``Problem``."""
        return self.phases[0].joint_names(column)

    @property
    def _first_pairs(self) -> list[int]:
        """Number of the first pair of each phase; phases with the same bodies share their pairs."""
        first, bodies, count = list[int](), [phase.bodies for phase in self.phases], 0
        for place, one in enumerate(bodies):
            known = bodies.index(one)
            first.append(first[known] if known < place else count)
            count += len(one.pairs) if known == place else 0
        return first

    def _of_phase(self, point: Point, place: int) -> Point:
        """The part of a point that is the motion of one phase."""
        rows = self.transfers.parts[place]
        return Point(
            x=point.x,
            start=point.start.reshape(len(self.phases), -1)[place],
            q=point.q[rows],
            qd=point.qd[rows],
            qdd=point.qdd[rows],
            rates=None if point.rates is None else point.rates[rows],
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProgramArms:
    """See ``ArmValues``: the arms of each phase, which count in its nodes only."""

    arms: Sequence[SingularValues]  # those of the phases
    parts: tuple[slice, ...]  # nodes of the phases

    @property
    def names(self) -> tuple[str, ...]:
        """See ``ArmValues``."""
        return tuple(name for arms in self.arms for name in arms.names)

    @property
    def values(self) -> Array:
        """See ``ArmValues``."""
        values = np.full((self.parts[-1].stop, len(self.names)), FAR_FROM_SINGULAR)
        for arms, rows, columns in zip(self.arms, self.parts, self._columns, strict=True):
            values[rows, columns] = arms.values
        return values

    def derivatives(self, nodes: Indices, subjects: Indices, by: Array) -> Array:
        """See ``ArmValues``."""
        derivatives = np.zeros((len(nodes), by.shape[2]))
        for arms, rows, columns in zip(self.arms, self.parts, self._columns, strict=True):
            of_phase: Flags = (columns.start <= subjects) & (subjects < columns.stop)
            of_phase &= (rows.start <= nodes) & (nodes < rows.stop)
            if of_phase.any():
                chosen = nodes[of_phase] - rows.start, subjects[of_phase] - columns.start
                derivatives[of_phase] = arms.derivatives(*chosen, by[rows])
        return derivatives

    @property
    def _columns(self) -> list[slice]:
        """Columns of the arms of each phase."""
        return [slice(*edge) for edge in pairwise([0, *accumulate(len(arms.names) for arms in self.arms)])]


def _stacked(parts: Sequence[object], *names: str) -> dict[str, Any]:
    """Arrays of all phases one after the other, by name; None where a phase has none."""
    arrays = {name: [getattr(part, name) for part in parts] for name in names}
    return {
        name: None if any(one is None for one in group) else np.concatenate(group) for name, group in arrays.items()
    }
